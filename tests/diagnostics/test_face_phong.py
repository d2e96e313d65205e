"""One colour a face: against a NumPy twin, against the renderer's pixels, and code by code against ``image.srgb``."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray

from renderer.diagnostics.face_phong import face_colors
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, torus
from renderer.picture.image import srgb
from renderer.picture.pack import pack
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.needs import needs_of
from renderer.scene.scene import Scene, SceneObject

EYE = (1.5, 2.0, 4.0)
CAMERA = PerspectiveCamera(eye=EYE, target=(0, 0, 0))
LIGHTS = (
    DirectionalLight(direction=(-1, -2, -1), irradiance=(0.8, 0.6, 0.5)),
    PointLight(position=(-2, 3, 2), intensity=(2, 3, 4)),
    DirectionalLight(direction=(1, 0.5, 1), irradiance=0.3),
)
MATTE = Phong(diffuse=(0.7, 0.4, 0.2))
SHINY = Phong(diffuse=(0.2, 0.3, 0.6), ambient=0.5, specular=(0.9, 0.7, 0.5), shininess=20.0, reflectance=0.5)


def scene(*parts: tuple[Mesh, Material], camera: PerspectiveCamera = CAMERA, **more: Any) -> Scene:
    """A scene of (mesh, material) pairs."""
    return Scene(
        camera=camera,
        materials={f"m{i}": material for i, (_, material) in enumerate(parts)},
        objects=tuple(SceneObject(mesh=mesh, material=f"m{i}") for i, (mesh, _) in enumerate(parts)),
        **{"lights": LIGHTS, "ambient": (0.1, 0.2, 0.3), **more},
    )


def colors_of(what: Scene, eye: Any = EYE, threads: int = 1) -> NDArray[np.uint8]:
    return face_colors(pack(what)[1], eye, threads)


def twin(what: Scene, eye: Any) -> NDArray[np.float64]:
    """The radiance of each face, (F, 3): the formula straight from the scene's own records, all faces at once."""
    rows = []
    for instance in what.instances:
        material, corners = what.materials[instance.material], instance.mesh.triangles
        assert isinstance(material, Phong)
        at = corners.mean(axis=1)
        n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        v = eye - at
        v /= np.linalg.norm(v, axis=1, keepdims=True)
        n[(n * v).sum(axis=1) < 0] *= -1
        ambient = material.diffuse if material.ambient is None else material.ambient
        total = np.tile(np.multiply(ambient, what.ambient), (len(at), 1))
        for light in what.lights:
            if isinstance(light, DirectionalLight):
                way, arriving = -np.tile(light.direction, (len(at), 1)), np.tile(light.irradiance, (len(at), 1))
            else:
                way = np.asarray(light.position) - at
                arriving = np.asarray(light.intensity) / (way**2).sum(axis=1, keepdims=True)
            way = way / np.linalg.norm(way, axis=1, keepdims=True)
            cos = (n * way).sum(axis=1, keepdims=True)
            mirrored = 2.0 * n * cos - way
            shine = np.maximum((mirrored * v).sum(axis=1, keepdims=True), 0.0) ** material.shininess
            factor = np.multiply(material.diffuse, cos) + np.multiply(material.specular, shine)
            total += np.where(cos > 0.0, factor * arriving, 0.0)
        rows.append(total)
    return np.concatenate(rows)


@pytest.mark.parametrize("eye", [EYE, (0.05, 0.1, -0.02), (-300.0, 20.0, 7.0)])
def test_the_formula(eye: Any) -> None:
    """From outside, from within, where all faces show their backs, and from afar."""
    shell = (icosphere(3), Phong(diffuse=0.5, specular=0.3, shininess=1.0))
    what = scene((torus(), SHINY), shell, (box(), MATTE))
    got, expected = colors_of(what, eye).astype(int), srgb(twin(what, eye)).astype(int)
    assert got.shape == (sum(len(i.mesh.faces) for i in what.instances), 3)
    assert len(np.unique(got, axis=0)) > 1800
    # The twin's rounding differs: a code may be the next one where the radiance is within some 1e-15 of a step.
    assert np.abs(got - expected).max() <= 1
    assert (got != expected).mean() < 1e-3


