"""Files that the server makes for a page: pictures of any size and turntables, with progress and an end at any time."""

import io
import json
import math
import shlex
import sys
import threading
import weakref
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pillow
from viewer_client import HEAVY, Client, Got, decoded, frames, looking, rendered

from renderer import load_scene
from renderer.cli.main import main
from renderer.picture.image import srgb
from renderer.viewer import export, passes
from renderer.viewer.commands import command_of
from renderer.viewer.protocol import FILE, Still, parse
from renderer.viewer.shown import ShownScene, open_file

EYE = (0.5, 2.6, 5.5)
TURN: dict[str, Any] = {"pivot": [0.0, 0.5, 0.0], "axis": [0.0, 1.0, 0.0], "frames": 6}


@pytest.fixture(scope="module")
def shown(scene: Path) -> ShownScene:
    return open_file(scene)


def still(seq: int = 1, w: int = 200, h: int = 150, **changes: Any) -> dict[str, Any]:
    return {"type": "still", "seq": seq, **looking(EYE), "w": w, "h": h, **changes}


def turntable(seq: int = 1, w: int = 64, h: int = 48, **changes: Any) -> dict[str, Any]:
    return still(seq, w, h) | {"type": "turntable", **TURN, **changes}


def read(asked: dict[str, Any]) -> Any:
    """The message as the server has it."""
    return parse(json.dumps(asked))


def pieces(client: Client, seq: int = 1) -> tuple[list[float], list[Got]]:
    """The shares that were told of file ``seq``, and its pieces."""
    shares, got = [], []
    while not (got and got[-1].last):
        message = client.next()
        if isinstance(message, Got):
            assert message.kind == FILE and message.seq == seq
            got.append(message)
        else:
            assert message["type"] == "export" and message["seq"] == seq, message
            shares.append(message["done"])
    return shares, got


def received(client: Client, asked: dict[str, Any]) -> bytes:
    client.send(**asked)
    return b"".join(piece.payload for piece in pieces(client, asked["seq"])[1])


@pytest.mark.parametrize("bands", [False, True])
def test_a_still_is_the_file_that_the_renderer_saves(
    client: Any, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bands: bool
) -> None:
    settings = {"samples": 4, "max_depth": 2}
    if bands:
        monkeypatch.setattr(passes, "BAND_PIXELS", 10_000)
    rendered(load_scene(scene), **settings).save(tmp_path / "expected.png")
    file = received(client, still(settings=settings))
    assert file == (tmp_path / "expected.png").read_bytes()


@cases("bands", [False, True])
@cases("kind", ["transparent", "exr"])
def test_a_still_of_another_format_is_the_file_of_the_command(
    shown: ShownScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bands: bool, kind: str
) -> None:
    """The bits of an EXR file are not compared, but its layers are: it may hold a date."""
    if bands:
        monkeypatch.setattr(passes, "BAND_PIXELS", 10_000)
    settings = {"samples": 4, "exposure": -0.7}
    asked = read(still(settings=settings, format=kind))
    command = {"type": "command", "mode": "octree", **looking(EYE), "w": asked.w, "h": asked.h, "settings": settings}
    words = shlex.split(command_of(shown, read(command)))
    done: list[float] = []
    file = export.still(shown, asked, done.append)
    assert sum(done) == pytest.approx(export.work(asked))
    found, expected = (tmp_path / f"{name}.{'exr' if kind == 'exr' else 'png'}" for name in ("found", "expected"))
    found.write_bytes(file)
    assert main([*words[1:-1], str(expected), "--quiet", *(["--transparent"] if kind == "transparent" else [])]) == 0
    if kind == "transparent":
        assert file == expected.read_bytes()
        return
    openexr = pytest.importorskip("OpenEXR")
    one, other = (openexr.File(str(path)).channels() for path in (found, expected))
    assert one.keys() == other.keys()
    assert all(np.array_equal(one[name].pixels, other[name].pixels) for name in one)


