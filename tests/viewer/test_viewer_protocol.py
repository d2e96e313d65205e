"""What page and server say to each other: every message's checks, and the header byte by byte."""

import json
import math
import re
import struct
from pathlib import Path
from typing import Any, get_args

import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st

from renderer import viewer
from renderer.arguments.limits import FARTHEST
from renderer.viewer.protocol import (
    FILE,
    JPEG,
    MAX_EDITS,
    MAX_FOVY,
    MAX_FRAME_PIXELS,
    MAX_FRAMES,
    MAX_HIDDEN,
    MAX_MESSAGE_BYTES,
    MAX_PIXELS,
    MAX_SIDE,
    MIN_FOVY,
    MODES,
    Ack,
    AskCommand,
    CameraMessage,
    Cancel,
    Hello,
    HideObjects,
    Measure,
    Message,
    OpenScene,
    Pick,
    Probe,
    Rows,
    SaveCamera,
    Still,
    Stop,
    Turntable,
    ViewSettings,
    packed,
    parse,
)

M = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.5, 1.0, 4.0, 1.0]
SETTINGS = {
    "max_depth": 3,
    "samples": 4,
    "shadows": False,
    "reflection": True,
    "refraction": False,
    "aov": "depth",
    "light": [0, -1.5, 0.25],
    "pixels": "jpeg",
    "pair": "samples",
    "refine": 16,
}
SIZE = {"w": 320, "h": 240}
VIEW = {"type": "view", "seq": 7, "mode": "octree", "m": M, "fovy": 0.7, "height": 2.5, **SIZE, "settings": SETTINGS}
PICK = {
    "type": "pick",
    "seq": 8,
    "x": 319,
    "y": 239,
    "m": M,
    "fovy": 0.7,
    "height": 2,
    **SIZE,
    "settings": SETTINGS,
    "proof": 3,
}
PIXEL = {key: PICK[key] for key in ("x", "y", "m", "fovy", "height", "w", "h")}
PROBE = {"type": "probe", "seq": 8, "mode": "brute", **PIXEL, "settings": SETTINGS}
MEASURE = {"type": "measure", "seq": 8, "pixels": [PIXEL, PIXEL | {"x": 0}]}
CAMERA = {"type": "camera", "m": M, "fovy": 0.7, "height": 1e-3}
COMMAND = {"type": "command", "mode": "brute", "m": M, "fovy": 0.7, "height": 1e-3, **SIZE, "settings": SETTINGS}
STILL = {"type": "still", "seq": 9, "m": M, "fovy": 0.7, "height": 1e-3, **SIZE, "settings": SETTINGS}
TURN = {"pivot": [0, 0.5, -1], "axis": [0, 1, 0], "frames": 24, "format": "gif"}
TURNTABLE = STILL | {"type": "turntable"} | TURN
# The keys of a message that may be left out.
OPTIONAL = {"settings", "walk", "height", "proof", "frames", "format"}
# A message that may name no file.
HELLO = {"type": "hello", "file": "a b.toml", "server": "0123456789abcdef"}


def said(message: Any) -> str:
    return json.dumps(message)


@cases(
    ("message", "kind"),
    [
        (VIEW, CameraMessage),
        (PICK, Pick),
        (PROBE, Probe),
        (MEASURE, Measure),
        (CAMERA | {"walk": True}, SaveCamera),
        (CAMERA | {"settings": SETTINGS}, SaveCamera),
        (COMMAND, AskCommand),
        (HELLO, Hello),
        ({"type": "ack", "seq": 7, "step": 2}, Ack),
        ({"type": "cancel"}, Cancel),
        ({"type": "scene", "file": "a b.toml"}, OpenScene),
        (STILL, Still),
        (TURNTABLE, Turntable),
        ({"type": "stop"}, Stop),
    ],
)
def test_a_message_is_what_it_says(message: dict[str, Any], kind: type) -> None:
    read = parse(said(message))
    assert type(read) is kind
    assert json.loads(read.model_dump_json(exclude_unset=True)) == message
    for key in message.keys() - OPTIONAL - ({"file", "server"} if message is HELLO else set()):
        with pytest.raises(ValueError, match=f"{key}|discriminator 'type'"):
            parse(said({name: value for name, value in message.items() if name != key}))
    with pytest.raises(ValueError, match="surplus: Extra inputs are not permitted, got 1"):
        parse(said(message | {"surplus": 1}))


