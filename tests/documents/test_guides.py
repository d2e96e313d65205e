"""Tables of the guides have every key, option and label of the program, and no other."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import SceneError
from renderer.cli.main import make_parser
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.shapes import box
from renderer.scene.camera import (
    EquirectangularCamera,
    FisheyeCamera,
    OpenCVCamera,
    OpenCVFisheyeCamera,
    OrthographicCamera,
    PerspectiveCamera,
    PinholeCamera,
    ThinLensCamera,
)
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.scene import Floor, RenderSettings, Scene, SceneObject
from renderer.scene.sky import Sky
from renderer.viewer import protocol
from validation.__main__ import make_parser as validation_parser

ROOT = Path(__file__).parents[2]
GUIDES = ROOT / "docs" / "guides"
PAGE = ROOT / "renderer" / "viewer" / "page"


def text_of(name: str) -> str:
    return (GUIDES / f"{name}.md").read_text(encoding="utf-8")


def tables(text: str) -> dict[str, list[list[str]]]:
    """The rows of each table by the first cell of its head, without backticks."""
    found = {}
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        head, _, *rows = ([cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in table.splitlines())
        found[head[0].replace("`", "")] = rows
    return found


EYE = {"eye": [0, 0, 5], "target": [0, 0, 0]}
FILM = {"width": 64, "height": 48, "fx": 50, "fy": 50}
# A scene of the loader with the keys alone that are needed, for each table: its class, where it stands, its own keys.
Place = tuple[str | int, ...]
KINDS: dict[str, tuple[type, Place, dict[str, Any]]] = {
    "the file": (Scene, (), {}),
    "[render]": (RenderSettings, ("render",), {}),
    "[camera], perspective": (PerspectiveCamera, ("camera",), EYE),
    "[camera], orthographic": (OrthographicCamera, ("camera",), {"type": "orthographic", "height": 4.0, **EYE}),
    "[camera], thin lens": (ThinLensCamera, ("camera",), {"type": "thin_lens", "aperture": 0.1, **EYE}),
    "[camera], pinhole": (PinholeCamera, ("camera",), {"type": "pinhole", **FILM, **EYE}),
    "[camera], OpenCV": (OpenCVCamera, ("camera",), {"type": "opencv", **FILM, **EYE}),
    "[camera], OpenCV fish-eye": (OpenCVFisheyeCamera, ("camera",), {"type": "opencv_fisheye", **FILM, **EYE}),
    "[camera], fish-eye": (FisheyeCamera, ("camera",), {"type": "fisheye", **EYE}),
    "[camera], equirectangular": (EquirectangularCamera, ("camera",), {"type": "equirectangular", **EYE}),
    "[materials.NAME], Phong": (Phong, ("materials", "NAME"), {}),
    "[materials.NAME], mirror": (Mirror, ("materials", "NAME"), {"type": "mirror"}),
    "[materials.NAME], dielectric": (Dielectric, ("materials", "NAME"), {"type": "dielectric"}),
    "[[lights]], directional": (DirectionalLight, ("lights", 0), {"type": "directional", "direction": [0, -1, 0]}),
    "[[lights]], point": (PointLight, ("lights", 0), {"type": "point", "position": [0, 1, 0]}),
    "[[objects]]": (SceneObject, ("objects", 0), {"mesh": box()}),
    "[sky]": (Sky, ("sky",), {}),
    "[floor]": (Floor, ("floor",), {"min": [0, 0], "max": [1, 1], "materials": ["NAME"]}),
}
# Defaults that are words.
WORDS: dict[str, Any] = {
    "none": (None, ()),
    "half the width": (32.0,),
    "half the height": (24.0,),
    "as `diffuse`": (None,),
    "as `horizon`": (None,),
    "those of the mesh": ("box: plain",),
    "all defaults": (RenderSettings(),),
}


PYTHON = re.compile(r"```python\n(.*?)```", re.DOTALL)
# A line that prints, and the answer that stands behind it.
PRINTED = re.compile(r"^ *print\(.*\)  # (.*)$", re.MULTILINE)
ANSWERED = [
    (page.stem, block)
    for page in sorted(GUIDES.glob("*.md"))
    for block in PYTHON.findall(page.read_text(encoding="utf-8"))
    if PRINTED.search(block)
]


@cases(("name", "block"), ANSWERED)
def test_answers_in_a_guide_are_what_is_printed(
    name: str, block: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    exec(compile(block, name, "exec"), {})
    assert capsys.readouterr().out.splitlines() == PRINTED.findall(block)


def scene_with(place: Place, own: dict[str, Any]) -> dict[str, Any]:
    """The least scene that has a table ``own`` at ``place``."""
    scene: dict[str, Any] = {"camera": dict(EYE), "materials": {"NAME": {}}}
    if place and isinstance(place[-1], int):
        scene[str(place[0])] = [own]
    elif len(place) == 2:
        scene[str(place[0])] = {place[1]: own}
    elif place:
        scene[str(place[0])] = own
    return scene


def at(scene: Scene, place: Place) -> Any:
    found: Any = scene
    for key in place:
        found = found[key] if isinstance(found, dict | tuple) else getattr(found, str(key))
    return found


def test_each_kind_of_table_is_there() -> None:
    found = tables(text_of("scenes-and-materials"))
    assert set(found) == set(KINDS)


@cases("title", KINDS)
def test_keys_and_defaults_are_the_loaders(title: str) -> None:
    rows = tables(text_of("scenes-and-materials"))[title]
    kind, place, needed = KINDS[title]
    assert {row[0].strip("`") for row in rows} == set(kind.model_fields)  # type: ignore[attr-defined]
    if title == "the file":
        needed = scene_with((), {})
    loaded = at(Scene.model_validate(scene_with(place, needed) if place else needed), place)
    assert type(loaded) is kind
    for key, default, _ in rows:
        key = key.strip("`")
        assert (default == "required") == (key in needed), key
        if default == "required":
            rest = {k: v for k, v in needed.items() if k != key}
            with pytest.raises(ValueError):
                made = Scene.model_validate(scene_with(place, rest) if place else rest)
                # Without its type it is another kind, which may be whole.
                assert type(at(made, place)) is not kind or raise_()
                raise_()
        elif default in WORDS:
            assert getattr(loaded, key) in WORDS[default], key
        else:
            told = tomllib.loads(f"x = {default.strip('`')}")["x"]
            found = getattr(loaded, key)
            assert isinstance(told, type(found)) or isinstance(found, tuple), key
            assert (
                found == told
                if isinstance(told, str)
                else np.array_equal(np.broadcast_to(told, np.shape(found)), found)
            )


def raise_() -> None:
    raise SceneError("expected an error")


def options_of(parser: Any) -> set[str]:
    return {name for action in parser._actions for name in action.option_strings} - {"-h", "--help"}


@cases(("command", "column"), [("render", "option"), ("radiosity", "option of radiosity")])
def test_the_options_of_pictures_are_all_there(command: str, column: str) -> None:
    (parser,) = [a for a in make_parser()._actions if a.dest == "command" or (a.choices and "render" in a.choices)]
    rows = tables(text_of("rendering"))[column]
    told = {name for row in rows for name in re.findall(r"`(-[\w-]+)`", row[0])}
    assert told == options_of(parser.choices[command])  # type: ignore[index,call-overload]


def test_the_options_of_octree_validate_are_all_there() -> None:
    rows = tables(text_of("validation-in-your-ci"))["option"]
    assert sorted(row[0].strip("`") for row in rows) == sorted(options_of(validation_parser()))


def test_exit_codes_are_those_of_the_command() -> None:
    told = [row[0] for row in tables(text_of("validation-in-your-ci"))["exit code"]]
    said = validation_parser().format_help().partition("Exit codes:")[2]
    assert told == re.findall(r"^  (\d+) ", said, re.MULTILINE)


def page_text() -> str:
    """The viewer's page as one text: the words of its markup, and its scripts, which make more of it."""
    markup = (PAGE / "index.html").read_text(encoding="utf-8")
    scripts = "\n".join(path.read_text(encoding="utf-8") for path in sorted(PAGE.glob("*.js")))
    return re.sub(r"<[^>]*>", "\n", markup) + scripts


