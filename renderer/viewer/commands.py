"""A view as text: tables of a scene file, and the command line that renders the same picture."""

import difflib
import json
import shlex
from collections.abc import Sequence
from typing import Any

import numpy as np

from renderer.errors import expect
from renderer.scene.camera import Camera
from renderer.scene.fields import Fields
from renderer.scene.light import DirectionalLight, Light
from renderer.viewer.protocol import AskCommand, SaveCamera, SaveScene, ViewSettings
from renderer.viewer.shown import ShownScene, edited
from renderer.viewer.viewpoint import camera_of, camera_toml

# A page computes its matrix from angles, in float64: some ten roundings, each of 1e-16 of the largest number.
_ROUNDING = 1e-12


def saved(shown: ShownScene, message: SaveCamera) -> str:
    """The camera as TOML, and with settings their tables too: what the file of the scene has, but for these."""
    camera = _seen_by(shown, message, message.walk)
    text = camera_toml(camera)
    if message.settings is None:
        return text
    chosen = {key: getattr(message.settings, key) for key in ("samples", "max_depth", "shadows")}
    render = ["[render]", *(f"{key} = {_value(value)}" for key, value in chosen.items()), ""]
    lights = [line for light in lights_of(shown, message.settings) for line in ("[[lights]]", *_lines(light), "")]
    return "\n".join([text, *render, *lights])


def command_of(shown: ShownScene, asked: AskCommand) -> str:
    """The command line whose picture is that of the view, to the bit.

    Raises ``ValueError`` where there is none: for a scene made in Python, with switches that no scene file has, and for
    other values than colours.
    """
    settings, brute = asked.settings, asked.mode == "brute"
    expect(shown.path is not None, "command", "a scene file", "a scene that was made in Python")
    expect(settings.aov == "color", "command", "the picture in colour", settings.aov)
    for switch in ("reflection", "refraction"):
        expect(getattr(settings, switch), "command", f"{switch} as the materials have it", "it switched off")
    scene, path = shown.scene, shown.path
    changes = [f"camera = {_inline(camera_of(asked.m, asked.fovy, height=asked.height))}"]
    changes += [
        f"materials.{_value(name)} = {_inline(material)}"
        for name, material in edited(scene, settings.edits).materials.items()
        if material != scene.materials[name]
    ]
    if shown.hidden:
        changes.append(f"hide = {_value(shown.hidden)}")
    if settings.light is not None or settings.edits.lights is not None:
        changes.append(f"lights = [{', '.join(map(_inline, lights_of(shown, settings)))}]")
    if settings.shadows != scene.render.shadows:
        changes.append(f"render.shadows = {_value(settings.shadows)}")
    words = ["octree-render", "render", str(path), "--resolution", f"{asked.w}x{asked.h}"]
    words += ["--samples", str(1 if brute else settings.samples), "--max-depth", str(settings.max_depth)]
    words += ["--accelerator", "brute"] if brute else []
    words += [word for change in changes for word in ("--change", change)]
    return shlex.join([*words, "-o", f"{path.stem if path else ''}.png"])


def _seen_by(shown: ShownScene, message: SaveCamera | SaveScene, walk: bool = False) -> Camera:
    """The camera of a message, whose target is the point of its axis nearest the scene's middle, if that lies ahead and
    it does not ``walk``.
    """
    camera = camera_of(message.m, message.fovy, height=message.height)
    middle = np.mean(shown.prepared.mesh.bounds, axis=0)
    ahead = float((middle - camera.eye) @ camera.frame()[2])
    return camera_of(message.m, message.fovy, ahead, message.height) if ahead > 0.0 and not walk else camera


def scene_text(shown: ShownScene, asked: SaveScene) -> tuple[str, str]:
    """The scene's file with the view's camera, materials, lights and settings, and a diff to it from the file.

    What is not changed stays as it is written, comments too; so do objects that are hidden. Raises ``ValueError`` for a
    scene of no such file.
    """
    import tomlkit  # not needed before a scene is saved

    path, scene, settings = shown.path, shown.whole.scene, asked.settings
    told = "a scene that was made in Python" if path is None else str(path)
    expect(path is not None and path.suffix.lower() == ".toml", "save", "a scene file", told)
    assert path is not None  # which mypy cannot tell
    expect(not shown.edited, "save", "the file as it was loaded", "one that was edited since")
    before = path.read_text("utf-8-sig")
    document = tomlkit.parse(before)
    camera = _seen_by(shown, asked)
    if not _same_picture(camera, scene.camera):
        _update(document["camera"], scene.camera, camera)
    for name, material in edited(scene, settings.edits).materials.items():
        _update(document["materials"][name], scene.materials[name], material)
    lights = lights_of(shown, settings)
    if len(lights) == len(scene.lights):
        for table, old, new in zip(document.get("lights", []), scene.lights, lights, strict=True):
            _update(table, old, new)
    else:
        document["lights"] = [_given(light) for light in lights]
    for key in ("samples", "max_depth", "shadows"):
        if getattr(settings, key) != getattr(scene.render, key):
            document.setdefault("render", {})[key] = getattr(settings, key)
    after = tomlkit.dumps(document)
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), path.name, "as shown", lineterm="")
    return after, "\n".join(lines)


def _update(table: Any, old: Fields, new: Fields) -> None:
    """Write the fields of ``new`` that differ from those of ``old`` into its table of a file."""
    before, after = _given(old), _given(new)
    for key in before.keys() - after.keys():
        table.pop(key, None)
    for key, value in after.items():
        if key not in before or value != before[key]:
            table[key] = value


def _same_picture(one: Camera, other: Camera) -> bool:
    """Whether cameras have the same rays, but for rounding: a page's matrix has no target."""
    first, second = one.rows(1, 1), other.rows(1, 1)
    size = max(1.0, float(np.abs(second).max()))
    return one.type == other.type and bool(np.allclose(first, second, rtol=0.0, atol=_ROUNDING * size))


def lights_of(shown: ShownScene, settings: ViewSettings) -> Sequence[Light]:
    """The scene's lights, or those of the settings, of which the first directional one that shines is turned as they
    say.
    """
    lights = list(edited(shown.scene, settings.edits).lights)
    for i, light in enumerate(lights):
        if settings.light is not None and isinstance(light, DirectionalLight) and any(light.irradiance):
            lights[i] = light.model_copy(update={"direction": settings.light})
            break
    return lights


def _inline(fields: Fields) -> str:
    return f"{{{', '.join(_lines(fields))}}}"


def _lines(fields: Fields) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in _given(fields).items()]


def _given(fields: Fields) -> dict[str, Any]:
    """The fields and their values, but for those without one, as TOML has it."""
    return {key: value for key, value in fields.model_dump(mode="json").items() if value is not None}


def _value(value: object) -> str:
    """Numbers, words and lists of numbers in the forms that TOML shares with JSON and Python."""
    # Python writes the shortest decimal that reads back as the same float64.
    return json.dumps(value, ensure_ascii=False)