def test_what_is_left_out_is_as_a_scene_is_first_shown() -> None:
    left_out = parse(said({key: value for key, value in VIEW.items() if key != "settings"}))
    assert isinstance(left_out, CameraMessage)
    assert left_out.settings == ViewSettings(max_depth=6, samples=1, aov="color", light=None, pixels="rgba")
    assert left_out.settings.shadows and left_out.settings.reflection and left_out.settings.refraction
    walk = parse(said(CAMERA))
    assert isinstance(walk, SaveCamera) and not walk.walk


@cases(
    ("key", "values"),
    [
        ("seq", [0, 2**32 - 1]),
        ("mode", list(MODES)),
        ("fovy", [MIN_FOVY, 1, MAX_FOVY]),
        ("height", [5e-324, 1, FARTHEST, None]),
        ("w", [1, MAX_SIDE]),
        ("h", [1, MAX_SIDE]),
        ("m", [[0] * 16, [-1e308] * 16]),
    ],
)
def test_a_view_reaches_to_its_limits(key: str, values: list[Any]) -> None:
    for value in values:
        assert getattr(parse(said(VIEW | {key: value})), key) == value


BAD = [
    ("seq", [-1, 2**32, 1.5, "1", True, None], "seq"),
    ("mode", ["", "GL", "ray", 1, None, ["gl"]], "mode"),
    ("fovy", [0, -0.7, 0.0009, 3.11, 1e999, math.nan, "0.7", None], "fovy"),
    ("height", [0, -0.0, -1, FARTHEST * 2, 1e999, math.nan, "2", True], "height"),
    ("w", [0, -1, 4097, 10**30, 320.5, "320", True, None], "w"),
    ("h", [0, -1, 4097, 10**30, 320.5, "240", True, None], "h"),
    ("m", [M[:15], [*M, 0.0], [], None, "1" * 16, {str(i): 1 for i in range(16)}], "m"),
    ("m", [[*M[:5], bad, *M[6:]] for bad in (math.nan, math.inf, -math.inf, "0", None, [], True)], r"m\.5"),
]


@cases(
    ("message", "key", "values", "where"),
    [(said, *bad) for said in (VIEW, PICK, PROBE, CAMERA, COMMAND, STILL, TURNTABLE) for bad in BAD if bad[0] in said],
)
def test_a_bad_value_is_refused_by_its_key(message: dict[str, Any], key: str, values: list[Any], where: str) -> None:
    for value in values:
        with pytest.raises(ValueError, match=rf"^{message['type']}\.{where}: .*, got "):
            parse(said(message | {key: value}))


@cases(
    ("key", "values"),
    [
        ("max_depth", [-1, 65, 1.5, "3", None]),
        ("samples", [0, -4, 2, 3, 65, 100, 10**9, 4.5, None]),
        ("refine", [0, -4, 2, 3, 65, 100, 10**9, 4.5, None]),
        ("pair", ["", "a" * 41, 1, None]),
        ("shadows", [0, 1, "true", None]),
        ("reflection", [0, 1, "true", None]),
        ("refraction", [0, 1, "true", None]),
        ("aov", ["", "colour", "albedo", 1, None]),
        (
            "light",
            [[0, 0, 0], [-0.0, 0.0, 0], [1, 2], [1, 2, 3, 4], [1, 2, math.nan], [1e999, 0, 0], ["1", 0, 0], 1, ""],
        ),
        ("pixels", ["png", "", None, 1]),
        ("surplus", [1]),
    ],
)
def test_bad_settings_are_refused_by_their_key(key: str, values: list[Any]) -> None:
    for message in (VIEW, PICK, STILL, TURNTABLE):
        for value in values:
            with pytest.raises(ValueError, match=rf"^{message['type']}\.settings\.{key}(\.\d)?: .*, got "):
                parse(said(message | {"settings": SETTINGS | {key: value}}))


