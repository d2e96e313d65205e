"""The ladder: what each rung holds, that it differs from the one below, and what is left out and why."""

from itertools import pairwise

import numpy as np
import pytest

from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.texture import Texture
from renderer.picture.render import render
from renderer.scene.light import DirectionalLight
from renderer.scene.scene import Scene, SceneObject, load_scene
from validation.pictures import ladder
from validation.scenes import SCENES

GLASS = load_scene(SCENES / "glass.toml")


def with_textures() -> Scene:
    """Every effect of light, and a checkered leaf that is partly there."""
    leaf = Mesh(
        [[-0.6, 0, 4], [0.5, 0, 4], [0.5, 0.6, 4], [-0.6, 0.6, 4]],
        [[0, 1, 2], [0, 2, 3]],
        texcoords=[[0, 0], [1, 0], [1, 1], [0, 1]],
    )
    material = Phong(diffuse_map=Texture.checker(), opacity=0.7, emission=0.1)
    objects = (*GLASS.objects, SceneObject(mesh=leaf, material="leaf", normals="flat"))
    made = GLASS.model_copy(update={"objects": objects, "materials": {**GLASS.materials, "leaf": material}})
    # Copied if a test before this one asked.
    made.__dict__.pop("instances", None)
    return made


def test_each_rung_adds_something_to_the_picture() -> None:
    scene = with_textures()
    found, left_out = ladder.rungs(scene)
    assert ([rung.name for rung in found], left_out) == (list(ladder.NAMES), {})
    assert found[-1].scene is scene
    pictures = [render(rung.scene, resolution=(32, 32)).radiance for rung in found]
    for below, above in pairwise(pictures):
        assert not np.array_equal(below, above)
    assert all(rung.scene.instances is scene.instances for rung in found)


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
    assert left_out["glass"] == "no surface of the scene is a dielectric, has a constant transmittance or blends"
    assert left_out["textures"] == "no surface of the scene has textures or colours of vertices"
    assert left_out["mirrors"] == "no surface of the scene is a mirror or has a constant reflectance"
    assert left_out["highlights"] == "no surface of the scene has highlights"
    assert left_out["shadows"].startswith("equal to the whole scene")


def test_shadows_come_with_the_scenes_own_lights() -> None:
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0))
    names = {rung.name: rung.scene for rung in ladder.rungs(GLASS.altered(lights=(sun,)))[0]}
    assert names["highlights"].lights != (sun,) and names["shadows"].lights == (sun,)


def test_what_is_partly_there_and_what_shines_come_last() -> None:
    leaves = {rung.name: rung.scene.materials["leaf"] for rung in ladder.rungs(with_textures())[0]}
    mapped = [name for name, leaf in leaves.items() if leaf.diffuse_map is not None]
    assert mapped == [name for name in ladder.NAMES if name != "diffuse"]
    assert [name for name, leaf in leaves.items() if leaf.opacity < 1.0] == ["glass", "everything"]
    assert [name for name, leaf in leaves.items() if any(leaf.emission)] == ["everything"]
