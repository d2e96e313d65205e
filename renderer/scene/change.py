"""Changes of a scene by lines of TOML: the option ``--change``."""

import tomllib
from typing import Any

from pydantic import Field, ValidationError

from renderer.arguments.fields import Color, Fields, first_fault
from renderer.errors import expect
from renderer.scene.hide import without
from renderer.scene.scene import (
    AnyCamera,
    AnyLight,
    AnyMaterial,
    Scene,
    SceneChanges,
    checked_settings,
    warn_of_slips,
)
from renderer.scene.sky import Sky


class _Changes(Fields):
    camera: AnyCamera | None = None
    lights: tuple[AnyLight, ...] | None = None
    materials: dict[str, AnyMaterial] = Field({})
    render: dict[str, Any] = Field({})
    ambient: Color | None = None
    background: Color | None = None
    sky: Sky | None = None
    hide: tuple[str, ...] = ()


def changed(scene: Scene, text: str) -> Scene:
    """``scene`` with the camera, the lights, the materials, the ambient light, the background or sky and the keys of
    ``render`` in the TOML ``text``, and without the objects in its list ``hide``, such as ``objects.0`` or ``floor``.

    Raises ``ValueError`` with one line that names the key.

    >>> scene = Scene(camera={"eye": (0, 0, 1), "target": (0, 0, 0)}, materials={})
    >>> changed(scene, "render.samples = 4").render.samples
    4
    """
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # not only TOML's: too many digits
        raise ValueError(f"expected TOML, got a syntax error: {error}") from None
    known = list(_Changes.model_fields)
    for key in table:
        expect(key in known, "change", f"keys among {known}", repr(key))
    try:
        changes = _Changes.model_validate(table)
    except ValidationError as error:
        raise ValueError(first_fault(error, Scene._union_member)) from None
    for name in changes.materials:
        expect(name in scene.materials, "materials", f"names among {sorted(scene.materials)}", repr(name))
    found = {"camera": changes.camera, "lights": changes.lights}
    given: dict[str, Any] = {key: value for key, value in found.items() if value is not None}
    given["materials"] = {**scene.materials, **changes.materials}
    given |= surroundings(changes.ambient, changes.background, changes.sky)
    altered = scene.altered(**given, render=checked_settings(scene.render, changes.render))
    warn_of_slips(changes.camera, changes.materials, "")
    return without(altered, changes.hide)


def surroundings(ambient: Color | None, background: Color | None, sky: Sky | None) -> SceneChanges:
    """The changes of a scene by those that are not None: a background takes the place of a sky, and a sky of a
    background.

    >>> surroundings(None, (0.2, 0.4, 1.0), None)
    {'background': (0.2, 0.4, 1.0), 'sky': None}
    """
    changes: SceneChanges = {} if ambient is None else {"ambient": ambient}
    if background is not None or sky is not None:
        changes |= {"background": background or 0.0, "sky": sky}
    return changes
