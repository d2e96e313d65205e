"""Textures by Mitsuba's plugins, as the reference reads them, against values by hand."""

from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from cases import cases

from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.texture import Texture
from renderer.scene.camera import OrthographicCamera, primary_rays
from renderer.scene.light import DirectionalLight
from renderer.scene.scene import Scene, SceneObject
from validation.references.mitsuba.path import can_judge as path_can_judge
from validation.references.mitsuba.scene import mitsuba_rays
from validation.references.mitsuba.textures import without_mip_maps
from validation.references.mitsuba.whitted import aovs, can_judge, recursion_of, whitted

FLOAT32 = 1e-5
UNIT = [[0, 0], [1, 0], [1, 1], [0, 1]]
ROWS = np.float32([[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 0]]])


def square(material: Phong, height: float = 0.0, texcoords: Any = UNIT, **more: Any) -> Any:
    """The unit square in the plane z = height, u along x and v along y, with a material of its own."""
    corners = np.column_stack([UNIT, np.full(4, height)])
    mesh = Mesh(corners, [[0, 1, 2], [0, 2, 3]], texcoords=texcoords, **more)
    return SceneObject(mesh=mesh, material=str(height), normals="flat"), {str(height): material}


def seen(*squares: Any, **tables: Any) -> Scene:
    """Squares seen from above, y upwards in the picture."""
    camera = OrthographicCamera(eye=(0.5, 0.5, 5), target=(0.5, 0.5, 0), up=(0, 1, 0), height=1)
    objects, materials = [one for one, _ in squares], {}
    for _, named in squares:
        materials |= named
    return Scene(camera=camera, objects=objects, materials=materials, **tables)


def drawn(scene: Scene, size: int = 2) -> Any:
    return whitted(scene, size, size, max_depth=3)


def glowing(texture: Any) -> Phong:
    return Phong(diffuse=0.0, emission_map=texture)


def nearest(image: Any, **more: Any) -> Texture:
    return Texture(image, filter="nearest", **more)


def test_the_first_row_of_an_image_is_on_top() -> None:
    np.testing.assert_array_equal(drawn(seen(square(glowing(nearest(ROWS))))), ROWS)


def test_integers_are_srgb_and_grey_is_all_colours() -> None:
    for image, expected in ((np.uint8([[[188]]]), 0.502886), (np.uint16([[[32768]]]), 0.2140486)):
        np.testing.assert_allclose(drawn(seen(square(glowing(nearest(image))))), expected, rtol=FLOAT32)


@cases("image", {"grey": [[[0.25]]], "grey, alpha": [[[0.9, 0.25]]], "alpha": [[[0.1, 0.2, 0.3, 0.25]]]})
def test_the_opacity_of_an_image_is_its_last_channel(image: str) -> None:
    kinds = {"grey": [[[0.25]]], "grey, alpha": [[[0.9, 0.25]]], "alpha": [[[0.1, 0.2, 0.3, 0.25]]]}
    over = Phong(diffuse=0.0, emission=(0, 1, 0), opacity=0.5, opacity_map=nearest(np.float32(kinds[image])))
    both = drawn(seen(square(over, 1.0), square(Phong(diffuse=0.0, emission=(1, 0, 0)))))
    np.testing.assert_allclose(both, np.broadcast_to([0.875, 0.125, 0.0], both.shape), rtol=FLOAT32)


def test_colors_without_alpha_are_all_there() -> None:
    over = Phong(diffuse=0.0, emission=(0, 1, 0), cutoff=0.9, opacity_map=nearest(ROWS))
    assert (drawn(seen(square(over))) == [0, 1, 0]).all()


def test_rays_and_light_pass_through_holes() -> None:
    """The left half of two masks is there: it is seen, and behind it lies their shadow."""
    half = nearest(np.float32([[[1, 1, 1, 1], [1, 1, 1, 0]]]))
    mask = Phong(diffuse=0.0, emission=(0, 1, 0), cutoff=0.5, opacity_map=half)
    sun = DirectionalLight(direction=(0, 0, -1))
    scene = seen(square(mask, 2.0), square(mask, 1.0), square(Phong(diffuse=0.5)), lights=[sun], background=0.3)
    np.testing.assert_allclose(drawn(scene), [[[0, 1, 0], [0.5] * 3]] * 2, rtol=FLOAT32)
    hits = aovs(scene, 2, 2)
    np.testing.assert_allclose(hits.depth, [[3, 5]] * 2, rtol=1e-4)
    assert hits.instance.tolist() == [[0, 2]] * 2
    low = OrthographicCamera(eye=(0.5, 0.5, 0.5), target=(0.5, 0.5, 0), up=(0, 1, 0), height=1)
    below = scene.altered(camera=low)
    np.testing.assert_allclose(drawn(below), [[[0] * 3, [0.5] * 3]] * 2, rtol=FLOAT32)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("strength", [1.0, 0.5])