def test_a_still_that_this_machine_cannot_write_is_refused_before_it_is_traced(
    client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    client.send(**still(format="exr"))
    assert "expected the package OpenEXR" in client.told("error")["message"]
    assert decoded(received(client, still(seq=2, w=8, h=8))).shape == (8, 8, 3)


def test_a_view_is_answered_while_a_still_is_made(client: Any, scene: Path) -> None:
    client.send(**still(w=2048, h=2048, settings={"samples": 64}))
    assert client.told("export")["done"] == 0.0
    seq = client.view(w=64, h=48)
    while not (isinstance(message := client.next(), Got) and message.seq == seq and message.last):
        if isinstance(message, Got):
            assert message.kind != FILE  # which takes seconds
            client.acknowledge(message)
    expected = srgb(rendered(load_scene(scene), resolution=(64, 48)).radiance)
    assert np.array_equal(message.rgb, expected)
    client.send(type="stop")


def test_all_of_the_work_is_counted(shown: ShownScene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(passes, "BAND_PIXELS", 10_000)
    for asked in (read(still()), read(turntable())):
        done: list[int] = []
        make = export.still if isinstance(asked, Still) else export.turntable
        make(shown, asked, done.append)
        assert sum(done) == pytest.approx(export.work(asked)) and sum(done) > 0


def test_a_large_file_comes_in_pieces(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = received(client, still())
    monkeypatch.setattr(export, "_PIECE", 300)
    client.send(**still(seq=2))
    _, got = pieces(client, 2)
    assert len(got) == -(-len(whole) // 300) > 5
    assert [piece.step for piece in got] == list(range(len(got)))
    assert [piece.first for piece in got] == [300 * i for i in range(len(got))]
    assert all(piece.rows == len(piece.payload) and piece.h == len(whole) for piece in got)
    assert b"".join(piece.payload for piece in got) == whole


# Turntables


def test_a_gif_has_the_frames_in_256_colours_each(client: Any) -> None:
    whole = received(client, turntable())
    assert Pillow.open(io.BytesIO(whole)).info["loop"] == 0
    exact = frames(whole)
    file = received(client, turntable(seq=2, format="gif"))
    opened = Pillow.open(io.BytesIO(file))
    assert opened.format == "GIF" and opened.n_frames == 6 and opened.info["loop"] == 0
    assert opened.info["duration"] == 670  # 4 s a turn, in hundredths
    for one, other in zip(frames(file), exact, strict=True):
        # 256 of the few hundred colours of a frame: neighbouring ones stand for each other.
        assert np.abs(one.astype(int) - other).mean() < 1.0
        assert len(np.unique(one.reshape(-1, 3), axis=0)) <= 256


def test_a_turntable_does_not_hold_all_of_its_frames(shown: ShownScene, monkeypatch: pytest.MonkeyPatch) -> None:
    """As WebP it held them at four bytes a pixel, 200 MB for 72 frames of 934 x 720."""
    make, made, most = export._frames, [], 0

    def watched(*given: Any) -> Iterator[Any]:
        nonlocal most
        for frame in make(*given):
            made.append(weakref.ref(frame))
            most = max(most, sum(ref() is not None for ref in made))
            yield frame

    monkeypatch.setattr(export, "_frames", watched)
    export.turntable(shown, read(turntable(frames=12)), lambda _: None)
    assert len(made) == 12 and most <= 3  # the first, the one before and its successor


@pytest.mark.parametrize("asked", [read(still()), read(turntable()), read(turntable(format="gif"))])
def test_the_file_is_the_same_for_any_number_of_threads(shown: ShownScene, asked: Any) -> None:
    make = export.still if isinstance(asked, Still) else export.turntable
    files = {make(replace(shown, threads=threads), asked, lambda _: None) for threads in (1, 2, 5)}
    assert len(files) == 1


NUMBERS = st.floats(-10, 10)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


@given(eye=VECTORS, pivot=VECTORS, axis=VECTORS.filter(lambda v: math.hypot(*v) > 1e-3), angle=st.floats(-7, 7))
def test_a_turn_is_a_rotation(eye: Any, pivot: Any, axis: Any, angle: float) -> None:
    view = looking(EYE)["m"][:12]
    k = np.array(axis) / math.hypot(*axis)
    m = np.reshape(export.turned([*view, *eye, 1.0], np.array(pivot), k, angle), (4, 4))
    assert m[:, 3].tolist() == [0.0, 0.0, 0.0, 1.0]
    # As a matrix: I + sin K + (1 - cos) K K, with K v = k x v.
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    rotation = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    # Rounding of some ten operations on numbers of up to 40.
    assert np.allclose(m[:3, :3], np.reshape(view, (3, 4))[:, :3] @ rotation.T, rtol=0, atol=1e-13)
    assert np.allclose(m[3, :3], rotation @ (np.array(eye) - pivot) + pivot, rtol=0, atol=1e-13)


def test_no_turn_changes_no_bit() -> None:
    m = [*looking(EYE)["m"][:12], 0.1, 0.7, 1e17, 1.0]
    assert export.turned(m, np.array([0.3, 0.9, -1.0]), np.array([0.0, 1.0, 0.0]), 0.0) == m


def test_a_pivot_at_the_end_of_float64_is_an_error_of_the_file(client: Any) -> None:
    client.send(**turntable(pivot=[1e308, -1e308, 1e308]))
    while (message := client.next())["type"] == "export":
        pass
    assert message["type"] == "error"
    assert decoded(received(client, still(seq=2, w=8, h=8))).shape == (8, 8, 3)


# Their end


@pytest.fixture
def given_up(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Set once the work on a file has ended before its time."""
    ended = threading.Event()

    def watch(name: str) -> None:
        make = getattr(export, name)

        def watched(*given: Any) -> bytes:
            try:
                return make(*given)
            except export.StoppedError:
                ended.set()
                raise

        monkeypatch.setattr(export, name, watched)

    watch("still")
    watch("turntable")
    return ended


def begun(client: Any, asked: dict[str, Any]) -> None:
    """Ask for a file and wait until some of its rays are traced: what has not begun has no work to end."""
    client.send(**asked)
    while not client.told("export")["done"]:
        pass


LONG = [still(w=2048, h=2048, settings={"samples": 64}), turntable(w=512, h=512, frames=120)]


@pytest.mark.parametrize("asked", LONG)
def test_a_stopped_file_ends_its_work_and_another_can_be_asked_for(
    client: Any, given_up: threading.Event, asked: dict[str, Any]
) -> None:
    begun(client, asked)
    client.send(type="stop")
    while (share := client.told("export")["done"]) is not None:
        assert share < 1.0
    assert given_up.wait(30)
    assert decoded(received(client, still(seq=2, w=16, h=9))).shape == (9, 16, 3)


@pytest.mark.parametrize("asked", LONG)
def test_a_page_that_leaves_ends_the_work_on_its_file(
    url: str, given_up: threading.Event, asked: dict[str, Any]
) -> None:
    with Client(url) as leaving:
        begun(leaving, asked)
    assert given_up.wait(30)


def test_nothing_is_stopped_where_nothing_is_made(client: Any) -> None:
    client.send(type="stop")
    assert decoded(received(client, still(w=16, h=9))).shape == (9, 16, 3)


def test_of_several_pages_one_file_is_computed_at_a_time(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make, running, most = export.still, threading.Semaphore(1), []

    def watched(*given: Any) -> bytes:
        most.append(running.acquire(blocking=False))
        try:
            return make(*given)
        finally:
            running.release()

    monkeypatch.setattr(export, "still", watched)
    with ExitStack() as opened:
        clients = [opened.enter_context(Client(url)) for _ in range(4)]
        for client in clients:
            client.send(**still(w=256, h=256))
        files = {b"".join(piece.payload for piece in pieces(client)[1]) for client in clients}
    assert most == [True] * 4 and len(files) == 1


def test_a_file_of_a_scene_is_made_though_another_is_opened(client: Any, scene: Path) -> None:
    scene.with_name("heavy.toml").write_text(HEAVY)
    expected = received(client, still(w=512, h=512))
    client.send(**still(seq=2, w=512, h=512))
    client.send(type="scene", file="heavy.toml")
    got: list[Got] = []
    while not (got and got[-1].last):
        if isinstance(message := client.next(), Got):
            got.append(message)
        else:
            assert message["type"] in ("export", "scene"), message
    assert b"".join(piece.payload for piece in got) == expected
