"""The ladder: what each rung holds, that it differs from the one below, and what is left out and why."""

from itertools import pairwise

import numpy as np
import pytest

from renderer.materials.phong import Phong
from renderer.picture.render import render
from renderer.scene.light import DirectionalLight
from renderer.scene.scene import load_scene
from validation.pictures import ladder
from validation.scenes import SCENES

GLASS = load_scene(SCENES / "glass.toml")


def test_each_rung_adds_something_to_the_picture() -> None:
    found, left_out = ladder.rungs(GLASS)
    assert ([rung.name for rung in found], left_out) == (list(ladder.NAMES), {})
    assert found[-1].scene is GLASS
    pictures = [render(rung.scene, resolution=(32, 32)).radiance for rung in found]
    for below, above in pairwise(pictures):
        assert not np.array_equal(below, above)
    assert all(rung.scene.instances is GLASS.instances for rung in found)


@pytest.mark.parametrize("name", ["glass", "stairs"])
def test_the_lowest_rung_has_no_shadows(name: str) -> None:
    """Whatever the eye sees, flat or smooth, is lit by the lamp beside it."""
    rung = ladder.rungs(load_scene(SCENES / f"{name}.toml"))[0][0]
    image = render(rung.scene, resolution=(48, 48))
    hit = image.face >= 0
    assert hit.any() and (image.radiance[hit].min(axis=-1) > 0.0).all()
    assert all(isinstance(m, Phong) and not any(m.specular) for m in rung.scene.materials.values())
    assert not any(rung.scene.ambient)


def test_a_rung_that_adds_nothing_is_left_out_with_its_reason() -> None:
    found, left_out = ladder.rungs(load_scene(SCENES / "stairs.toml"))
    assert [rung.name for rung in found] == ["diffuse", "everything"]
    assert left_out["glass"] == "no surface of the scene is a dielectric or has a constant transmittance"
    assert left_out["mirrors"] == "no surface of the scene is a mirror or has a constant reflectance"
    assert left_out["highlights"] == "no surface of the scene has highlights"
    assert left_out["shadows"].startswith("equal to the whole scene")


def test_shadows_come_with_the_scenes_own_lights() -> None:
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0))
    names = {rung.name: rung.scene for rung in ladder.rungs(GLASS.altered(lights=(sun,)))[0]}
    assert names["highlights"].lights != (sun,) and names["shadows"].lights == (sun,)
