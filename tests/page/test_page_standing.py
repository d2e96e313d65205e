"""Which picture stands on the stage of the viewer's page, and which is saved: none older or coarser than one before."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow
from viewer_page import MODELS, Viewer, served

# What the page sends of a kind waits. The server sends a next picture once the last is acknowledged: so long as "ack"
# waits, it stays at that pass.
HOLD = """(kind) => {
    const { connection } = window.viewer, send = connection.send;
    window.held = [];
    connection.send = (message) => message.type === kind ? window.held.push(message) : send.call(connection, message);
}"""
GO_ON = """() => {
    const { connection } = window.viewer;
    delete connection.send;
    window.held.forEach((message) => connection.send(message));
}"""
# Notes after each drawing whether the traced picture is seen, and how wide it is; null where WebGL's model is.
WATCH = """() => {
    const { viewer } = window, { draw } = viewer.frames;
    window.drawn = [];
    viewer.frames.draw = () => {
        draw.call(viewer.frames);
        window.drawn.push(viewer.picture.canvas.classList.contains("away") ? null : viewer.picture.canvas.width);
    };
}"""
WATCHED = "() => { delete window.viewer.frames.draw; return window.drawn; }"
# Longer than a picture of another camera may stand.
STALE = 600


@pytest.fixture
def odd(browser: Any, url: str) -> Any:
    """A page whose stage has no shape that smaller pictures share to the pixel."""
    with Viewer(browser, url, viewport={"width": 823, "height": 467}).open() as page:
        yield page


def test_the_first_traced_picture_stands_until_a_finer_one_comes(odd: Viewer) -> None:
    """Its sides are whole pixels, so its shape is not quite the stage's; it was dropped for that, for seconds."""
    width, height = (odd.camera[k] for k in ("w", "h"))
    assert 128 * height != round(128 * height / width) * width
    odd.page.evaluate(HOLD, "ack")
    odd.page.evaluate("() => { viewer.camera.orbit(0.4, 0); viewer.moved(); }")
    odd.page.wait_for_function("() => window.held.some(({ seq, step }) => seq === viewer.traced.seq && step === 0)")
    odd.page.evaluate(WATCH)
    odd.page.wait_for_timeout(STALE)
    odd.page.evaluate("() => viewer.frames.draw()")
    odd.page.evaluate(GO_ON)
    odd.settled("octree")
    drawn = odd.page.evaluate(WATCHED)
    assert drawn[0] == 128 and drawn[-1] == width and None not in drawn and drawn == sorted(drawn)


def test_brute_force_begins_with_the_octrees_picture(odd: Viewer) -> None:
    """It is the same one, and a label says which; WebGL's model stood there for the seconds that brute force took."""
    odd.page.evaluate(WATCH)
    odd.page.evaluate(HOLD, "view")
    odd.page.evaluate("() => viewer.setMode('brute')")
    odd.page.wait_for_selector("#until:not([hidden])")
    odd.page.evaluate(GO_ON)
    odd.settled("brute")
    assert odd.page.is_hidden("#until") and set(odd.page.evaluate(WATCHED)) == {odd.camera["w"]}


def test_of_two_pictures_the_newer_and_finer_one_stands(viewer: Viewer) -> None:
    seen = viewer.page.evaluate(
        """async () => {
            const { improves } = await import("./static/standing.js");
            const m = [...Array(16).keys()], settings = { samples: 1, shadows: true };
            const now = { m, fovy: 1, w: 980, h: 747 };
            const view = { ...now, settings }, other = { ...view, m: [...m].reverse() };
            const [few, final] = [{ w: 128, last: false }, { w: 980, last: true }];
            const band = { w: 980, h: 747, rows: 32, last: false };
            const shown = (picture, of = view) => ({ view: of, ...picture });
            const asked = [
                [few, view, null], [few, view, shown(final, other)], [final, view, shown(few)],
                [final, view, shown({ ...final, w: 1024 })], [{ w: 256 }, view, shown(few)],
                [few, view, shown(final, { ...view, settings: { ...settings, shadows: false } })],
                [few, { ...view, w: 490, h: 374 }, shown(final)],
                [few, view, shown(final)], [few, other, shown(few)],
                [few, view, shown(final, { ...view, settings: { ...settings, samples: 9 } })],
                [few, other, shown(few, { ...other, fovy: 1.1 })], [few, other, null],
                [band, view, shown(few)],
                [band, view, shown(final, { ...view, settings: { ...settings, samples: 9 } })],
                [band, other, shown(few)], [band, view, null],
            ];
            const whether = ([picture, of, stands], model) => improves(picture, of, { shown: stands, now, model });
            return [asked.map((one) => whether(one, false)), whether(asked[0], true), whether(asked[10], true)];
        }"""
    )
    # A band takes the place of a part of a picture by the same camera. Of another camera's pictures a newer one stands
    # for an older, but neither for the camera's own nor for the model.
    assert seen == [[True] * 6 + [False] * 4 + [True] * 4 + [False] * 2, True, False]


