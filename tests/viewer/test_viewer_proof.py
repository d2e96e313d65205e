"""The proof: two ways of computing one view, how many pixels are the same to the bit, and where they differ."""

import io
import os
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Pillow
from viewer_client import PATIENCE, Client, Got, looking, rendered, wait_for

import renderer
from renderer import load_scene
from renderer.picture.image import srgb
from renderer.viewer import compare, session
from renderer.viewer.compare import Comparison, Way, heat_map

WAYS = (Way("one", 1), Way("other", 1))
# What a package that offers a reference brings: the background is one unit in the last place off, and one pixel black.
REFERENCE = """
import numpy as np
from renderer.picture.render import render

def picture(scene, width, height, *, max_depth, progress):
    print("what a renderer says on its way")
    seen = render(scene, resolution=(width, height), max_depth=max_depth).radiance.astype(np.float64)
    progress(1, 2)
    seen[0, 0] = np.nextafter(seen[0, 0].astype(np.float32), np.float32(9))
    seen[height // 2, width // 3] = 0.0
    progress(2, 2)
    return seen

def failing(*scene, **options):
    raise RuntimeError("no licence,\\nno picture")

def ending(*scene, **options):
    import os
    os._exit(3)

def turned(scene, width, height, **options):
    return np.zeros((width, height, 3))

def imaginary(scene, width, height, **options):
    return np.full((height, width, 3), 1j)

def nan(scene, width, height, **options):
    return np.full((height, width, 3), np.nan)

def infinite(scene, width, height, **options):
    return np.full((height, width, 3), 1e39)

def silent(*scene, **options):
    import os, time
    open(os.environ["SILENT"], "w").write(str(os.getpid()))
    time.sleep(600)
"""
OFFERED = ("picture", "failing", "ending", "turned", "imaginary", "nan", "infinite", "silent")