def test_every_code_begins_where_srgb_says() -> None:
    """A face for each number about each step, that number its ambient light: codes equal ``srgb``, bit by bit."""
    codes = np.arange(1, 256)
    linear = (codes - 0.5) / 255.0
    about = np.where(linear <= 0.04045, linear / 12.92, ((linear + 0.055) / 1.055) ** 2.4)
    spread = about[:, None] * (1.0 + np.arange(-8, 9) * 2.0**-52)
    numbers = np.concatenate([spread.ravel(), [0.0, 1e-300, 1.0 - 2.0**-53, 1.0, 1.5, 1e30], np.linspace(0, 1, 499)])
    # So close to a step that some are on either side of it.
    assert (np.diff(srgb(spread).astype(int), axis=1) == 1).any(axis=1).mean() > 0.9
    numbers = numbers[: len(numbers) // 3 * 3].reshape(-1, 3)
    what = scene((box(), Phong(diffuse=0.0, ambient=1.0)), ambient=1.0, lights=())
    _, world = pack(what)
    rows = np.repeat(world.materials, len(numbers), axis=0)
    rows[:, 1:4] = numbers
    world = world._replace(
        materials=rows,
        material=(np.arange(len(numbers)) * rows.shape[1]).astype(np.int32),
        faces=np.repeat(world.faces[:1], len(numbers), axis=0),
    )
    np.testing.assert_array_equal(face_colors(world, EYE, 1), srgb(numbers))


class TestStandIns:
    """What has no colour of its own shows as matte, half as bright as what it reflects or lets through."""

    @cases(
        ("material", "grey"),
        [
            (Mirror(type="mirror"), (0.5, 0.5, 0.5)),
            (Mirror(type="mirror", reflectance=(0.8, 0.4, 0.0)), (0.4, 0.2, 0.0)),
            (Dielectric(type="dielectric"), (0.5, 0.5, 0.5)),
            (Dielectric(type="dielectric", reflectance=0.25, transmittance=(1, 0.5, 0.1)), (0.5, 0.25, 0.125)),
            (Phong(diffuse=0.0, reflectance=(0.6, 0.8, 1.0)), (0.3, 0.4, 0.5)),
        ],
    )
    def test_as_matte(self, material: Material, grey: tuple[float, float, float]) -> None:
        floor = (box((-3, -2, -3), (3, -1, 3)), MATTE)
        got = colors_of(scene((icosphere(2), material), floor))
        np.testing.assert_array_equal(got, colors_of(scene((icosphere(2), Phong(diffuse=grey)), floor)))
        assert got[:320].max() > 160


def test_the_same_bits_for_any_number_of_threads() -> None:
    what = scene((icosphere(5), SHINY))  # three chunks
    np.testing.assert_array_equal(colors_of(what, threads=1), colors_of(what, threads=3))


def test_more_ready_than_needed_changes_nothing() -> None:
    what = scene((torus(), MATTE), (icosphere(1), Phong(diffuse=0.0, ambient=0.7)))
    more = replace(needs_of(what), specular=True, smooth_normals=True, reflection=True, refraction=True)
    np.testing.assert_array_equal(face_colors(pack(what, more)[1], EYE, 1), colors_of(what))


def test_faces_that_have_no_normal_show_ambient_light() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], np.float64)
    flat = Mesh(corners, np.array([[0, 1, 2], [0, 0, 1], [0, 1, 3]], np.int32))
    what = scene((flat, MATTE))
    colors = colors_of(what)
    ambient = srgb(np.multiply(MATTE.diffuse, what.ambient))
    np.testing.assert_array_equal(colors[:2], [ambient, ambient])
    assert (colors[2] > ambient).any()


def test_an_eye_and_a_light_on_a_face() -> None:
    """From there neither has a direction: that face shows its ambient light, and the others do not notice."""
    at = box().triangles[0].mean(axis=0)

    def lit_from(place: Any) -> Scene:
        down = DirectionalLight(direction=(0, -1, 0), irradiance=0.5)
        return scene((box(), SHINY), lights=(PointLight(position=tuple(place.tolist()), intensity=0.2), down))

    colors, nearby = colors_of(lit_from(at), at), at + 1e-9
    np.testing.assert_array_equal(colors[0], srgb(np.multiply(0.5, lit_from(at).ambient)))
    # The first two faces share a side, whose plane holds the light.
    expected = srgb(twin(lit_from(nearby), nearby)[2:]).astype(int)
    np.testing.assert_allclose(colors[2:].astype(int), expected, rtol=0, atol=1)
    assert colors[2:].max() > colors[0].max()


def test_no_faces() -> None:
    assert colors_of(scene()).shape == (0, 3)


@cases("eye", [(0, 0), (0, 0, np.nan), (0, np.inf, 0), 1.0, np.zeros((1, 3))])
def test_a_bad_eye_is_named(eye: Any) -> None:
    with pytest.raises(ValueError, match="eye: expected three finite numbers"):
        colors_of(scene((box(), MATTE)), eye)