def test_a_cancelled_view_leaves_only_a_picture_that_is_true_of_it(viewer: Viewer) -> None:
    """In brute force stood the nodes that the octree visited, with their scale."""
    true = viewer.page.evaluate(
        """async () => {
            const { isOf, improves } = await import("./static/standing.js");
            const of = { m: [...Array(16).keys()], fovy: 1, w: 9, h: 7 };
            const view = (mode, aov, others) =>
                ({ ...of, mode, settings: { aov, pair: "brute", samples: 1, ...others } });
            const pairs = [
                [view("octree", "color"), view("brute", "color", { samples: 4 })],
                [view("octree", "depth"), view("brute", "depth")],
                [view("octree", "color"), view("proof", "color")], [view("octree", "nodes"), view("octree", "nodes")],
                [view("octree", "nodes"), view("brute", "nodes")],
                [view("octree", "triangles"), view("brute", "triangles")],
                [view("proof", "color"), view("brute", "color")], [view("octree", "depth"), view("proof", "depth")],
                [view("proof", "color"), view("proof", "color", { pair: "samples" })],
                [view("brute", "color"), view("brute", "color", { edits: { lights: [] } })],
            ];
            const few = { w: 2, last: false }, replaced = ([from, to]) =>
                improves(few, to, { shown: { view: from, w: 9, last: true }, now: to, model: false });
            return [pairs.map(([from, to]) => isOf(from, to)), pairs.slice(4, 6).map(replaced)];
        }"""
    )
    assert true == [[True] * 4 + [False] * 6, [True, True]]
    # And on the page, where none comes.
    nodes = "() => { viewer.panel.fields.aov.value = 'nodes'; viewer.changed('aov'); }"
    viewer.page.evaluate(nodes)
    viewer.settled("octree")
    viewer.page.wait_for_function("() => viewer.layer.loaded")
    assert viewer.page.is_visible("#legend")
    viewer.page.evaluate("() => { viewer.connection.send = () => {}; viewer.setMode('brute'); }")
    try:
        viewer.page.wait_for_function("() => !viewer.traced.dirty")
        viewer.page.evaluate("() => viewer.cancel()")
        viewer.page.wait_for_function("() => viewer.picture.canvas.classList.contains('away')", timeout=5000)
        assert viewer.page.is_hidden("#legend")
    finally:
        viewer.page.evaluate("() => { delete viewer.connection.send; }")


def test_a_picture_that_is_not_finished_is_saved_when_it_is(odd: Viewer, tmp_path: Path) -> None:
    """The coarse one that stood there was written, without a word."""
    odd.page.evaluate(HOLD, "ack")
    odd.page.evaluate("() => { viewer.camera.orbit(0.4, 0); viewer.moved(); }")
    odd.page.wait_for_function("() => window.held.some(({ seq, step }) => seq === viewer.traced.seq && step === 0)")
    odd.page.locator("#busy", has_text="finer picture").wait_for()
    odd.page.click("#save-picture")
    assert "when it is finished" in odd.page.inner_text("#notices")
    with odd.page.expect_download() as saved:
        odd.page.evaluate(GO_ON)
    odd.settled("octree")
    saved.value.save_as(tmp_path / "seen.png")
    seen = odd.pixels("picture")
    assert np.array_equal(np.asarray(Pillow.open(tmp_path / "seen.png").convert("RGBA")), seen)
    assert seen.shape[:2] == (odd.camera["h"], odd.camera["w"])
    said = odd.page.inner_text("#notices")
    assert f"blocks.png, {seen.shape[1]} × {seen.shape[0]}" in said and "when it is finished" not in said


# Each drawing, as it is seen: by which of the cameras that the page had, whether traced, how wide, and which answer.
RECORD = """() => {
    const { viewer } = window;
    const cameras = [JSON.stringify(viewer.view().m)];
    const index = (m) => cameras.lastIndexOf(JSON.stringify(m));
    const { moved, frames: { draw } } = viewer;
    window.frames_seen = [];
    viewer.moved = function () {
        const now = JSON.stringify(this.view().m);
        if (cameras.at(-1) !== now) cameras.push(now);
        moved.call(this);
    };
    viewer.frames.draw = function () {
        draw.call(this);
        const { current, recent, shown } = viewer.traced, traced = current || recent;
        const { view, seq, step, w } = traced ? shown : { view: viewer.view(), seq: 0, step: 0, w: 0 };
        window.frames_seen.push({ traced, camera: index(view.m), now: cameras.length - 1, seq, step, w });
    };
}"""


# Pictures come so many milliseconds later, as through a slow network: longer than one of another camera may stand.
LATE = """(late) => {
    const { connection } = window.viewer, { received } = connection;
    connection.received = (picture) => setTimeout(() => received(picture), late);
}"""


@pytest.mark.parametrize(("pause", "late"), [(4, 0), (30, STALE)])
def test_no_frame_of_a_drag_is_older_or_coarser_than_one_before(browser: Any, pause: int, late: int) -> None:
    """At the default size, by a drag of twenty movements with so many milliseconds between; of so many samples that the
    last picture takes longer than a picture of another camera may stand.
    """
    size = {"width": 1280, "height": 800}
    with (
        served(MODELS.parent / "three_models.toml") as address,
        Viewer(browser, address, viewport=size, folded=True).open() as page,
    ):
        page.page.evaluate("() => (viewer.panel.fields.samples.value = '9')")
        page.page.evaluate(RECORD)
        if late:
            page.page.evaluate(LATE, late)
        x, y = page.centre()
        page.page.mouse.move(x, y)
        page.page.mouse.down()
        for step in range(1, 21):
            page.page.mouse.move(x + 10 * step, y + 4 * step)
            page.page.wait_for_timeout(pause)
        page.page.mouse.up()
        page.page.wait_for_timeout(50)
        page.settled("octree")
        frames = page.page.evaluate("() => window.frames_seen")
    assert len(frames) > 5 and frames[-1]["traced"] and frames[-1]["camera"] == frames[-1]["now"]
    for before, after in pairwise(frames):
        assert after["camera"] >= before["camera"], (before, after)
        if before["traced"] and after["traced"]:
            assert (after["seq"], after["step"]) >= (before["seq"], before["step"]), (before, after)
        if before["traced"] and after["camera"] == before["camera"] == after["now"]:
            assert after["traced"] and after["w"] >= before["w"], (before, after)
