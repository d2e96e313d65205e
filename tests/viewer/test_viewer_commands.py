"""A view as text: what is saved of it, and the command line that renders its picture."""

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow
from viewer_client import SIZE, Client, looking
from viewer_page import SCENE

import renderer
from renderer import load_scene
from renderer.cli.main import main
from renderer.viewer.commands import command_of
from renderer.viewer.protocol import AskCommand
from renderer.viewer.shown import open_file

EYE = (0.3, 2.0, 4.0)


@pytest.mark.judges("octree-render render --change")
@pytest.mark.parametrize(
    ("changes", "settings"),
    [
        ({"height": 3.0}, {"samples": 4, "max_depth": 1, "shadows": False}),
        ({}, {"exposure": -1.3}),
        ({"mode": "brute", "w": 40, "h": 30}, {"samples": 4}),
        ({}, {"light": [1.0, -1.0, 0.5], "edits": {"lights": [{"type": "directional", "direction": [0, -1, 0]}]}}),
    ],
)
def test_the_command_renders_the_picture_that_is_seen(
    client: Client, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any], settings: Any
) -> None:
    seen = client.passes(client.view(eye=EYE, settings=settings, **changes))
    mode = changes.get("mode", "octree")
    client.send(**{"type": "command", "mode": mode, **looking(EYE), **SIZE, **changes, "settings": settings})
    program, *words = shlex.split(client.told("command")["text"])
    assert program == "octree-render" and str(scene) in words
    monkeypatch.chdir(tmp_path)
    assert main([*words, "--quiet"]) == 0
    picture = np.asarray(Pillow.open(tmp_path / "blocks.png"))[..., :3]
    assert np.array_equal(picture, seen[-1].rgb)


@pytest.mark.parametrize("settings", [{"aov": "depth"}, {"reflection": False}, {"refraction": False}])
def test_where_no_command_renders_it_that_is_said(client: Client, settings: dict[str, Any]) -> None:
    client.send(**{"type": "command", "mode": "octree", **looking(EYE), **SIZE, "settings": settings})
    assert client.told("error")["message"].startswith("command: expected ")


def test_a_scene_made_in_python_has_no_command(scene: Path) -> None:
    with renderer.view(load_scene(scene), browser=False) as viewing, Client(viewing.url) as client:
        client.send(**{"type": "command", "mode": "octree", **looking(EYE), **SIZE})
        assert "a scene that was made in Python" in client.told("error")["message"]


@pytest.mark.parametrize(("file", "material"), [("-dash.toml", "red"), ("a.toml", "a\x7fb")])
def test_names_that_look_like_options_or_that_toml_escapes_stand_in_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str, material: str
) -> None:
    monkeypatch.chdir(tmp_path)
    text = SCENE.replace("[materials.red]", f"[materials.{json.dumps(material)}]").replace(
        '"red"', json.dumps(material)
    )
    Path(file).write_text(text.replace("\x7f", "\\u007f"))
    shown = open_file(Path(file))
    edits = {"materials": {material: {"type": "phong", "diffuse": [0.1, 0.9, 0.2]}}}
    asked = {"type": "command", "mode": "octree", **looking(EYE), **SIZE, "settings": {"edits": edits}}
    words = shlex.split(command_of(shown, AskCommand.model_validate_json(json.dumps(asked))))
    assert main([*words[1:], "--quiet"]) == 0
    with Pillow.open(Path(file).with_suffix(".png")) as written:
        assert written.size == (SIZE["w"], SIZE["h"])