def test_normals_lean_along_u_and_v(mirrored: bool, strength: float) -> None:
    n = np.array([0.36, -0.48, 0.8])
    texture = nearest(np.float32([[(n + 1.0) / 2.0]]), strength=strength)
    texcoords = np.array(UNIT, float) * [-1.0 if mirrored else 1.0, 1.0]
    leaning = n * [-strength if mirrored else strength, strength, 1.0]
    to_light = np.array([0.6, -0.4, 0.7])
    scene = seen(
        square(Phong(diffuse=1.0, normal_map=texture), texcoords=texcoords),
        lights=[DirectionalLight(direction=-to_light)],
    )
    expected = float(leaning @ to_light / np.linalg.norm(leaning) / np.linalg.norm(to_light))
    np.testing.assert_allclose(drawn(scene), expected, rtol=FLOAT32)


def test_normals_are_those_of_the_plugin_normalmap() -> None:
    """It has no strength, and on texture coordinates that are not mirrored it is ours."""
    image = np.random.default_rng(1).uniform([0.3, 0.3, 0.9], [0.7, 0.7, 1.0], (3, 4, 3)).astype(np.float32)
    texture = Texture(image, filter="linear")
    scene = seen(
        square(Phong(diffuse=1.0, normal_map=texture), texcoords=[[0.1, 0.2], [1.3, 0.5], [1.1, 1.4], [-0.2, 1.2]]),
        lights=[DirectionalLight(direction=(-0.3, 0.2, -0.7))],
    )
    tracer, _ = recursion_of(scene, 0)
    (maps,) = tracer.maps.values()
    white = {"type": "diffuse", "reflectance": 1.0}
    plain = {"use_shadowing_function": False, "flip_invalid_normals": False}
    plugin = mi.load_dict({"type": "normalmap", "normalmap": maps.normals, "bsdf": white} | plain)
    expected = []
    for ray in mitsuba_rays(primary_rays(scene.camera, 8, 8)):
        si = tracer.scene.ray_intersect(ray)
        towards = mi.Vector3f(*np.array([0.3, -0.2, 0.7]) / np.sqrt(0.62))
        expected.append(np.pi * np.array(plugin.eval(mi.BSDFContext(), si, si.to_local(towards))))
    np.testing.assert_allclose(drawn(scene, 8).reshape(-1, 3), expected, rtol=FLOAT32)
    assert np.ptp(expected) > 0.05


def test_colors_of_vertices_are_linear_before_they_are_interpolated() -> None:
    colors = np.array([[0, 0, 0], [1, 1, 1], [1, 1, 1], [0, 0, 0]])
    for space in ("linear", "srgb"):
        image = drawn(seen(square(Phong(diffuse=0.0, emission=0.5, vertex_colors=space), colors=colors)))
        np.testing.assert_allclose(image, [[[0.125] * 3, [0.375] * 3]] * 2, rtol=FLOAT32)
    grey = Phong(diffuse=0.0, emission=1.0, vertex_colors="srgb")
    image = drawn(seen(square(grey, colors=np.full((4, 3), 0.5))))
    np.testing.assert_allclose(image, 0.2140411, rtol=FLOAT32)


def test_the_reference_names_what_it_cannot_judge() -> None:
    flat = np.zeros((4, 2))
    for material, texcoords, reason in (
        (Phong(diffuse_map=Texture(ROWS)), UNIT, "materials.0.0.diffuse_map: Mitsuba's bitmap has no mip maps"),
        (Phong(diffuse_map=nearest(ROWS, wrap=("repeat", "clamp"))), UNIT, "wraps alike along u and v"),
        (Phong(normal_map=nearest(ROWS)), flat, "where texture coordinates do not grow"),
        (Phong(diffuse_map=nearest(ROWS)), flat, None),
    ):
        scene = seen(square(material, texcoords=texcoords))
        fault = can_judge(scene)
        assert fault is None if reason is None else reason in (fault or "")
        assert "recursion alone" in (path_can_judge(scene) or "")


def test_textures_without_mip_maps() -> None:
    scene = seen(square(Phong(diffuse_map=Texture(ROWS), specular_map=nearest(ROWS))))
    changed = without_mip_maps(scene)
    assert can_judge(changed) is None
    material = changed.materials["0.0"]
    assert isinstance(material, Phong) and material.diffuse_map is not None and material.specular_map is not None
    assert (material.diffuse_map.filter, material.specular_map.filter) == ("linear", "nearest")
    assert without_mip_maps(changed) is changed
    np.testing.assert_array_equal(drawn(scene, 5), drawn(changed, 5))


def test_a_texture_that_mitsuba_does_not_have_is_an_error() -> None:
    with pytest.raises(ValueError, match="texture: Mitsuba's bitmap wraps alike along u and v, not repeat and mirror"):
        drawn(seen(square(glowing(nearest(ROWS, wrap=("repeat", "mirror"))))))
