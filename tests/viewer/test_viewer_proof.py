"""The proof: two ways of computing one view, how many pixels are the same to the bit, and where they differ."""

import io
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from viewer_page import CHROMIUM, SCENE, Viewer

pytest.importorskip("uvicorn", reason="the extra viewer is not installed")

from PIL import Image as Pillow
from viewer_client import Client, Got, looking, rendered

import renderer
from renderer import load_scene
from renderer.picture.image import srgb
from renderer.viewer import compare
from renderer.viewer.compare import Comparison, Way, heat_map

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium")
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
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("proof") / "blocks.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def url(scene: Path) -> Iterator[str]:
    with renderer.view(scene, browser=False) as viewing:
        yield viewing.url


@pytest.fixture
def client(url: str) -> Iterator[Client]:
    with Client(url) as client:
        yield client


@pytest.fixture
def references(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Packages that offer references, as pip leaves them."""
    (tmp_path / "elsewhere.py").write_text(REFERENCE)
    info = tmp_path / "elsewhere-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: elsewhere\nVersion: 1.0\n")
    lines = [f"{name} = elsewhere:{name}" for name in ("picture", "failing", "ending")]
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
    told, got = proof(client)
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
        told, _ = proof(client, settings={"shadows": False})
        assert told[-1]["identical"] == told[-1]["pixels"]
        computed = compare._computed

        def wrong(shown: Any, view: Any, way: Way, *rest: Any) -> Any:
            radiance, rays = computed(shown, view, way, *rest)
            radiance[7, 11, 2] += (way.by == "brute") * 2.0**-20
            return radiance, rays

        monkeypatch.setattr(compare, "_computed", wrong)
        told, _ = proof(client, settings={"shadows": False})
    assert told[-1]["identical"] == told[-1]["pixels"] - 1 and told[-1]["at"] == [11, 7]
    assert told[-1]["largest"] == pytest.approx(2.0**-20, rel=0.2) and faces.size


def test_few_samples_and_many_differ_at_edges(client: Client, scene: Path) -> None:
    told, got = proof(client, settings={"pair": "samples", "samples": 9})
    one, other, _ = parts(got[-1])
    for picture, samples in ((one, 4), (other, 64)):
        assert np.array_equal(picture, srgb(rendered(load_scene(scene), samples=samples).radiance))
    few, many = (rendered(load_scene(scene), samples=n).radiance for n in (4, 64))
    apart = np.abs(few.astype(float) - many)
    assert told[-1]["identical"] == int((few == many).all(axis=2).sum()) < told[-1]["pixels"]
    assert told[-1]["largest"] == apart.max() and told[-1]["mean"] == pytest.approx(apart.max(axis=2).mean())


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
    pick = {"type": "pick", "x": 120, "y": 90, **looking((0.5, 2.6, 5.5)), "w": 200, "h": 150}
    client.send(**pick, seq=1)
    assert "proof" not in client.told("pick")
    for pair, rays in (("brute", True), ("samples", None)):
        told, got = proof(client, settings={"pair": pair})
        client.send(**pick, seq=2, proof=got[-1].seq)
        seen = client.told("pick")["proof"]
        assert seen["at"] == [120, 90] and seen["of"] == [200, 150] and seen["same_rays"] is rays
        assert [value["name"] for value in seen["values"]] == told[-1]["names"]
        for value, picture in zip(seen["values"], parts(got[-1]), strict=False):
            assert np.array_equal(srgb(np.array(value["radiance"])), picture[90, 120]) and value["rays"] > 0
    client.send(**pick, seq=3, proof=got[-1].seq - 1)  # of a view that is gone
    assert "proof" not in client.told("pick")


def test_a_newer_view_ends_a_proof_under_way(client: Client) -> None:
    client.view(mode="proof", w=900, h=900, settings={"pair": "samples"})
    while client.next()["type"] != "progress":  # type: ignore[index]
        pass
    new = client.view(w=64, h=64)
    assert [got.seq for got in client.passes(new)] == [new]


def test_progress_of_a_proof_rises_to_one(client: Client) -> None:
    client.view(mode="proof", w=500, h=400, settings={"pair": "samples"})
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


# On the page


@pytest.fixture(scope="module")
def page(browser: Any, url: str) -> Iterator[Viewer]:
    page = Viewer(browser, url, viewport={"width": 900, "height": 560}).open()
    yield page
    page.context.close()


def kept(page: Viewer) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    page.settled("proof")
    return page.pixels("picture"), page.page.evaluate("() => viewer.proof.told")


@needs_browser
def test_the_page_shows_both_pictures_and_the_difference(page: Viewer) -> None:
    page.choose("proof")
    page.page.select_option("[name=pair]", "samples")
    page.settled("proof")
    shown = {}
    for split in (0, 0.5, 1):
        page.page.evaluate("(split) => viewer.proof.move(split)", split)
        shown[split] = page.pixels("picture")
    width = shown[0].shape[1]
    half = round(width / 2)
    assert np.array_equal(shown[0.5][:, :half], shown[1][:, :half])
    assert np.array_equal(shown[0.5][:, half:], shown[0][:, half:])
    assert not np.array_equal(shown[0], shown[1])
    page.page.locator("#stage").press("x")
    heat, told = kept(page)
    differ = (shown[0] != shown[1]).any(axis=2)
    dark = (heat[..., :3] == 18).all(axis=2)
    assert not (dark & differ).any()  # where codes differ, so do values
    assert dark.sum() == told["identical"]
    text = page.page.inner_text("#proof output")
    assert f"{told['identical']:,} of {told['pixels']:,} pixels are identical" in text
    assert page.page.is_visible("#legend") and page.page.is_hidden("#divider")
    page.page.locator("#stage").press("x")
    page.page.select_option("[name=pair]", "brute")
    _, told = kept(page)
    assert told["identical"] == told["pixels"]
    assert f"All {told['pixels']:,} pixels are identical to the bit" in page.page.inner_text("#proof output")
    page.choose("octree")
    assert page.page.is_hidden("#proof") and page.page.is_hidden("#divider") and page.page.is_hidden("#legend")


@needs_browser
def test_the_divider_moves_by_pointer_and_by_key_and_the_camera_does_not(page: Viewer) -> None:
    page.choose("proof")
    before = page.camera["m"]
    page.page.evaluate("() => viewer.proof.move(0.6)")
    box = page.page.locator("#divider").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x - 100, y + 5, steps=4)
    page.page.mouse.up()
    frame = page.page.locator("#frame").bounding_box()
    expected = (x - 100 - frame["x"]) / frame["width"]
    assert page.page.evaluate("() => viewer.proof.split") == pytest.approx(expected, abs=1e-9)
    page.page.locator("#divider").press("ArrowRight")
    assert page.page.evaluate("() => viewer.proof.split") == pytest.approx(expected + 0.02, abs=1e-9)
    assert page.camera["m"] == before and page.page.is_hidden("#card")
    page.choose("octree")


@needs_browser
def test_a_clicked_pixel_of_the_proof_shows_both_values(page: Viewer) -> None:
    page.choose("proof")
    x, y = page.centre()
    page.page.mouse.click(x + 60, y + 20)
    page.page.wait_for_selector("#card:not([hidden]) .values")
    rows = page.page.locator("#card .values tr").all_inner_texts()
    assert len(rows) == 3 and rows[0].split()[1:] == rows[1].split()[2:]  # "octree", "brute force"
    assert "Identical to the bit, the same" in page.page.inner_text("#card")
    page.page.locator("#stage").press("Escape")
    page.choose("octree")


@needs_browser
def test_nothing_of_a_proof_stands_for_another_view(page: Viewer) -> None:
    """A verdict belongs to one camera, one pair and one scene."""
    page.choose("proof")
    assert page.page.inner_text("#proof output")
    page.page.evaluate("() => { viewer.camera.orbit(0.3, 0); viewer.moved(); }")
    assert page.page.inner_text("#proof output") == ""
    kept(page)
    assert page.page.inner_text("#proof output")
    page.page.evaluate("() => viewer.reset()")
    kept(page)
    page.choose("octree")


# All of the scene's colours, which a click on the panel would change one by one.
EDIT = """(green) => {
    const { edits } = viewer.panel;
    for (const fields of Object.values(edits.now.materials)) if (fields.diffuse) fields.diffuse = [0, green, 0];
    edits.changed();
}"""

# The click that is asked for again when another pair is chosen.
OTHER_PAIR = """() => {
    const { connection, proof: { pair } } = viewer, choose = (value) => {
        pair.value = value;
        pair.dispatchEvent(new Event("change", { bubbles: true }));
    };
    let asked = {};
    connection.send = (message) => (asked = message);
    choose("samples");
    delete connection.send;
    choose("brute");
    return asked;
}"""


@needs_browser
def test_the_values_on_the_card_are_those_of_the_proof_that_stands(page: Viewer) -> None:
    """After an edit they stayed those of the scene before, for ever."""
    page.page.select_option("[name=size]", "0.25")
    page.choose("proof")
    x, y = page.centre()
    page.page.mouse.click(x + 60, y + 20)
    page.page.wait_for_selector("#card .values")
    before = page.page.locator("#card .values tr").all_inner_texts()
    try:
        page.page.evaluate(EDIT, 0.25)
        page.settled("proof")
        page.page.wait_for_function("() => viewer.rays.pick.seq === viewer.rays.seq")
        assert page.page.locator("#card .values tr").count() == 3
        assert page.page.locator("#card .values tr").all_inner_texts() != before
        asked = page.page.evaluate(OTHER_PAIR)
        assert asked["type"] == "pick" and "proof" not in asked  # which is of the pair before
    finally:
        page.restart()


@needs_browser
def test_neither_verdict_nor_picture_of_a_proof_stands_for_an_edited_scene(page: Viewer) -> None:
    """Cancelled, the edit stood under the picture and the verdict of the scene before."""
    page.page.select_option("[name=size]", "0.25")
    page.choose("proof")
    page.page.wait_for_function("() => viewer.layer.loaded")
    try:
        seen = """() => [document.querySelector("#proof output").value,
            viewer.picture.canvas.classList.contains("away"), document.querySelector("#legend").hidden]"""
        assert page.page.evaluate(seen)[1:] == [False, False]
        # Nothing of the next one comes before it is cancelled.
        page.page.evaluate("() => { viewer.connection.send = () => {}; }")
        page.page.evaluate(EDIT, 0.5)
        page.page.wait_for_function("() => !viewer.dirty")
        assert page.page.evaluate(seen) == ["", False, False]  # the picture stands until the next one comes
        page.page.evaluate("() => viewer.cancel()")
        page.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert page.page.evaluate(seen) == ["", True, True]
    finally:
        page.page.evaluate("() => { delete viewer.connection.send; }")
        page.restart()