@cases("pixel", [{"x": 320}, {"y": 240}, {"x": -1}, {"y": -1}, {"x": 1.5}, {"x": 1024, "w": 1024}])
def test_a_pick_lies_in_its_picture(pixel: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"^pick(\.[xy])?: .*, got "):
        parse(said(PICK | pixel))


@cases("file", ["a" * 256, None, 1, ["a.toml"]])
def test_a_scene_has_a_name_that_a_file_may_have(file: Any) -> None:
    for kind in ("scene", "hello"):
        with pytest.raises(ValueError, match=rf"^{kind}\.file: "):
            parse(said({"type": kind, "file": file}))


@cases(
    "text",
    [
        "",
        "x",
        "{",
        "null",
        "[]",
        '"view"',
        "{}",
        '{"type": null}',
        '{"type": "exec"}',
        '{"type": ["view"]}',
        '{"type": "cancel"} {"type": "cancel"}',
        '{"type": "\\ud800"}',
        "[" * MAX_MESSAGE_BYTES,
        '{"type":' * (MAX_MESSAGE_BYTES // 8),
        "9" * MAX_MESSAGE_BYTES,
    ],
)
def test_garbage_is_refused_in_few_words(text: str) -> None:
    with pytest.raises(ValueError, match=r"^message: ") as refused:
        parse(text)
    assert len(str(refused.value)) < 300


KEYS = [*VIEW, *PICK, *TURNTABLE, *SETTINGS]
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(KEYS) | st.text(), inner),
    max_leaves=20,
)


@given(
    st.text()
    | JSON.map(said)
    | st.dictionaries(st.sampled_from([*PICK, "mode"]), JSON).map(lambda d: said(VIEW | d))
    | st.dictionaries(st.sampled_from([*TURNTABLE]), JSON).map(lambda d: said(TURNTABLE | d))
)
def test_whatever_comes_is_a_message_or_a_value_error(text: str) -> None:
    try:
        read = parse(text)
    except ValueError:
        return
    assert isinstance(read, get_args(Message))


@cases(
    ("key", "values"),
    [
        ("frames", [0, 1, -36, MAX_FRAMES + 1, 36.5, "36", None]),
        ("format", ["png", "WEBP", "", None, 1]),
        ("pivot", [[0, 0], [0, 0, 0, 0], [0, 0, math.nan], [1e999, 0, 0], ["0", 0, 0], None]),
        ("axis", [[0, 0, 0], [-0.0, 0, 0], [0, 1], [0, 1, math.nan], [0, 1e999, 0], None]),
    ],
)
def test_a_turntable_turns_a_few_times_about_a_line(key: str, values: list[Any]) -> None:
    for value in values:
        with pytest.raises(ValueError, match=rf"^turntable\.{key}(\.\d)?: .*, got "):
            parse(said(TURNTABLE | {key: value}))


def test_what_the_page_offers_is_allowed() -> None:
    """A turntable of 72 frames 720 high was offered, and refused."""
    lists = (Path(viewer.__file__).parent / "page" / "sharing.js").read_text()
    height, frames = (
        max(int(n) for n in re.findall(r'\["(\d+)"', re.findall(f"const {name} = (.*)", lists)[0]))
        for name in ("HEIGHTS", "FRAMES")
    )
    assert (height, frames) == (720, 72)
    assert parse(said(TURNTABLE | {"w": MAX_SIDE, "h": height, "frames": frames}))


def test_a_rule_of_a_whole_message_is_told_without_the_message() -> None:
    """It was told as a Value error, with the message's first forty characters as Python writes a dict."""
    with pytest.raises(ValueError) as told:
        parse(said(TURNTABLE | {"w": 1024, "h": 1024, "frames": 257}))
    of = "257 frames of 1024 x 1024"
    assert str(told.value) == f"turntable: expected at most {MAX_FRAME_PIXELS} pixels in all frames, got {of}"
    with pytest.raises(ValueError, match=r"turntable\.w: Field required$"):
        parse(said({key: value for key, value in TURNTABLE.items() if key != "w"}))


