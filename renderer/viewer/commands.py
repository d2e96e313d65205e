"""A view as text: tables of a scene file, and the command line that renders the same picture."""

import difflib
import json
import math
import shlex
import tomllib
from collections.abc import Iterator, Sequence
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from renderer.arguments.fields import Fields
from renderer.errors import expect
from renderer.mesh.load import mesh_suffix
from renderer.mesh.mesh import Mesh
from renderer.scene.camera import OrthographicCamera
from renderer.scene.light import DirectionalLight, Light
from renderer.scene.scene import Scene
from renderer.scene.showcase import showcase_text
from renderer.system.files import read_whole
from renderer.viewer.protocol import AskCommand, SaveCamera, SaveScene, ViewSettings
from renderer.viewer.shown import ShownScene, edited
from renderer.viewer.viewpoint import PageCamera, camera_of, camera_toml, page_camera

# A page computes its matrix from angles, in float64: some ten roundings, each of 1e-16 of the largest number.
_ROUNDING = 1e-12
# Distances that are tried for a target, per doubling.
_STEPS = 8


def saved(shown: ShownScene, message: SaveCamera) -> str:
    """The camera as TOML, and with ``settings`` the tables [render] and [[lights]] too."""
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
    now = edited(scene, settings.edits)
    changes += [
        f"materials.{_value(name)} = {_inline(material)}"
        for name, material in now.materials.items()
        if material != scene.materials[name]
    ]
    changes += _changed_surroundings(scene, now)
    if shown.hidden:
        changes.append(f"hide = {_value(shown.hidden)}")
    if settings.light is not None or settings.edits.lights is not None:
        changes.append(f"lights = [{', '.join(map(_inline, lights_of(shown, settings)))}]")
    if settings.shadows != scene.render.shadows:
        changes.append(f"render.shadows = {_value(settings.shadows)}")
    words = ["octree-render", "render", _as_word(str(path)), *(["--up", shown.up] if shown.up else [])]
    words += ["--resolution", f"{asked.w}x{asked.h}"]
    words += ["--samples", str(1 if brute else settings.samples), "--max-depth", str(settings.max_depth)]
    words += ["--accelerator", "brute"] if brute else []
    words += [f"--exposure={settings.exposure!r}"] if settings.exposure else []
    words += [word for change in changes for word in ("--change", change)]
    return shlex.join([*words, "-o", _as_word(f"{path.stem if path else ''}.png")])


def _changed_surroundings(old: Scene, new: Scene) -> Iterator[str]:
    """Lines of TOML for what is around the scene, where that differs."""
    if new.ambient != old.ambient:
        yield f"ambient = {_value(new.ambient)}"
    if new.sky is None and (new.background, new.sky) != (old.background, old.sky):
        yield f"background = {_value(new.background)}"
    if new.sky is not None and new.sky != old.sky:
        yield f"sky = {_inline(new.sky)}"


def _as_word(file: str) -> str:
    """The name of a file as an argument that is not mistaken for an option."""
    return f"./{file}" if file.startswith("-") else file


def _seen_by(shown: ShownScene, message: SaveCamera | SaveScene, walk: bool = False) -> PageCamera:
    """The camera of a message, whose target is about the point of its axis nearest the scene's middle, if that lies
    ahead and it does not ``walk``. Its rays are those of the message's picture to the bit.
    """
    camera = camera_of(message.m, message.fovy, height=message.height)
    middle = np.mean(shown.prepared.mesh.bounds, axis=0)
    ahead = float((middle - camera.eye) @ camera.frame()[2])
    if walk or not 0.0 < ahead < math.inf:
        return camera
    for distance in _distances(ahead):
        # Multiples of few bits of the direction are exact mostly, and then their unit vectors are the same.
        target = np.add(camera.eye, distance * np.subtract(camera.target, camera.eye))
        farther = camera.model_copy(update={"target": tuple(target.tolist())})
        if np.array_equal(farther.frame(), camera.frame()):
            return farther
    return camera