@pytest.fixture
def references(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Packages that offer references, as pip leaves them."""
    (tmp_path / "elsewhere.py").write_text(REFERENCE)
    info = tmp_path / "elsewhere-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: elsewhere\nVersion: 1.0\n")
    lines = [f"{name} = elsewhere:{name}" for name in OFFERED]
    (info / "entry_points.txt").write_text("\n".join(["[octree_render.references]", *lines]))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]).strip(":"))


def parts(got: Got) -> list[NDArray[np.uint8]]:
    """The three pictures of a proof's message."""
    found, payload = [], got.payload
    assert got.kind == 4
    while payload:
        (size,) = struct.unpack("<I", payload[:4])
        found.append(np.asarray(Pillow.open(io.BytesIO(payload[4 : 4 + size]))))
        payload = payload[4 + size :]
    return found


def proof(client: Client, **changes: Any) -> tuple[list[dict[str, Any]], list[Got]]:
    """What is told of a proof, pass by pass, and its messages."""
    seq, told, got = client.view(mode="proof", **changes), [], []
    while not (got and got[-1].last):
        message = client.next()
        if isinstance(message, Got):
            got.append(message)
            client.acknowledge(message)
        elif message["type"] != "progress":
            told.append(message)
            if message["type"] == "error":
                break
    assert all(p.seq == seq for p in got)
    return told, got


def test_octree_and_brute_force_are_the_same_to_the_bit(client: Client, scene: Path) -> None:
    told, got = proof(client, settings={"pair": "brute"})
    assert [(p.w, p.h, p.last) for p in got] == [(128, 96, 0), (200, 150, 1)]
    expected = srgb(rendered(load_scene(scene)).radiance)
    one, other, heat = parts(got[-1])
    assert np.array_equal(one, expected) and np.array_equal(other, expected) and (heat == heat[0, 0]).all()
    last = told[-1]
    assert last["type"] == "proof" and last["names"] == ["octree", "brute force"]
    assert last["pixels"] == last["identical"] == 200 * 150 and last["largest"] == last["mean"] == 0.0


def test_a_wrong_brute_force_is_seen(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The proof would be worth nothing if it compared one picture with itself."""
    from renderer.viewer.shown import open_file

    shown = open_file(scene)
    faces = shown.brute.tree.blocks.copy()
    with renderer.view(scene, browser=False) as viewing, Client(viewing.url) as client:
        told, _ = proof(client, settings={"pair": "brute", "shadows": False})
        assert told[-1]["identical"] == told[-1]["pixels"]
        computed = compare._computed

        def wrong(shown: Any, view: Any, way: Way, *rest: Any) -> Any:
            radiance, rays = computed(shown, view, way, *rest)
            radiance[7, 11, 2] += (way.by == "brute") * 2.0**-20
            return radiance, rays

        monkeypatch.setattr(compare, "_computed", wrong)
        told, _ = proof(client, settings={"pair": "brute", "shadows": False})
    assert told[-1]["identical"] == told[-1]["pixels"] - 1 and told[-1]["at"] == [11, 7]
    assert told[-1]["largest"] == pytest.approx(2.0**-20, rel=0.2) and faces.size


def test_another_renderer_is_asked_in_its_own_process(references: None, scene: Path) -> None:
    with renderer.view(scene, browser=False) as viewing, Client(viewing.url) as client:
        told, got = proof(
            client, w=400, h=300, settings={"pair": "picture", "shadows": False, "light": [1.0, -1.0, 0.5]}
        )
    assert (got[-1].w, got[-1].h) == (256, 192)  # as it may be slow
    last = told[-1]
    assert last["names"] == ["octree", "picture"] and last["identical"] == last["pixels"] - 2
    assert last["at"] == [256 // 3, 96]


@pytest.mark.parametrize(
    ("pair", "settings", "says"),
    [
        ("failing", {}, "reference: expected a picture by failing, got RuntimeError: no licence, no picture"),
        ("ending", {}, "reference: expected a picture by ending, got its process ended"),
        ("turned", {}, "reference: expected a picture of shape (48, 64, 3) by turned, got (64, 48, 3)"),
        ("imaginary", {}, "reference: expected a picture by imaginary, got TypeError: Cannot cast"),
        ("nan", {}, "reference: expected finite radiance by nan, got nan in 9216 values"),
        ("infinite", {}, "reference: expected finite radiance by infinite, got inf in 9216 values"),
        ("none", {}, "reference: expected one of"),
        ("picture", {"refraction": False}, "comparison: expected refraction as the materials have it"),
    ],
)
def test_a_reference_that_gives_no_picture_says_why(
    references: None, scene: Path, pair: str, settings: dict[str, Any], says: str
) -> None:
    with renderer.view(scene, browser=False) as viewing, Client(viewing.url) as client:
        told, got = proof(client, w=64, h=48, settings={"pair": pair, **settings})
        assert not got and told[0]["type"] == "error" and told[0]["message"].startswith(says)
        assert client.final(w=64, h=48).last  # and the viewer goes on


def has_ended(process: int) -> bool:
    """Whether it is no more, or waits for its parent to notice."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


@pytest.fixture
def silent(references: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """The number of the process of the reference that says nothing, once it computes."""
    monkeypatch.setenv("SILENT", str(tmp_path / "silent"))

    def begun() -> int:
        wait_for(lambda: (tmp_path / "silent").exists() and (tmp_path / "silent").read_text(), PATIENCE)
        return int((tmp_path / "silent").read_text())

    return begun


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes as Linux tells of them")
@pytest.mark.parametrize("left", ["view", "page", "server"])
def test_a_reference_that_says_nothing_ends_with_what_it_is_for(
    silent: Callable[[], int], scene: Path, left: str
) -> None:
    """Its process went on, no other proof was computed, and Ctrl-C did not end the server."""
    with renderer.view(scene, browser=False) as viewing, Client(viewing.url) as client:
        client.view(mode="proof", w=64, h=48, settings={"pair": "silent"})
        process = silent()
        assert not has_ended(process)
        if left == "view":
            assert proof(client, w=64, h=48)[1][-1].last
        elif left == "page":
            client.socket.close()
        else:
            viewing.close()
        wait_for(lambda: has_ended(process), PATIENCE)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes as Linux tells of them")
def test_a_reference_ends_with_a_server_that_is_killed(silent: Callable[[], int], scene: Path) -> None:
    text = "import sys; from renderer import load_scene; from renderer.viewer.references import reference_picture; "
    text += "reference_picture('silent', load_scene(sys.argv[1]), (8, 8), 1, lambda share: None)"
    environment = {**os.environ, "PYTHONPATH": f"{Path(__file__).parents[2]}:{os.environ['PYTHONPATH']}"}
    server = subprocess.Popen([sys.executable, "-c", text, str(scene)], env=environment)
    try:
        process = silent()
        assert not has_ended(process)
    finally:
        server.kill()
        server.wait()
    wait_for(lambda: has_ended(process), PATIENCE)


def test_what_cannot_be_told_keeps_no_later_picture_waiting(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its acknowledgement was waited for, and no view was answered from then on."""
    monkeypatch.setattr(Comparison, "described", lambda comparison: {"largest": float("nan")})
    told, got = proof(client, w=64, h=48, settings={"pair": "brute"})
    assert not got and "JSON" in told[-1]["message"]
    assert client.final(w=64, h=48).last


def test_mitsubas_recursion_is_offered_by_the_project() -> None:
    """As pip registers it: an entry point that names a function which is there."""
    import tomllib
    from importlib.metadata import EntryPoint

    pytest.importorskip("mitsuba", reason="the extra validate is not installed")
    root = Path(__file__).parents[2]
    offered = tomllib.loads((root / "pyproject.toml").read_text())["project"]["entry-points"][
        "octree_render.references"
    ]
    found = EntryPoint("Mitsuba", offered["Mitsuba"], "octree_render.references").load()
    scene = renderer.Scene(camera={"eye": (0, 0, 4), "target": (0, 0, 0)}, materials={}, background=(0.25, 0.5, 0.75))
    assert found(scene, 2, 1, max_depth=1, progress=lambda done, of: None).tolist() == [[[0.25, 0.5, 0.75]] * 2]


def test_a_click_tells_both_values_and_both_rays(client: Client) -> None:
    size = {"w": 100, "h": 75}
    pick = {"type": "pick", "x": 60, "y": 45, **looking((0.5, 2.6, 5.5)), **size}
    client.send(**pick, seq=1)
    assert "proof" not in client.told("pick")
    for pair, rays in (("brute", True), ("samples", None)):
        told, got = proof(client, settings={"pair": pair}, **size)
        client.send(**pick, seq=2, proof=got[-1].seq)
        seen = client.told("pick")["proof"]
        assert seen["at"] == [60, 45] and seen["of"] == [100, 75] and seen["same_rays"] is rays
        assert [value["name"] for value in seen["values"]] == told[-1]["names"]
        for value, picture in zip(seen["values"], parts(got[-1]), strict=False):
            assert np.array_equal(srgb(np.array(value["radiance"])), picture[45, 60]) and value["rays"] > 0
    client.send(**pick, seq=3, proof=got[-1].seq - 1)  # of a view that is gone
    assert "proof" not in client.told("pick")


def test_a_newer_view_ends_a_proof_under_way(client: Client) -> None:
    client.view(mode="proof", w=900, h=900, settings={"pair": "samples"})
    while client.next()["type"] != "progress":  # type: ignore[index]
        pass
    new = client.view(w=64, h=64)
    assert [got.seq for got in client.passes(new)] == [new]


def test_progress_of_a_proof_rises_to_one(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "_PROGRESS", 0.01)
    client.view(mode="proof", w=128, h=96, settings={"pair": "samples"})
    done, got = [], None
    while not (got and got.last):
        message = client.next()
        if isinstance(message, Got):
            client.acknowledge(got := message)
        elif message["type"] == "progress":
            done.append(message["done"])
    assert len(done) > 3 and done == sorted(done) and 0.0 <= done[0] < 0.5 < done[-1] <= 1.0


# Comparisons by themselves


def comparison(*changes: tuple[tuple[int, int, int], float]) -> Comparison:
    one = np.full((3, 4, 3), 0.5, np.float32)
    other = one.copy()
    for at, value in changes:
        other[at] = value
    return Comparison(WAYS, (one, other), (None, None), (0.0, 0.0))


def test_pixels_differ_by_their_bits() -> None:
    same = comparison()
    assert same.identical.all() and same.described()["largest"] == 0.0
    apart = comparison(((1, 2, 0), np.nextafter(np.float32(0.5), np.float32(1))), ((2, 3, 1), 0.25))
    assert apart.identical.sum() == 10 and apart.described()["identical"] == 10
    told = apart.described()
    assert told["at"] == [3, 2] and told["largest"] == 0.25 and told["pixels"] == 12
    assert told["mean"] == pytest.approx((2.0**-24 + 0.25) / 12)  # of the largest of each pixel's three
    zero, minus = np.zeros((1, 1, 3), np.float32), np.zeros((1, 1, 3), np.float32)
    minus[0, 0, 0] = -0.0
    assert not Comparison(WAYS, (zero, minus), (None, None), (0.0, 0.0)).identical.any()


def test_the_heat_map_shows_a_unit_in_the_last_place_beside_a_missing_light() -> None:
    ulp = float(np.nextafter(np.float32(0.5), np.float32(1))) - 0.5
    colors, limits = heat_map(comparison(((0, 0, 0), 0.5 + ulp), ((1, 1, 1), 0.75), ((2, 2, 2), 0.5 + 64 * ulp)))
    assert limits == (ulp, 0.25)
    assert colors[0, 0].tolist() == [68, 1, 84] and colors[1, 1].tolist() == [253, 231, 37]  # the ends of viridis
    grey = (colors == colors[2, 3]).all(axis=2)
    assert grey.sum() == 9 and len(np.unique(colors.reshape(-1, 3), axis=0)) == 4
    assert heat_map(comparison())[1] == (0.0, 0.0)
