"""The sky: what rays see of it, by its formula, and its light, by integrals over the hemisphere."""

from typing import Any

import numpy as np
import pytest

from renderer import (
    Mirror,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneError,
    SceneObject,
    Sky,
    needs_of,
    prepare,
    render,
    shapes,
)
from renderer.arguments.up import UP_AXES

ZENITH, HORIZON, GROUND = (0.2, 0.5, 1.0), (0.9, 0.8, 0.7), (0.1, 0.2, 0.05)
EMPTY = PerspectiveCamera(eye=(1.0, 2.0, 3.0), target=(1.5, 2.2, 2.8), fov=150.0)


def level(up: str) -> Scene:
    """A white square across the axis ``up``, seen from above by one pixel."""
    axis = UP_AXES[up]
    eye, across = np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
    turned = {"x": (0, 0, -90), "y": (0, 0, 0), "z": (90, 0, 0)}[up]
    floor = SceneObject(mesh=shapes.grid(), material="white", rotate=turned)
    camera = OrthographicCamera(eye=eye, target=(0, 0, 0), up=across, height=0.1)
    return Scene(camera=camera, materials={"white": Phong(diffuse=1.0)}, objects=[floor], up=up)


@pytest.mark.judges("scene.sky", "scene.sky.zenith", "scene.sky.horizon", "scene.sky.ground")
@pytest.mark.parametrize("up", ["x", "y", "z"])
@pytest.mark.parametrize("ground", [GROUND, None])
def test_a_ray_that_misses_sees_the_sky_of_its_direction(up: Any, ground: Any) -> None:
    sky = Sky(zenith=ZENITH, horizon=HORIZON, ground=ground)
    scene = Scene(camera=EMPTY, materials={}, sky=sky, up=up)
    seen = render(scene, resolution=(9, 7)).radiance
    sine = scene.camera.primary_rays((9, 7))[1][..., UP_AXES[up], None]
    below = HORIZON if ground is None else ground
    wanted = np.where(sine > 0.0, np.array(HORIZON) + sine * (np.array(ZENITH) - HORIZON), below)
    assert (sine > 0.0).any() and (sine < 0.0).any()
    np.testing.assert_allclose(seen, wanted, rtol=1e-6)


def test_a_mirror_shows_the_sky() -> None:
    camera = OrthographicCamera(eye=(0, 1, 1), target=(0, 0, 0), height=0.1)
    mirror = SceneObject(mesh=shapes.grid(), material="mirror")
    sky = Sky(zenith=ZENITH, horizon=HORIZON, lights=0)
    scene = Scene(camera=camera, materials={"mirror": Mirror(reflectance=0.5)}, objects=[mirror], sky=sky)
    wanted = 0.5 * (np.array(HORIZON) + np.sqrt(0.5) * (np.array(ZENITH) - HORIZON))
    np.testing.assert_allclose(render(scene, resolution=1).radiance[0, 0], wanted, rtol=1e-6)
    assert not needs_of(scene).shadows


@pytest.mark.judges("scene.sky.lights", "Sky.directional")
@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_level_ground_has_the_integral_of_the_sky(up: Any) -> None:
    """Of (h + (z - h) s) s over the hemisphere, over pi: h / 3 + 2 z / 3. The midpoint rule errs by 1 / 6 n^2."""
    count = 50
    lit = render(level(up).altered(sky=Sky(zenith=ZENITH, horizon=HORIZON, lights=count)), resolution=1)
    wanted = np.array(HORIZON) / 3.0 + np.array(ZENITH) * 2.0 / 3.0
    wanted += (np.array(HORIZON) - ZENITH) / (6.0 * count**2)
    np.testing.assert_allclose(lit.radiance[0, 0], wanted, rtol=1e-6)


@pytest.mark.judges("scene.sky.sun", "scene.sky.sun_irradiance", "scene.sky.sun_angle", "scene.sky.sun_lights")
def test_level_ground_has_the_integral_of_the_suns_disc() -> None:
    """The mean of its cosines is half of 1 + cos a, for the sun straight above; every light is within the angle."""
    sky = Sky(lights=0, sun=(0, -2, 0), sun_irradiance=(0.3, 0.6, 0.9), sun_angle=30.0, sun_lights=40)
    lit = render(level("y").altered(sky=sky), resolution=1).radiance[0, 0]
    np.testing.assert_allclose(lit, np.array((0.3, 0.6, 0.9)) * (1.0 + np.cos(np.radians(30.0))) / 2.0, rtol=1e-6)
    ways = np.array([light.direction for light in sky.directional("y")])
    assert len(ways) == 40 and (-ways[:, 1] >= np.cos(np.radians(30.0))).all()
    assert np.linalg.norm(ways.mean(axis=0)[[0, 2]]) < 0.01


def test_half_of_the_sky_lights_the_foot_of_a_wall() -> None:
    """A uniform sky, and a wall so wide and high that it hides one half of it."""
    scene = level("y")
    wall = SceneObject(mesh=shapes.box((0.001, -1, -1000), (1, 1000, 1000)), material="white")
    scene = Scene(camera=scene.camera, materials=scene.materials, objects=[*scene.objects, wall])
    camera = OrthographicCamera(eye=(-0.001, 1, 0), target=(-0.001, 0, 0), up=(0, 0, 1), height=1e-4)
    lit = render(scene.altered(camera=camera, sky=Sky(zenith=1, horizon=1, lights=1000)), resolution=1)
    np.testing.assert_allclose(lit.radiance[0, 0], 0.5, atol=5e-3)


@pytest.mark.judges("Scene.all_lights")
def test_the_skys_lights_come_after_the_scenes_own() -> None:
    scene = level("y").altered(sky=Sky(lights=3, sun=(0, -1, 0), sun_lights=2))
    lit = scene.altered(lights=[{"type": "point", "position": (0, 1, 0)}])
    assert lit.all_lights[1:] == scene.all_lights == scene.sky.directional("y") and len(scene.all_lights) == 5  # type: ignore[union-attr]
    assert len(prepare(lit).arrays.lights) == 6
    assert scene.altered(sky=None).all_lights == ()


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"background": 0.5, "sky": {}}, "Scene: background: expected none beside a sky, got (0.5, 0.5, 0.5)"),
        ({"sky": {"lights": 5000}}, "Scene: sky.lights: expected a number less than or equal to 4096, got 5000"),
        ({"sky": {"sun": (0, 0, 0)}}, "Scene: sky.sun: expected a direction of non-zero length, got (0, 0, 0)"),
        (
            {"sky": {"colour": 1}},
            "Scene: sky.colour: unknown key (its value is 1): expected one of zenith, horizon, ground, lights, sun, "
            "sun_irradiance, sun_angle, sun_lights, got 'colour'",
        ),
    ],
)
def test_what_is_no_sky_is_said(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(SceneError) as caught:
        Scene(camera=EMPTY, materials={}, **changes)
    assert str(caught.value) == says
