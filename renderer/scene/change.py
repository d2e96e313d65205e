"""Changes of a scene by lines of TOML: the option ``--change``."""

import tomllib
from typing import Any

from pydantic import Field, ValidationError

from renderer.errors import expect
from renderer.scene.fields import Fields, first_fault
from renderer.scene.hide import without
from renderer.scene.scene import AnyCamera, AnyLight, AnyMaterial, Scene, checked_settings, warn_of_slips


class _Changes(Fields):
    camera: AnyCamera | None = None
    lights: tuple[AnyLight, ...] | None = None
    materials: dict[str, AnyMaterial] = Field({})
    render: dict[str, Any] = Field({})
    hide: tuple[str, ...] = ()


def changed(scene: Scene, text: str) -> Scene:
    """``scene`` with the camera, the lights, the materials and the keys of ``render`` in the TOML ``text``, and without
    the objects in its list ``hide``, such as ``objects.0`` or ``floor``.

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
    altered = scene.altered(**given, render=checked_settings(scene.render, changes.render))
    warn_of_slips(changes.camera, changes.materials, "")
    return without(altered, changes.hide)
