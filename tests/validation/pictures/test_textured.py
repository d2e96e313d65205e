"""The textured scenes of the section of pictures: each fails where its texture is read in another way."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from cases import cases

from renderer.materials.phong import Phong
from renderer.mesh.texture import Texture
from validation.job import Job
from validation.pictures import textured
from validation.pictures.check import Pair, check
from validation.pictures.one_ray import picture
from validation.references.mitsuba.scene import in_float32
from validation.references.mitsuba.whitted import whitted
from validation.thresholds import Thresholds

SIZE = (66, 44)
ROWS = {row.name.removeprefix("textures: "): row for row in textured.rows()}


@cache
def theirs(name: str) -> Any:
    scene = in_float32(ROWS[name].scene)
    return whitted(scene, *SIZE, max_depth=scene.render.max_depth)


def job(folder: Path) -> Job:
    return Job(True, Thresholds(), folder, lambda _: None)


def _texture(**changes: Any) -> Callable[[Phong], Phong]:
    """A change of all textures of a material."""

    def changed(material: Phong) -> Phong:
        maps = {name: getattr(material, name) for name in Phong.model_fields}
        return material.model_copy(
            update={name: replace(one, **changes) for name, one in maps.items() if isinstance(one, Texture)}
        )

    return changed


def _fields(**changes: Any) -> Callable[[Phong], Phong]:
    return lambda material: material.model_copy(update=changes)


def _as_floats(material: Phong) -> Phong:
    assert material.diffuse_map is not None
    pixels = material.diffuse_map.image.pixels / np.float32(255.0)
    return _texture(image=Texture(pixels).image)(material)


def _upside_down(material: Phong) -> Phong:
    assert material.reflectance_map is not None
    return _texture(image=Texture(material.reflectance_map.image.pixels[::-1]).image)(material)


WRONG: dict[str, Callable[[Phong], Phong]] = {
    "sRGB images": _as_floats,
    "linear images": _upside_down,
    "mirrored images": _texture(wrap=("repeat", "repeat")),
    "clamped images": _texture(filter="linear"),
    "checkers": _fields(diffuse_map=Texture.checker((0.1, 0.2, 0.4), (0.9, 0.5, 0.1), squares=(7.3, 4.6))),
    "colours of vertices": _fields(vertex_colors="linear"),
    "normal maps": _texture(strength=0.9),
    "masks": _fields(opacity=0.9),
    "blends": _fields(opacity=0.8),
    "emission": _fields(emission=(0.9, 0.9, 0.9)),
}


@cases("name", WRONG)
def test_a_texture_that_is_read_in_another_way_is_seen(tmp_path: Path, name: str) -> None:
    scene = ROWS[name].scene
    changed = {
        key: WRONG[name](one) if isinstance(one, Phong) and (name != "masks" or one.opacity_map) else one
        for key, one in scene.materials.items()
    }
    ours = picture(scene.altered(materials=changed), SIZE, "mitsuba")
    pair = Pair(ours, "matched", theirs(name), np.zeros(SIZE[::-1], np.bool_))
    _, gates = check("wrong", pair, job(tmp_path), shown=False)
    assert {"pixel_share", "mean_error", "flip"} <= {gate.quantity for gate in gates if not gate.passed}


def test_there_is_a_wrong_texture_for_each_scene() -> None:
    assert WRONG.keys() == ROWS.keys()
