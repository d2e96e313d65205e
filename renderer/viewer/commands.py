"""A view as text: tables of a scene file, and the command line that renders the same picture."""

import json
import shlex
from collections.abc import Sequence

import numpy as np

from renderer.errors import expect
from renderer.scene.fields import Fields
from renderer.scene.light import DirectionalLight, Light
from renderer.viewer.protocol import AskCommand, SaveCamera, ViewSettings
from renderer.viewer.shown import ShownScene
from renderer.viewer.viewpoint import camera_of, camera_toml


def saved(shown: ShownScene, message: SaveCamera) -> str:
    """The camera as TOML, and with settings their tables too: what the file of the scene has, but for these.

    The camera's target is the point of its axis nearest the scene's middle, if that lies ahead.
    """
    camera = camera_of(message.m, message.fovy, height=message.height)
    if not message.walk:
        middle = np.mean(shown.prepared.mesh.bounds, axis=0)
        ahead = float((middle - camera.eye) @ camera.frame()[2])
        if ahead > 0.0:
            camera = camera_of(message.m, message.fovy, ahead, message.height)
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
    if settings.light is not None:
        changes.append(f"lights = [{', '.join(map(_inline, lights_of(shown, settings)))}]")
    if settings.shadows != scene.render.shadows:
        changes.append(f"render.shadows = {_value(settings.shadows)}")
    words = ["octree-render", "render", str(path), "--resolution", f"{asked.w}x{asked.h}"]
    words += ["--samples", str(1 if brute else settings.samples), "--max-depth", str(settings.max_depth)]
    words += ["--accelerator", "brute"] if brute else []
    words += [word for change in changes for word in ("--change", change)]
    return shlex.join([*words, "-o", f"{path.stem if path else ''}.png"])


def lights_of(shown: ShownScene, settings: ViewSettings) -> Sequence[Light]:
    """The scene's lights, of which the first directional one that shines is turned as the settings say."""
    lights = list(shown.scene.lights)
    for i, light in enumerate(lights):
        if settings.light is not None and isinstance(light, DirectionalLight) and any(light.irradiance):
            lights[i] = light.model_copy(update={"direction": settings.light})
            break
    return lights


def _inline(fields: Fields) -> str:
    return f"{{{', '.join(_lines(fields))}}}"


def _lines(fields: Fields) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in fields.model_dump().items()]


def _value(value: object) -> str:
    """Numbers, words and lists of numbers in the forms that TOML shares with JSON and Python."""
    # Python writes the shortest decimal that reads back as the same float64.
    return json.dumps(value)
