"""Mitsuba's path integrator with all its light: closed forms, its standard error, and what it refuses."""

from types import ModuleType
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import (
    DirectionalLight,
    Mesh,
    Mirror,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneObject,
    Sky,
    render,
    shapes,
)

GROUND = Mesh([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], [[0, 1, 2], [0, 2, 3]])
ABOVE = PerspectiveCamera(eye=(0, 3, 0), target=(0, 0, 0), up=(0, 0, -1), fov=20)


def scene_of(mesh: Mesh, look: Any, **more: Any) -> Scene:
    things = [SceneObject(mesh=mesh, material="clay")]
    return Scene(**{"camera": ABOVE, "materials": {"clay": look}, "objects": things, **more})


def test_a_furnace_is_equally_bright_everywhere(mitsuba: ModuleType) -> None:
    from validation.references.mitsuba.global_light import global_light

    ball = shapes.icosphere(1)
    inside = Mesh(ball.vertices, ball.faces[:, ::-1])
    eye = PerspectiveCamera(eye=(0.1, 0.2, 0.3), target=(0, 0, -1), fov=90)
    found = global_light(scene_of(inside, Phong(diffuse=0.5, emission=0.5), camera=eye), 8, 6, 256)
    assert found.mean.shape == found.error.shape == (6, 8, 3)
    assert 0 < found.error.max() < 0.05
    assert abs(found.mean.mean() - 1) < 4 * np.sqrt((found.error**2).mean() / 48)


def test_the_film_and_the_units_are_those_of_render(mitsuba: ModuleType) -> None:
    from validation.references.mitsuba.global_light import global_light

    block = Mesh.concatenate(GROUND, shapes.box((-0.1, 0.1, -0.3), (0.4, 0.11, 0.1)))
    light = DirectionalLight(direction=(0.3, -1, 0.2), irradiance=(1, 2, 3))
    scene = scene_of(block, Phong(diffuse=0.01), lights=[light])  # so dark that nothing lights anything else
    found, ours = global_light(scene, 24, 16, 64).mean, render(scene, resolution=(24, 16), samples=64).radiance
    # Pixels at edges differ by the samples that they take.
    assert np.median(np.abs(found / ours - 1)) < 0.01 and np.abs(found - ours).mean() < 0.01 * ours.mean()


@cases(
    ("look", "more"),
    [
        (Mirror(), {}),
        (Phong(specular=0.1), {}),
        (Phong(), {"sky": Sky()}),
        (Phong(), {"camera": OrthographicCamera(eye=(0, 1, 0), target=(0, 0, 0), up=(0, 0, 1), height=1)}),
    ],
)
def test_what_it_cannot_judge_is_refused(mitsuba: ModuleType, look: Any, more: dict[str, Any]) -> None:
    from validation.references.mitsuba.global_light import global_light

    with pytest.raises(ValueError, match="expected a"):
        global_light(scene_of(GROUND, look, **more), 4, 4, 8)