def test_labels_in_the_guide_stand_on_the_viewers_page() -> None:
    text = page_text()
    labels = {label.replace("\\|", "|") for label in re.findall(r"(?<!\*)\*([^*\n]+)\*(?!\*)", text_of("viewer"))}
    assert len(labels) > 15 and [label for label in sorted(labels) if label not in text] == []


def test_the_modes_of_the_guide_are_the_viewers() -> None:
    rows = tables(text_of("viewer"))["key"]
    markup = (PAGE / "index.html").read_text(encoding="utf-8")
    shown = re.findall(r'name="mode" value="(\w+)".*?<kbd>(\d)</kbd>([^<]+)<', markup)
    assert tuple(value for value, _, _ in shown) == protocol.MODES
    assert [(row[0], row[1]) for row in rows] == [(key, name) for _, key, name in shown]


def test_the_keys_of_the_guide_are_the_viewers() -> None:
    """Each single key of the page's own list, and no other."""
    rows = tables(text_of("viewer"))["hand"]
    markup = (PAGE / "index.html").read_text(encoding="utf-8").partition('id="keys"')[2]
    keys = {key for cell in re.findall(r"<dt>(.*?)</dt>", markup) for key in re.findall(r"<kbd>(.+?)</kbd>", cell)}
    told = {key for row in rows for key in re.split(r"[ ,](?=.)|,", row[0].replace(" , ", " comma ")) if key}
    told = {"," if key == "comma" else key for key in told}
    assert keys <= told