def _distances(ahead: float) -> Iterator[float]:
    """Distances near ``ahead`` that have few bits, the nearest first."""
    exponent = math.frexp(ahead)[1] - 1
    about = (math.ldexp(1.0 + step / _STEPS, exponent) for step in range(-_STEPS // 2, _STEPS + 1))
    return iter(sorted(about, key=lambda distance: abs(distance - ahead)))


class SceneText(NamedTuple):
    """A scene file: its name, its text, and a diff to it from the file that is there."""

    name: str
    text: str
    diff: str


def scene_text(shown: ShownScene, asked: SaveScene) -> SceneText:
    """The scene's file with the view's camera, edits and settings.

    What is not changed stays as it is written, comments and ends of lines too; so do objects that are hidden. A mesh
    file gets a scene file, all of which is new. Raises ``ValueError`` for a scene of no file, and for a file that
    cannot be read or changed.
    """
    path = shown.path
    expect(path is not None, "save", "a scene file or a mesh file", "a scene that was made in Python")
    assert path is not None  # which mypy cannot tell
    expect(not shown.edited, "save", "the file as it was loaded", "one that was edited since")
    if mesh_suffix(path):
        made = _changed_text(_made_for(shown.whole.scene, path.name), shown, asked)
        return SceneText(f"{path.stem}.toml", made, _diff("", made, path.name))
    written = _text_of(path)
    # tomlkit knows no mark of a text's order of bytes, and ends the lines that it adds with a line feed.
    mark, before = ("\ufeff", written[1:]) if written.startswith("\ufeff") else ("", written)
    returns = before.count("\r\n") == before.count("\n") > 0
    if returns:
        before = before.replace("\r\n", "\n")
    after = _changed_text(before, shown, asked)
    text = mark + (after.replace("\n", "\r\n") if returns else after)
    return SceneText(path.name, text, _diff(before, after, path.name))


def _diff(before: str, after: str, name: str) -> str:
    return "\n".join(difflib.unified_diff(before.splitlines(), after.splitlines(), name, "as shown", lineterm=""))


def _made_for(scene: Scene, name: str) -> str:
    """The scene file of the scene that ``load_scene`` put around a mesh file of that name."""
    (mesh,) = (thing.mesh for thing in scene.objects)
    assert isinstance(mesh, Mesh)
    return showcase_text([mesh], [name], scene.up)


def _text_of(path: Path) -> str:
    try:
        return read_whole(path).decode()
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror}") from None


def _changed_text(before: str, shown: ShownScene, asked: SaveScene) -> str:
    """The text of a scene file with what the view has of its own. Raises ``ValueError`` where that cannot be written
    into it.
    """
    import tomlkit  # not needed before a scene is saved

    wanted, document = tomllib.loads(before), tomlkit.parse(before)
    _write(wanted, shown, asked)
    expected = "a file whose values can be changed one by one"
    try:
        _write(document, shown, asked)
        after = tomlkit.dumps(document)
        same = tomllib.loads(after) == wanted
    except Exception as error:  # it has faults with keys in dots: IndexError, ...
        raise ValueError(f"save: expected {expected}, got one on which tomlkit fails: {error!r}") from None
    expect(same, "save", expected, "one that would hold other values")
    return after


def _write(document: Any, shown: ShownScene, asked: SaveScene) -> None:
    """Write the values that the view changed into the tables of the scene's file."""
    scene, settings = shown.whole.scene, asked.settings
    shown_as = page_camera(scene.camera)
    if not _same_view(asked, shown_as):
        kept = f"the view of the file's {scene.camera.type} camera, or Save camera, which writes another file"
        expect(shown_as is scene.camera, "save", kept, "another view")
        _update(document, ("camera",), scene.camera, _seen_by(shown, asked))
    now = edited(scene, settings.edits)
    for name, material in now.materials.items():
        _update(document, ("materials", name), scene.materials[name], material)
    lights = lights_of(shown, settings)
    if len(lights) == len(scene.lights):
        for i, (old, new) in enumerate(zip(scene.lights, lights, strict=True)):
            _update(document, ("lights", i), old, new)
    else:
        document["lights"] = [_given(light) for light in lights]
    _write_surroundings(document, scene, now)
    for key in ("samples", "max_depth", "shadows"):
        if getattr(settings, key) != getattr(scene.render, key):
            document.setdefault("render", {})[key] = getattr(settings, key)


def _write_surroundings(document: Any, old: Scene, new: Scene) -> None:
    """Write what is around the scene; a sky takes the place of a background, and a background of a sky."""
    if new.ambient != old.ambient:
        document["ambient"] = list(new.ambient)
    if new.sky is None:
        document.pop("sky", None)
        if new.background != old.background:
            document["background"] = list(new.background)
    elif old.sky is None:
        document.pop("background", None)
        document["sky"] = _given(new.sky)
    else:
        _update(document, ("sky",), old.sky, new.sky)


def _update(document: Any, keys: Sequence[str | int], old: Fields, new: Fields) -> None:
    """Write the fields of ``new`` that differ from those of ``old`` into the table of a file that ``keys`` lead to."""
    before, after = _given(old), _given(new)
    # The new ones first, or a table of keys in dots would be gone; and each in a table looked up anew, since tomlkit's
    # view of keys in dots is out of date after a change.
    for key, value in after.items():
        if key not in before or value != before[key]:
            reduce(getitem, keys, document)[key] = value
    for key in sorted(before.keys() - after.keys()):
        reduce(getitem, keys, document).pop(key, None)


def _same_view(asked: SaveScene, camera: PageCamera) -> bool:
    """Whether a page's view is that of ``camera`` up to the rounding of its angles."""
    right, up, forward = camera.frame()
    *axes, eye = np.array(asked.m, np.float64).reshape(4, 4)[:, :3]
    size = max(1.0, float(np.abs([camera.eye, camera.target]).max()))
    if not np.allclose(eye, camera.eye, rtol=0.0, atol=_ROUNDING * size):
        return False
    if isinstance(camera, OrthographicCamera):
        film = asked.height is not None and math.isclose(asked.height, camera.height, rel_tol=_ROUNDING)
    else:
        film = asked.height is None and math.isclose(math.degrees(asked.fovy), camera.fov, rel_tol=_ROUNDING)
    return film and np.allclose(axes, [right, up, -forward], rtol=0.0, atol=_ROUNDING)


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
    """The fields and their values, without those that are None, which TOML does not have."""
    return {key: value for key, value in fields.model_dump(mode="json").items() if value is not None}


def _value(value: object) -> str:
    """Numbers, words and lists of numbers in the forms that TOML shares with JSON and Python."""
    # Python writes the shortest decimal that reads back as the same float64. Of all characters that JSON leaves as they
    # are, TOML refuses this one.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
