"""Each key of the page's messages, alone: the view that it asks for, a click's pixel, and a turntable's turn."""

import io
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import tomlkit
from cases import cases
from PIL import Image as Pillow
from varied import BASE, Table, write_meshes
from viewer_client import frames
from viewer_ways import INSIDE, WAYS, WRITTEN, Case, page_of, phong, same, save, save_camera

from renderer import srgb
from renderer.viewer import protocol
from renderer.viewer.export import turned, turntable
from renderer.viewer.pick import picked
from renderer.viewer.shown import ShownScene, open_file

# Another value for each of what a page says of its view.
VIEWS: Table = {"m": INSIDE, "fovy": 1.1, "height": 2.5, "w": 13, "h": 5}
TURN: Table = {"pivot": [0.0, 0.4, 0.0], "axis": [0.0, 1.0, 0.0], "frames": 3, "format": "webp"}
OTHER_TURN: Table = {"pivot": [0.6, 0.1, 0.3], "axis": [0.2, 1.0, 0.3], "frames": 4, "format": "gif"}
# By message: the keys beside those of a view and its settings that are varied here,
HERE = {protocol.Pick: {"x", "y"}, protocol.Turntable: TURN.keys()}
# and in tests/viewer/test_viewer_*.py: of server, commands, proof, edits, export, measure and probe.
ELSEWHERE = {
    protocol.CameraMessage: {"mode"}, protocol.AskCommand: {"mode"}, protocol.Pick: {"proof"},
    protocol.SaveCamera: {"walk"}, protocol.Ack: {"step"}, protocol.HideObjects: {"hidden"},
    protocol.Probe: {"x", "y", "mode"}, protocol.Measure: {"pixels"}, protocol.Still: {"format"},
    protocol.OpenScene: {"file"}, protocol.Hello: {"file", "hidden", "server"},
}  # fmt: skip


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """The scene on show as a page begins with it."""
    folder: Path = tmp_path_factory.mktemp("keys")
    write_meshes(folder)
    (folder / "shown.toml").write_text(tomlkit.dumps(BASE))
    shown: ShownScene = open_file(folder / "shown.toml")
    return Case(shown, page_of(shown.scene), shown.scene).seen()


def test_every_key_has_a_case() -> None:
    for message in get_args(protocol.Message):
        own = message.model_fields.keys() - VIEWS.keys() - {"type", "seq", "settings"}
        assert own == HERE.get(message, set()) | ELSEWHERE.get(message, set()), message


@cases("way", [*WAYS, *WRITTEN])
@cases("key", VIEWS)
def test_a_view_is_the_one_that_is_sent(usual: Case, key: str, way: Any) -> None:
    """Whichever message says so. A saved file has no size of a page."""
    found, expected = way(usual.seen(**{key: VIEWS[key]}))
    assert same((found, expected))
    blind = (way is phong and key != "m") or (way in (save, save_camera) and key in "wh")
    assert blind or not same((found, way(usual)[0]))


@cases("key", TURN)
def test_a_turn_is_the_one_that_is_asked_for(usual: Case, key: str) -> None:
    turn = TURN | {key: OTHER_TURN[key]}
    files = [turntable(usual.shown, usual.message("turntable", seq=1, **t), lambda rays: None) for t in (turn, TURN)]
    expected = []
    for step in range(turn["frames"]):
        axis = np.array(turn["axis"]) / np.linalg.norm(turn["axis"])
        m = turned(usual.looking["m"], np.array(turn["pivot"]), axis, 2.0 * np.pi * step / turn["frames"])
        expected.append(srgb(usual.seen(m=m).picture().radiance))
    found = frames(files[0])
    if key == "format":
        assert [Pillow.open(io.BytesIO(file)).format for file in files] == ["GIF", "WEBP"]
        # Of 80 pixels a frame, no two colours stand for each other.
    assert np.array_equal(found, expected) and files[0] != files[1]


@pytest.mark.parametrize("key", ["x", "y"])
def test_a_click_is_on_the_pixel_that_is_named(usual: Case, key: str) -> None:
    faces = usual.picture().face
    at = {"x": 5, "y": 4}
    for place in range(8):
        at[key] = place
        told = picked(usual.shown, usual.message("pick", seq=1, **at))
        assert (told["face"] if told["hit"] else -1) == faces[at["y"], at["x"]]
    assert len({*faces[4]}) > 2 and len({*faces[:, 5]}) > 2
