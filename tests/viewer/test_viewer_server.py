"""The viewer's server at work, seen from outside: pictures, clicks, scenes, and what a client may do to it."""

import io
import json
import math
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import tomllib
import urllib.error
import urllib.request
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from viewer_client import HEAVY, LONG, PATIENCE, PLAIN, SIZE, Client, Got, camera, fetched, looking, rendered, wait_for
from viewer_page import MODELS, SCENE

import renderer
from renderer import load_scene
from renderer.cli.main import main
from renderer.diagnostics.face_phong import face_colors
from renderer.diagnostics.false_color import false_color, limits_of
from renderer.diagnostics.tree_boxes import boxes_at, visited
from renderer.mesh.shapes import icosphere
from renderer.picture.image import srgb
from renderer.trace.spawn import BOUNDED
from renderer.viewer import app, session
from renderer.viewer.passes import Answer
from renderer.viewer.session import SupersededError
from renderer.viewer.shown import ShownScene, open_file
from renderer.viewer.viewpoint import camera_of, camera_toml

pytestmark = pytest.mark.judges(
    "octree-render view", "octree-render view --no-browser", "octree-render view --port", "octree-render view scene",
    "view",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes")
    scenes = {
        "blocks": SCENE,
        "heavy": HEAVY,
        "plain": PLAIN,
        "typo": SCENE.replace("shininess", "shinyness"),
        "lost": SCENE.replace("stairs.ply", "none.ply"),
        "empty": "[camera]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\n[materials]\n",
    }
    for name, text in scenes.items():
        (folder / f"{name}.toml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def scene(folder: Path) -> Path:
    return folder / "blocks.toml"


@pytest.fixture(scope="module")
def heavy(folder: Path) -> Iterator[str]:
    with renderer.view(folder / "heavy.toml", browser=False) as viewing:
        yield viewing.url


@pytest.fixture
def left(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The views whose pictures were given up, in order; those that are finished do not come here."""
    seen: list[int] = []
    answer = session.answer

    def watched(shown: ShownScene, view: Any, *rest: Any) -> Answer:
        try:
            return answer(shown, view, *rest)
        except SupersededError:
            seen.append(view.seq)
            raise

    monkeypatch.setattr(session, "answer", watched)
    return seen


# Pictures


def test_an_octree_view_grows_to_the_renderers_picture(client: Client, folder: Path) -> None:
    scene = load_scene(folder / "blocks.toml")
    passes = client.passes(client.view(w=400, h=300, settings={"samples": 4}))
    assert [(p.kind, p.seq, p.step, p.last, p.w, p.h) for p in passes] == [
        (1, 1, 0, 0, 128, 96),
        (1, 1, 1, 0, 256, 192),
        (1, 1, 2, 1, 400, 300),
    ]
    for got, samples in zip(passes, (1, 1, 4), strict=True):
        expected = rendered(scene, resolution=(got.w, got.h), samples=samples)
        assert np.array_equal(got.rgb, srgb(expected.radiance))
        # The pace is that of tracing alone, which is part of the time.
        assert got.ms > 0.0 and got.rate >= 0.999 * expected.rays.sum() / (1e3 * got.ms)


def test_brute_force_gives_the_same_picture_tile_by_tile(client: Client) -> None:
    octree = client.final()
    first, *bands = client.passes(client.view(mode="brute"))
    assert (first.step, first.last, first.w, first.h) == (0, 0, 128, 96)
    assert len(bands) > 2 and all((p.w, p.h) == (200, 150) for p in bands) and [p.last for p in bands][-2:] == [0, 1]
    assert np.array_equal(np.concatenate([p.rgb for p in bands]), octree.rgb)


def test_the_scale_of_an_aov_is_told_before_it_is_drawn(client: Client, folder: Path) -> None:
    client.view(w=100, h=75, settings={"aov": "depth"})
    image = rendered(load_scene(folder / "blocks.toml"), resolution=(100, 75), max_depth=0, shadows=False)
    low, high = limits_of(image, "depth")
    told, got = client.next(), client.next()
    assert isinstance(told, dict) and len(told.pop("colors")) > 1
    assert told == {"type": "legend", "seq": 1, "step": 0, "w": 100, "h": 75, "aov": "depth", "low": low, "high": high}
    assert isinstance(got, Got) and np.array_equal(got.rgb, false_color(image, "depth"))


def test_a_jpeg_looks_like_the_picture(client: Client) -> None:
    from PIL import Image as Pillow

    exact, got = client.final(), client.final(settings={"pixels": "jpeg"})
    decoded = np.asarray(Pillow.open(io.BytesIO(got.payload)), np.float64)
    # At quality 90 half of all values are within 2 of 255, edges apart, and a wrong row order is off by tens.
    assert got.kind == 2 and len(got.payload) < 200 * 150 and np.abs(decoded - exact.rgb).mean() < 4.0


def test_own_phong_of_glass_and_mirrors_alone_is_lit(tmp_path: Path) -> None:
    text = re.sub(r"reflectance = 0.2|diffuse = .*|specular = .*|shininess = .*", "", SCENE)
    text = text.replace("[materials.red]", '[materials.red]\ntype = "mirror"')
    (tmp_path / "a.toml").write_text(text.replace("[materials.stone]", '[materials.stone]\ntype = "mirror"'))
    shown = open_file(tmp_path / "a.toml")
    assert not shown.prepared.needs.shadows
    colors = face_colors(shown.prepared.arrays, (0.5, 2.6, 5.5))
    assert len(np.unique(colors, axis=0)) > 3  # ambient light alone would give each material one
    view = looking((0.5, 2.6, 5.5))
    seen = shown.prepared.picture(camera_of(view["m"], view["fovy"]), shown.scene.render, BOUNDED, 1)
    expected = rendered(shown.scene, resolution=(320, 240), max_depth=3)
    assert np.array_equal(seen.rays, expected.rays)  # no ray goes to those lights


def test_gl_is_drawn_by_the_page(client: Client) -> None:
    client.view(mode="gl")
    seq = client.view(mode="octree", w=64, h=64)
    got = client.next()
    assert isinstance(got, Got) and got.seq == seq


def test_a_next_picture_waits_until_the_last_is_drawn(client: Client) -> None:
    client.view()
    first = client.next()
    assert isinstance(first, Got) and first.step == 0
    with pytest.raises(TimeoutError):
        client.next(0.3)
    client.send(type="ack", seq=first.seq, step=first.step + 1)  # of another picture
    with pytest.raises(TimeoutError):
        client.next(0.3)
    client.acknowledge(first)
    second = client.next()
    assert isinstance(second, Got) and second.step == 1


# The newest view


def test_a_picture_that_waits_for_its_turn_gives_way_to_a_newer_view(client: Client) -> None:
    client.view(w=400, h=300)
    first = client.next()
    assert isinstance(first, Got)
    time.sleep(0.2)  # the second pass is done by now, or being done
    newer = client.view(w=400, h=300)
    time.sleep(0.1)
    client.acknowledge(first)
    got = client.next()
    assert isinstance(got, Got) and (got.seq, got.step) == (newer, 0)


def test_of_many_views_the_newest_is_shown(client: Client, folder: Path) -> None:
    for i in range(50):
        seq = client.view(eye=(0.5, 2.6, 5.5 + 0.01 * i))
    passes = client.passes(seq)
    # The first may have begun before the others came; of the rest only the newest is worth it.
    assert len({p.seq for p in passes}) <= 10 and [p.seq for p in passes] == sorted(p.seq for p in passes)
    expected = rendered(load_scene(folder / "blocks.toml"), eye=(0.5, 2.6, 5.5 + 0.01 * 49))
    assert np.array_equal(passes[-1].rgb, srgb(expected.radiance))


def test_while_views_keep_coming_first_passes_are_shown(heavy: str) -> None:
    shown = []
    with Client(heavy) as client:
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            client.view(w=512, h=512)  # about every millisecond, of which a first pass takes several
            with suppress(TimeoutError):
                got = client.next(0.001)
                assert isinstance(got, Got)
                shown.append(got.step)
                client.acknowledge(got)
    assert len(shown) >= 3 and set(shown) == {0}


@pytest.mark.parametrize("by", ["a newer view", "cancel", "leaving"])
def test_a_running_brute_force_ends_where_nobody_waits_for_it(heavy: str, left: list[int], by: str) -> None:
    with Client(heavy) as client:
        client.seq = 1000  # no other test's: what those left behind may be given up only now
        seq = client.view(**LONG)
        client.told("progress")
        if by == "a newer view":
            new = client.view(w=64, h=64)
            assert [p.seq for p in client.passes(new)] == [new]
        elif by == "cancel":
            client.send(type="cancel")
        else:
            client.socket.socket.shutdown(socket.SHUT_RDWR)  # without a word of WebSocket's
        wait_for(lambda: [own for own in left if own >= seq] == [seq], PATIENCE)
        if by != "leaving":
            with pytest.raises(TimeoutError):
                while True:  # what was said just before
                    assert client.next(0.3)["type"] == "progress"  # type: ignore[index]
    with Client(heavy) as other:
        assert other.final(w=64, h=64).last


def test_while_brute_force_runs_others_see_their_pictures(heavy: str, left: list[int]) -> None:
    with Client(heavy) as slow, Client(heavy) as quick:
        seq = slow.view(**LONG)
        slow.told("progress")
        quick.seq = 100
        for _ in range(5):
            asked, got = quick.view(w=512, h=512), quick.next()
            while isinstance(got, Got) and got.seq < asked:  # a later pass of the view before, already on its way
                quick.acknowledge(got)
                got = quick.next()
            assert isinstance(got, Got) and got.step == 0
            quick.acknowledge(got)
            quick.send(type="pick", x=0, y=0, **{"seq": 1, **looking((0.5, 2.6, 5.5)), **SIZE})
            quick.told("pick")
        assert seq not in left and slow.told("progress")["seq"] == seq  # it still runs
        slow.send(type="cancel")
        wait_for(lambda: seq in left, PATIENCE)


def test_progress_rises_and_comes_at_most_ten_times_a_second(heavy: str, monkeypatch: pytest.MonkeyPatch) -> None:
    heard = threading.Event()

    def unhurried(shown: ShownScene, view: Any, wanted: Any, finished: Any) -> Answer:
        """Tiles wait until the page has heard of one, however fast the machine is."""

        def finished_and_heard(share: float) -> None:
            finished(share)
            assert share == 0.0 or heard.wait(PATIENCE)

        return answer(shown, view, wanted, finished_and_heard)

    answer = session.answer
    monkeypatch.setattr(session, "answer", unhurried)
    with Client(heavy) as client:
        began, told = time.monotonic(), []
        seq = client.view(**{**LONG, "w": 128, "h": 128})
        while not isinstance(message := client.next(), Got):
            told.append(message)
            if message["done"] > 0.0:
                heard.set()
        lasted = time.monotonic() - began
    assert all(m["type"] == "progress" and m["seq"] == seq for m in told)
    shares = [m["done"] for m in told]
    assert shares == sorted(shares) and 0.0 <= shares[0] <= shares[-1] <= 1.0
    assert 1 <= len(shares) <= 10.0 * lasted + 1.0 and shares[-1] > 0.0


# Bad clients and bad luck


def test_clients_at_once_see_each_their_own(url: str, folder: Path) -> None:
    scene = load_scene(folder / "blocks.toml")
    eyes = [(0.5 + 0.3 * i, 2.6, 5.5) for i in range(4)]

    def seen(eye: tuple[float, float, float]) -> NDArray[np.uint8]:
        with Client(url) as client:
            return client.final(eye=eye).rgb

    with ThreadPoolExecutor(4) as pool:
        pictures = list(pool.map(seen, eyes))
    for eye, picture in zip(eyes, pictures, strict=True):
        assert np.array_equal(picture, srgb(rendered(scene, eye=eye).radiance))


@pytest.mark.parametrize(
    "garbage",
    [
        "nonsense",
        b"\0" * 40,
        json.dumps({"type": "view", "seq": 1, "mode": "octree", "m": [0.0] * 16, "fovy": 0.7, "w": 8, "h": 8}),
        json.dumps({"type": "view", "seq": 1, "mode": "gl", "m": [1e308] * 15 + [1.0], "fovy": 0.7, "w": 8, "h": 8}),
        json.dumps({"type": "pick", "seq": 1, "x": 0, "y": 0, "m": [0.0] * 16, "fovy": 0.7, "w": 8, "h": 8}),
        json.dumps({"type": "camera", "m": [0.0] * 16, "fovy": 0.7}),
        json.dumps({"type": "camera", "m": np.eye(4)[[0, 1, 2, 2]].ravel().tolist(), "fovy": 0.7}),  # no affine map
    ],
)
def test_garbage_is_complained_of_on_one_line_and_harms_nothing(client: Client, garbage: str | bytes) -> None:
    client.socket.send(garbage)
    message = client.told("error")["message"]
    assert message and "\n" not in message and len(message) < 1000
    assert client.final(w=64, h=64).last


@pytest.mark.parametrize("scale", [1e-300, 1e300])
def test_a_camera_at_the_ends_of_float64_harms_nothing(client: Client, scale: float) -> None:
    """Finite, so let in; the rays may be beyond what can be traced, and then that is said."""
    view = looking((0.5, 2.6, 5.5))
    view["m"] = [scale * x if i in (12, 13, 14) else x for i, x in enumerate(view["m"])]
    client.send(**{"type": "view", "seq": 1, "mode": "octree", **view, "w": 64, "h": 64})
    client.send(**{"type": "pick", "seq": 1, "x": 1, "y": 1, **view, "w": 64, "h": 64})
    client.send(type="camera", **view)
    for _ in range(3):
        message = client.next()
        if isinstance(message, Got):
            client.acknowledge(message)
        else:
            assert message["type"] in ("pick", "camera", "error")
    client.seq = 1
    assert client.final(w=64, h=64).last


@pytest.mark.parametrize(
    ("file", "says"),
    [("typo", "shinyness"), ("lost", "none.ply"), ("empty", "at least one face"), ("none", "scene.file")],
)
def test_a_scene_that_fails_to_load_leaves_the_old_one(client: Client, url: str, file: str, says: str) -> None:
    before = client.final()
    client.send(type="scene", file=f"{file}.toml")
    message = client.told("error")["message"]
    assert says in message and (file in message or file == "empty") and "\n" not in message
    assert json.loads(fetched(url, "scene"))["name"] == "blocks.toml"
    assert client.final().payload == before.payload


def test_of_many_scenes_asked_for_the_newest_is_opened(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    open_one = app.open_file

    def counting(path: Path, up: Any) -> ShownScene:
        opened.append(path.name)
        return open_one(path, up)

    monkeypatch.setattr(app, "open_file", counting)
    with renderer.view(folder / "blocks.toml", browser=False) as viewing, Client(viewing.url) as client:
        for _ in range(30):
            client.send(type="scene", file="blocks.toml")
        client.send(type="scene", file="plain.toml")
        name = ""
        while name != "plain.toml":
            told = client.told("scene")
            with suppress(urllib.error.HTTPError):  # the next may have taken its place
                name = json.loads(fetched(viewing.url, f"scene?id={told['id']}"))["name"]
    assert len(opened) < 20 and opened[-1] == "plain.toml"


def test_another_scene_is_shown_to_the_page_that_asked_alone(folder: Path) -> None:
    with renderer.view(folder / "blocks.toml", browser=False) as viewing:
        with Client(viewing.url) as asking, Client(viewing.url) as watching:
            before = watching.final()
            asking.send(type="scene", file="plain.toml")
            told = asking.told("scene")
            expected = rendered(load_scene(folder / "plain.toml"))
            assert np.array_equal(asking.final().rgb, srgb(expected.radiance))
            assert watching.final().payload == before.payload
            assert json.loads(fetched(viewing.url, f"scene?id={told['id']}"))["name"] == "plain.toml"
        assert not np.array_equal(before.rgb, srgb(expected.radiance))
        assert json.loads(fetched(viewing.url, "scene"))["name"] == "blocks.toml"


def test_a_page_is_told_the_scene_that_it_had_and_no_other_server_has_its_id(folder: Path) -> None:
    """After a restart pages kept the boxes, the mesh and the camera of the scene before."""
    seen = []
    for _ in range(2):
        with renderer.view(folder / "blocks.toml", browser=False) as viewing, Client(viewing.url) as client:
            for file, name in (
                ("", "blocks"),
                ("none.toml", "blocks"),
                ("plain.toml", "plain"),
                ("typo.toml", "blocks"),
            ):
                server = json.loads(fetched(viewing.url, "scene"))["server"]
                client.send(type="hello", file=file, server=server)
                if file == "typo.toml":
                    assert "shinyness" in client.told("error")["message"]
                    name = "plain"  # the one before
                scene = json.loads(fetched(viewing.url, f"scene?id={client.told('scene')['id']}"))
                assert scene["name"] == f"{name}.toml"
                seen.append(scene["id"])
            # Pages of a server that ended begin anew.
            client.send(type="hello", file="plain.toml", server="another")
            seen.append(client.told("scene")["id"])
    own, plain = seen[0], seen[2]
    assert seen[:5] == [own, own, plain, plain, own] and len(set(seen)) == 4


@pytest.mark.parametrize("edited", ["scene", "mesh"])
def test_a_file_is_loaded_again_where_it_was_edited(folder: Path, tmp_path: Path, edited: str) -> None:
    (tmp_path / "block.ply").write_bytes((MODELS / "block.ply").read_bytes())
    text = SCENE.replace(str(MODELS / "block.ply"), "block.ply")
    (tmp_path / "a.toml").write_text(text)
    with renderer.view(tmp_path / "a.toml", browser=False) as viewing, Client(viewing.url) as client:
        ids, before = [], client.final()
        for change in (False, True, False):
            if change and edited == "scene":
                (tmp_path / "a.toml").write_text(text.replace("shininess = 40", "shininess = 4"))
            elif change:
                (tmp_path / "block.ply").write_bytes((MODELS / "teapot.ply").read_bytes())
            client.send(type="hello")
            ids.append(client.told("scene")["id"])
        assert client.final().payload != before.payload
        client.send(type="scene", file="a.toml")  # which loads it whatever has changed
        ids.append(client.told("scene")["id"])
    assert ids[1] == ids[2] and len(set(ids)) == 3


@pytest.mark.parametrize("path", ["scene", "mesh", "octree"])
def test_a_scene_that_is_gone_is_not_found(url: str, path: str) -> None:
    with pytest.raises(urllib.error.HTTPError, match="404") as refused:
        fetched(url, f"{path}?id=none")
    assert refused.value.read() == b"id: expected that of a scene that is shown, got 'none'"


def test_own_phong_of_an_orthographic_view_does_not_depend_on_the_distance(heavy: str) -> None:
    near = looking((0.5, 2.6, 5.5))
    m = np.array(near["m"])
    far = near | {"m": [*m[:12], *(m[12:15] + 3.0 * m[8:11]), 1.0]}
    with Client(heavy) as client:  # whose teapot has highlights, which move with the eye
        first, again = (client.final(mode="phong", **view, height=3.0).payload for view in (near, far))
        one, other = (client.final(mode="phong", **view) for view in (near, far))
    assert one.kind == 3 and one.payload != other.payload
    # Directions to a millionth: a code in a million may fall on the other side of where it begins.
    different = np.frombuffer(first, np.uint8) != np.frombuffer(again, np.uint8)
    assert different.mean() < 1e-3


def test_a_saved_camera_is_not_offered_as_a_scene(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text((folder / "blocks.toml").read_text(encoding="utf-8"))
    saved = camera_toml(camera((0.5, 2.6, 5.5)))
    (tmp_path / "camera.toml").write_text(saved)
    (tmp_path / "settings.toml").write_text(f"{saved}[render]\nsamples = 4\n")
    (tmp_path / "broken.toml").write_text("[camera")
    (tmp_path / "folder.toml").mkdir()
    assert open_file(tmp_path / "a.toml").files == ["a.toml", "broken.toml", "folder.toml"]


# Clicks, cameras, and what is fetched


@pytest.mark.parametrize(("x", "y"), [(140, 100), (3, 3)])
def test_a_click_tells_what_the_ray_meets(client: Client, folder: Path, x: int, y: int) -> None:
    shown = open_file(folder / "blocks.toml")
    view = looking((0.5, 2.6, 5.5))
    client.send(**{"type": "pick", "seq": 7, "x": x, "y": y, **view, **SIZE})
    got = client.told("pick")
    image = rendered(shown.scene)
    face = int(image.face[y, x])
    assert got["seq"] == 7 and got["hit"] == (face >= 0) and (got["face"] == face or face < 0)
    assert len(got["path"]) == image.rays[y, x] and got["path"][0]["kind"] == "camera"
    start, end = (np.array(got["path"][0][k]) for k in ("start", "end"))
    opened = visited(shown.prepared.octree, start, end - start)
    assert got["visited"] == len(opened) and [n["level"] for n in got["nodes"]] == [n.level for n in opened]
    if face < 0:
        assert [got[k] for k in ("t", "face", "material", "point", "normal")] == [None] * 5
        return
    # The depth is float64 by another order of operations: a few units in the last place.
    assert got["t"] == pytest.approx(image.depth[y, x], rel=1e-12)
    assert np.allclose(got["point"], end, rtol=0.0, atol=1e-12)
    assert np.allclose(got["normal"], image.normal[y, x], rtol=0.0, atol=1e-6)  # the picture's are float32
    assert got["material"] in shown.scene.materials


@pytest.mark.parametrize("walk", [False, True])
def test_the_target_of_a_saved_camera_is_near_where_the_page_walks(client: Client, walk: bool) -> None:
    client.send(type="camera", walk=walk, **looking((0.3, 2.0, 4.0)))
    answer = client.told("camera")
    saved = tomllib.loads(answer["text"])["camera"]
    distance = math.dist(saved["target"], saved["eye"])
    assert answer["name"] == "camera.toml" and (distance == pytest.approx(1.0) if walk else distance > 2.0)


def test_the_scene_is_described(url: str, folder: Path) -> None:
    told, scene = json.loads(fetched(url, "scene")), load_scene(folder / "blocks.toml")
    shown = open_file(folder / "blocks.toml")
    assert told["files"] == sorted(path.name for path in folder.glob("*.toml"))
    assert told["camera"] == json.loads(scene.camera.model_dump_json())
    assert told["render"] == {"resolution": [320, 240], "samples": 1, "max_depth": 3, "shadows": True}
    assert (told["faces"], told["vertices"]) == (len(shown.prepared.mesh.faces), len(shown.prepared.mesh.vertices))
    assert told["bounds"] == np.asarray(shown.prepared.mesh.bounds).tolist()
    assert {m["name"]: m["type"] for m in told["materials"]} == {
        "red": "phong",
        "glass": "dielectric",
        "stone": "phong",
    }
    stone = next(m for m in told["materials"] if m["name"] == "stone")
    assert stone["diffuse"] == [0.6] * 3 and stone["reflectance"] == [0.2] * 3 and stone["transmittance"] == [0.0] * 3
    assert told["lights"] == [{"type": "directional", "direction": [-0.6, -1.4, -0.8], "color": [0.8] * 3}]
    assert told["octree"]["nodes"] == shown.prepared.octree.stats.nodes
    assert told["modes"] == ["gl", "phong", "brute", "octree", "proof"] and told["threads"] == shown.threads
    assert set(told["needs"]) >= {"reflection", "refraction", "shadows"}


def test_the_mesh_and_the_boxes_are_fetched(url: str, folder: Path) -> None:
    shown = open_file(folder / "blocks.toml")
    mesh, raw = shown.prepared.mesh, fetched(url, "mesh")
    magic, count = struct.unpack("<2I", raw[:8])
    assert magic == 0x4853454D and count == len(mesh.faces)
    assert len(raw) == 8 + 72 * count + 2 * count + count % 2 * 2
    corners = np.frombuffer(raw, "<f4", 9 * count, 8).reshape(-1, 3, 3)
    normals = np.frombuffer(raw, "<f4", 9 * count, 8 + 36 * count).reshape(-1, 3, 3)
    material = np.frombuffer(raw, "<u2", count, 8 + 72 * count)
    assert np.array_equal(corners, mesh.triangles.astype(np.float32))
    assert np.allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-6)  # float32
    sizes = [len(i.mesh.faces) for i in shown.scene.instances]
    names = [name for i, n in zip(shown.scene.instances, sizes, strict=True) for name in [i.material] * n]
    assert [list(shown.scene.materials)[i] for i in material] == names
    for level in (0, 2):
        raw = fetched(url, f"octree?level={level}")
        n, levels = struct.unpack("<2I", raw[:8])
        boxes = np.frombuffer(raw, "<f4", offset=8).reshape(-1, 6)
        assert np.array_equal(boxes, boxes_at(shown.prepared.octree, level)) and n == len(boxes) >= 1 and levels > 2


def resident() -> int:
    """Bytes of memory that this process holds."""
    return int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_clients_that_do_not_read_take_little_memory(tmp_path: Path) -> None:
    """250 that asked for the mesh of a large scene and read nothing held 2 GB."""
    sphere = icosphere(6)
    trimesh.Trimesh(sphere.vertices, sphere.faces).export(tmp_path / "sphere.ply")
    text = SCENE.replace(str(MODELS / "stairs.ply"), str(tmp_path / "sphere.ply"))
    assert "sphere.ply" in text
    (tmp_path / "large.toml").write_text(text)
    with renderer.view(tmp_path / "large.toml", browser=False) as viewing, ExitStack() as opened:
        size = len(fetched(viewing.url, "mesh"))
        before, count = resident(), 40
        host, port = viewing.url.removeprefix("http://").rstrip("/").split(":")
        for _ in range(count):
            client = opened.enter_context(socket.create_connection((host, int(port)), PATIENCE))
            client.sendall(f"GET /mesh HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n".encode())
            assert client.recv(12) == b"HTTP/1.1 200"
        fetched(viewing.url, "scene")
        # A quarter of what the answers hold; a piece and the buffers of its socket are some 0.2 MB.
        assert resident() - before < count * size / 4 and size > 5e6


# How it is started and ends


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_the_command_prints_its_address_and_control_c_ends_it_in_the_middle_of_a_picture(folder: Path) -> None:
    command = [sys.executable, "-m", "renderer.cli.main", "view", str(folder / "heavy.toml"), "--no-browser"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        assert running.stdout is not None
        line = running.stdout.readline()
        found = re.fullmatch(r".*heavy\.toml is shown at (http://127\.0\.0\.1:\d+/) until Ctrl-C\n", line)
        assert found, line
        with Client(found[1]) as client:
            client.view(**LONG)
            client.told("progress")
            sent = time.monotonic()
            running.send_signal(signal.SIGINT)
            _, err = running.communicate(timeout=PATIENCE)
        waited = time.monotonic() - sent
    finally:
        running.kill()
    # A second for connections, a tile's tenth of one, and as much again for machines with other work.
    assert running.returncode == 0 and "Traceback" not in err and waited < 4.0


def test_control_c_ends_the_command_well_once_its_address_stands_there(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One of eleven was taken for a failure: it came while the line was being printed."""

    def interrupted(line: str, flush: bool = False) -> None:
        print(line, flush=flush)
        raise KeyboardInterrupt

    monkeypatch.setattr("renderer.cli.view.say", interrupted)
    assert main(["view", str(folder / "blocks.toml"), "--no-browser"]) == 0
    out, err = capsys.readouterr()
    assert "is shown at" in out and err == ""


def test_a_busy_port_is_one_line(url: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    port = re.search(r":(\d+)/", url)[1]  # type: ignore[index]
    assert main(["view", str(folder / "blocks.toml"), "--port", port, "--no-browser"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.splitlines()[-1].startswith(
        f"octree-render: host and port: expected a free port, got 127.0.0.1:{port}"
    )


@pytest.mark.parametrize("package", ["starlette", "uvicorn"])
def test_without_the_extra_one_line_says_how_to_install_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], package: str
) -> None:
    for name, module in list(sys.modules.items()):
        if name.split(".")[0] == package or name.startswith("renderer.viewer."):
            monkeypatch.delitem(sys.modules, name)
        if name.startswith("renderer.viewer."):
            # Where it is imported again, it takes this one's place in its package too, until the test ends.
            monkeypatch.setattr(renderer.viewer, name.rpartition(".")[2], module)
    monkeypatch.setitem(sys.modules, package, None)
    assert main(["view", str(folder / "blocks.toml")]) == 2
    out, err = capsys.readouterr()
    hint = "in a checkout of octree-renderer: pip install '.[viewer]'; with a wheel: pip install 'FILE.whl[viewer]'"
    line = f"octree-render: the viewer needs the package {package}; {hint}\n"
    assert (out, err) == ("", line)


def test_outside_a_notebook_the_browser_opens(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    viewing = renderer.view(load_scene(folder / "blocks.toml"))
    try:
        assert opened == [viewing.url]
        assert json.loads(fetched(viewing.url, "scene"))["files"] == []  # made in Python: there is no folder to offer
    finally:
        viewing.close()
    with pytest.raises(OSError):
        fetched(viewing.url, "scene")


def test_in_a_notebook_the_page_is_framed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ipython = ModuleType("IPython")
    ipython.get_ipython = lambda: SimpleNamespace(kernel=object())  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setattr("webbrowser.open", lambda url: pytest.fail(f"a browser was opened for {url}"))
    with renderer.view(folder / "blocks.toml") as viewing:
        shown = viewing._repr_html_()
        assert f'<iframe src="{viewing.url}"' in shown and f'<a href="{viewing.url}"' in shown
        with urllib.request.urlopen(viewing.url, timeout=PATIENCE) as page:
            assert "http://localhost:*" in page.headers["Content-Security-Policy"]


def test_what_is_no_scene_is_refused() -> None:
    with pytest.raises(ValueError, match="scene: expected a Scene or a path, got int"):
        renderer.view(3)  # type: ignore[arg-type]


@pytest.mark.skipif(os.name != "posix", reason="names of files are bytes on Linux alone")
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_pipe_beside_the_scene_is_no_scene(folder: Path, tmp_path: Path) -> None:
    """Opening it waited for a writer, and no page could open another scene from then on."""
    (tmp_path / "a.toml").write_text((folder / "blocks.toml").read_text(encoding="utf-8"))
    os.mkfifo(tmp_path / "pipe.toml")
    shown = open_file(tmp_path / "a.toml")
    assert shown.files == ["a.toml"]
    with pytest.raises(ValueError, match=r"scene.file: expected one of \['a.toml'\]"):
        shown.beside("pipe.toml")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize("pipe", ["a.toml", "pipe.ply"])
def test_a_scene_of_a_pipe_is_refused(tmp_path: Path, pipe: str) -> None:
    """Reading it waited for a writer, and no page was told its scene from then on."""
    (tmp_path / "a.toml").write_text(SCENE.replace(str(MODELS / "block.ply"), "pipe.ply"))
    (tmp_path / pipe).unlink(missing_ok=True)
    os.mkfifo(tmp_path / pipe)
    with pytest.raises(ValueError, match=f"{pipe}: expected a file, got a pipe"):
        open_file(tmp_path / "a.toml")


@pytest.mark.skipif(not Path("/dev/zero").is_char_device(), reason="this system has no such device")
def test_a_device_beside_the_scene_is_no_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was read to its end, and has none."""
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    (tmp_path / "null.toml").symlink_to("/dev/null")
    (tmp_path / "a.toml").write_text(PLAIN)
    shown = open_file(tmp_path / "a.toml")
    for name in ("open", "read_text", "read_bytes"):
        kept = getattr(Path, name)

        def safely(path: Path, *rest: Any, kept: Any = kept, **options: Any) -> Any:
            assert path.is_file(), f"{path} is read"
            return kept(path, *rest, **options)

        monkeypatch.setattr(Path, name, safely)
    assert shown.files == ["a.toml"]


def test_names_that_are_no_text_are_left_out(folder: Path, tmp_path: Path) -> None:
    """The list of files could not be sent, so the page had no scene."""
    try:
        (tmp_path / os.fsdecode(b"caf\xe9.toml")).write_text(PLAIN)
    except OSError:
        pytest.skip("this file system takes text alone")
    (tmp_path / "a.toml").write_text(PLAIN)
    assert open_file(tmp_path / "a.toml").files == ["a.toml"]
    assert open_file(tmp_path / os.fsdecode(b"caf\xe9.toml")).name == "caf?.toml"
