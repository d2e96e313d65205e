"""The rules for the media on both sides of glass: a stack of bodies, or the side of the normal."""

from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import Dielectric, OrthographicCamera, Phong, Scene, SceneObject, load_scene, render
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from validation.pictures.unseen import STORED, passed
from validation.scenes import SCENES

GLASS, WATER = Dielectric(ior=1.5, reflectance=0.0), Dielectric(ior=1.33, reflectance=0.0)


def straight_down(*parts: tuple[Mesh, Any]) -> Scene:
    """A camera above some bodies, under which is nothing but a sky of 1."""
    objects = [SceneObject(mesh=mesh, material=f"m{k}") for k, (mesh, _) in enumerate(parts)]
    camera = OrthographicCamera(eye=(0.1, 9.0, 0.2), target=(0.1, 0.0, 0.2), up=(1.0, 0.0, 0.0), height=0.01)
    materials = {f"m{k}": material for k, (_, material) in enumerate(parts)}
    return Scene(camera=camera, materials=materials, objects=objects, background=1.0)


def slab(low: float, high: float) -> Mesh:
    return box((-5.0, low, -5.0), (5.0, high, 5.0))


@pytest.mark.judges("render")
def test_two_slabs_that_touch() -> None:
    """By the stack no air is between them. By Mitsuba's rules a ray meets one of the faces that coincide, the lower."""
    scene = straight_down((slab(0.0, 1.0), WATER), (slab(1.0, 2.0), GLASS))
    stack = render(scene, resolution=(3, 3), max_depth=6).radiance
    normal = render(scene, resolution=(3, 3), max_depth=6, media="normal", offset="mitsuba").radiance
    np.testing.assert_allclose(stack, passed(0.0, 1.0, 1.5, 1.33, 1.0), rtol=STORED)
    np.testing.assert_allclose(normal, passed(0.0, 1.0, 1.5) * passed(0.0, 1.0, 1.33, 1.0), rtol=STORED)


@pytest.mark.judges("render")
def test_glass_without_a_back_wall() -> None:
    """The ray that enters open glass is in it to the end by the stack, and in air beyond its next front."""
    open_box = Mesh(slab(2.0, 3.0).vertices, slab(2.0, 3.0).faces[_upper(slab(2.0, 3.0))])
    scene = straight_down((open_box, GLASS), (slab(0.0, 1.0), WATER))
    stack, normal = (render(scene, resolution=(3, 3), max_depth=6, media=m).radiance for m in ("stack", "normal"))
    np.testing.assert_allclose(stack, passed(0.0, 1.0, 1.5, 1.33, 1.5), rtol=STORED)
    np.testing.assert_allclose(normal, passed(0.0, 1.0, 1.5) * passed(0.0, 1.0, 1.33, 1.0), rtol=STORED)


def _open_at_the_top(low: float, high: float) -> Mesh:
    mesh = slab(low, high)
    return Mesh(mesh.vertices, mesh.faces[~_upper(mesh)])


@cases(
    ("others", "below"),
    [
        ([], []),
        ([(_open_at_the_top, 1.0, 3.0, GLASS)], []),
        ([(slab, 0.0, 1.0, WATER)], [1.33]),
        ([(_open_at_the_top, 1.0, 3.0, GLASS), (slab, 0.0, 1.0, WATER)], [1.33]),
        ([(slab, 0.0, 12.0, WATER), (_open_at_the_top, 1.0, 3.0, GLASS)], [1.33]),
    ],
)
def test_a_body_that_was_never_entered_is_left_from_its_own_medium(others: Any, below: list[float]) -> None:
    """Glass without a top, whose bottom is met alone or with faces of other bodies in the same place."""
    parts = [(_open_at_the_top(1.0, 2.0), GLASS), *((shape(*ends), material) for shape, *ends, material in others)]
    for some in (parts, parts[::-1]):
        found = render(straight_down(*some), resolution=(3, 3), max_depth=6).radiance
        np.testing.assert_allclose(found, passed(0.0, 1.5, *below, 1.0), rtol=STORED)


def _upper(mesh: Mesh) -> Any:
    """The faces of a box at its highest coordinate."""
    heights = mesh.vertices[mesh.faces][:, :, 1]
    return (heights == heights.max()).all(axis=1)


def test_an_eye_in_glass_in_water() -> None:
    """Glass within water is left into water by the stack, and into air by the normal."""
    scene = straight_down((slab(0.0, 12.0), WATER), (slab(1.0, 11.0), GLASS))
    stack, normal = (render(scene, resolution=(3, 3), max_depth=6, media=m).radiance for m in ("stack", "normal"))
    np.testing.assert_allclose(stack, passed(0.0, 1.5, 1.33, 1.0), rtol=STORED)
    np.testing.assert_allclose(normal, passed(0.0, 1.5, 1.0) * passed(0.0, 1.33, 1.0), rtol=STORED)


@pytest.mark.judges("render")
@pytest.mark.parametrize("name", ["glass", "checkered"])
def test_closed_bodies_apart_have_the_same_bits_by_both_rules(name: str) -> None:
    scene = load_scene(SCENES / f"{name}.toml")
    stack, normal = (render(scene, resolution=(48, 36), media=m).radiance for m in ("stack", "normal"))
    np.testing.assert_array_equal(stack, normal)
    assert len(np.unique(stack)) > 100


@pytest.mark.parametrize("media", ["Normal", None, 1])
def test_other_rules_are_refused(media: Any) -> None:
    with pytest.raises(ValueError, match="media: expected 'stack' or 'normal', got"):
        render(straight_down((slab(0.0, 1.0), Phong())), resolution=(1, 1), media=media)
