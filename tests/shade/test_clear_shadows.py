"""Shadows of glass that lets light through: a product of transmittances along a straight line."""

from typing import Any

import numpy as np
import pytest

from renderer import (
    Dielectric,
    DirectionalLight,
    OrthographicCamera,
    Phong,
    PointLight,
    Scene,
    SceneObject,
    prepare,
    render,
    shapes,
)
from renderer.diagnostics.ray_path import ray_path

TINT = np.array([0.5, 1.0, 0.25])
SLANTED = DirectionalLight(direction=(-0.3, -1.0, 0.2))
LAMP = PointLight(position=(0.4, 6.0, -0.2), intensity=36.0)
MATERIALS = {
    "white": Phong(diffuse=1.0),
    "glass": Dielectric(ior=1.7, transmittance=TINT),
    "wax": Phong(diffuse=0.5, transmittance=TINT),
}


def scene_of(light: Any, *layers: tuple[str, float], **render_settings: Any) -> Scene:
    """The floor seen from below the layers, each a slab of a material with its lower side at a height."""
    floor = SceneObject(mesh=shapes.grid(), material="white", scale=4)
    slabs = [SceneObject(mesh=shapes.box((-3, y, -3), (3, y + 0.25, 3)), material=name) for name, y in layers]
    camera = OrthographicCamera(eye=(0, 0.5, 0), target=(0, 0, 0), up=(0, 0, 1), height=0.5)
    settings = {"resolution": (3, 3), "max_depth": 0, **render_settings}
    return Scene(camera=camera, materials=MATERIALS, objects=[floor, *slabs], lights=[light], render=settings)


@pytest.mark.judges("scene.render.glass_shadows")
@pytest.mark.parametrize("light", [SLANTED, LAMP])
@pytest.mark.parametrize(
    "layers", [[("glass", 1.0)], [("wax", 1.0)], [("glass", 1.0), ("glass", 2.0)], [("wax", 2.5), ("glass", 1.0)]]
)
def test_each_face_takes_its_share(light: Any, layers: list[tuple[str, float]]) -> None:
    scene = scene_of(light, *layers)
    bare = render(scene_of(light)).radiance
    assert not render(scene).radiance.any()
    clear = render(scene, glass_shadows="clear")
    np.testing.assert_allclose(clear.radiance, bare * TINT ** (2 * len(layers)), rtol=1e-6)
    # The camera ray, and a shadow ray to each face and to the light.
    assert (clear.rays == 2 + 2 * len(layers)).all()


@pytest.mark.parametrize("light", [SLANTED, LAMP])
@pytest.mark.parametrize("height", [0.75, 3.0])
def test_what_is_opaque_hides_the_light_before_and_behind_glass(light: Any, height: float) -> None:
    scene = scene_of(light, ("glass", 1.5), ("white", height))
    assert not render(scene, glass_shadows="clear").radiance.any()


def test_a_surface_beyond_the_lamp_takes_nothing() -> None:
    scene, bare = scene_of(LAMP, ("glass", 7.0)), scene_of(LAMP)
    assert np.array_equal(render(scene, glass_shadows="clear").radiance, render(bare).radiance)


def test_the_rays_of_a_pixel_are_those_of_its_colour() -> None:
    scene = scene_of(SLANTED, ("glass", 1.0), ("wax", 2.0), glass_shadows="clear", resolution=(1, 1))
    image = render(scene)
    path = ray_path(prepare(scene), (0.0, 0.5, 0.0), (0.0, -1.0, 0.0), 0)
    assert len(path) == image.rays[0, 0] == 6 and [segment.hit for segment in path] == [True] * 5 + [False]
    np.testing.assert_allclose(np.sum([segment.radiance for segment in path], axis=0), image.radiance[0, 0], rtol=1e-6)