def test_a_turntable_has_at_most_so_many_pixels() -> None:
    size = {"w": 1024, "h": 1024}
    most = MAX_FRAME_PIXELS // 1024**2
    assert parse(said(TURNTABLE | size | {"frames": most}))
    left_out = parse(said({key: value for key, value in TURNTABLE.items() if key not in ("frames", "format")}))
    assert isinstance(left_out, Turntable) and (left_out.frames, left_out.format) == (36, "webp")


@cases("message", [VIEW, PICK, COMMAND, STILL])
def test_a_picture_has_at_most_so_many_pixels(message: dict[str, Any]) -> None:
    assert parse(said(message | {"w": MAX_SIDE, "h": MAX_PIXELS // MAX_SIDE}))
    with pytest.raises(ValueError, match=rf"{message['type']}: .*at most {MAX_PIXELS} pixels, got 4096 x 2049"):
        parse(said(message | {"w": MAX_SIDE, "h": MAX_PIXELS // MAX_SIDE + 1}))


COLOR = [0.12345678901234567, 1.2345678901234567e-10, 0.9876543210987654]
MATERIAL = {
    "type": "phong",
    **dict.fromkeys(("ambient", "diffuse", "specular", "reflectance", "transmittance"), COLOR),
    "shininess": COLOR[0],
    "ior": 1.2345678901234567,
}
LIGHT = {"type": "point", "position": [-1234.5678901234567] * 3, "intensity": COLOR}


def edited(materials: int, lights: int) -> str:
    edits = {"materials": {f"material_{i}": MATERIAL for i in range(materials)}, "lights": [LIGHT] * lights}
    return said(VIEW | {"settings": SETTINGS | {"edits": edits}})


def test_a_page_may_change_many_materials_and_lights_and_hide_many_objects() -> None:
    """A message of 121 lights or 150 materials ended its connection, and the page sent it again for ever."""
    view = edited(MAX_EDITS, MAX_EDITS)
    read = parse(view)
    assert isinstance(read, CameraMessage) and len(view.encode()) < MAX_MESSAGE_BYTES
    assert len(read.settings.edits.materials) == len(read.settings.edits.lights or ()) == MAX_EDITS
    hide = said({"type": "hide", "hidden": ["x" * 40] * MAX_HIDDEN})
    assert isinstance(parse(hide), HideObjects) and len(hide.encode()) < MAX_MESSAGE_BYTES


@pytest.mark.parametrize(
    ("text", "where"),
    [
        (edited(MAX_EDITS + 1, 0), r"settings\.edits\.materials: .* at most 1024 items"),
        (edited(0, MAX_EDITS + 1), r"settings\.edits\.lights: .* at most 1024 items"),
        (said({"type": "hide", "hidden": ["a"] * (MAX_HIDDEN + 1)}), r"hidden: .* at most 4096 items"),
    ],
    ids=["materials", "lights", "hidden"],
)
def test_more_of_them_are_refused_by_their_key(text: str, where: str) -> None:
    with pytest.raises(ValueError, match=where):
        parse(text)


def test_the_header_is_40_bytes_little_endian() -> None:
    view = CameraMessage(type="view", seq=2**32 - 1, mode="octree", m=M, fovy=0.7, w=320, h=240)
    header = packed(JPEG, view, 2, True, 128, Rows(32, 64, 96), (1.5, 0.25))
    words = "02000000 ffffffff 02000000 01000000 80000000 40000000 20000000 60000000"
    assert header == bytes.fromhex(f"{words} 0000c03f 0000803e")
    piece = Still(type="still", seq=3, m=M, fovy=0.7, w=320, h=240)
    header = packed(FILE, piece, 1, True, 320, Rows(2**20, 5, 2**20 + 5), (0.0, 0.0))
    words = "05000000 03000000 01000000 01000000 40010000 05000000 00001000 05001000"
    assert header == bytes.fromhex(f"{words} 00000000 00000000")
    whole = packed(JPEG, view, 0, False, 1, Rows(0, 1, 1), (0.0, 0.0))
    assert struct.unpack("<8I2f", whole)[2:4] == (0, 0)
