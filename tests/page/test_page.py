"""The viewer as a person meets it: the real server, the real page, in headless Chromium with software GL."""

import re
import tomllib
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Pillow
from viewer_client import seen_by
from viewer_page import Viewer

from renderer import load_scene
from renderer.diagnostics.face_phong import face_colors
from renderer.materials.columns import MATERIAL_COLUMNS
from renderer.picture.image import Image, srgb
from renderer.picture.prepare import PreparedScene, prepare_scene
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.needs import needs_of


def picture_of(scenes: Path, shown: dict[str, Any], **settings: Any) -> Image:
    """The Python renderer's picture at the camera that the page reports."""
    return seen_by(shown, load_scene(scenes / "blocks.toml"), **settings)


def stage_of(scenes: Path) -> PreparedScene:
    scene = load_scene(scenes / "blocks.toml")
    return prepare_scene(scene, needs_of(scene), "octree")


def inside(faces: NDArray[np.int32], prepared: PreparedScene) -> NDArray[np.bool_]:
    """The pixels whose neighbours show the same face, which is not of glass."""
    glass = list(prepared.scene.materials).index("glass")
    opaque = np.append(prepared.arrays.material // MATERIAL_COLUMNS != glass, False)[faces]
    changes = np.zeros(faces.shape, bool)
    changes[:, 1:] |= faces[:, 1:] != faces[:, :-1]
    changes[1:] |= faces[1:] != faces[:-1]
    return opaque & ~grown(changes, 2)


def colors(pixels: NDArray[np.uint8]) -> int:
    return len(np.unique(pixels.reshape(-1, 4), axis=0))


def grown(mask: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """The mask and every pixel at most ``by`` away from it along rows and columns."""
    padded, (h, w) = np.pad(mask, by), mask.shape
    return np.any([padded[y : y + h, x : x + w] for y in range(2 * by + 1) for x in range(2 * by + 1)], axis=0)


def test_own_phong_shows_the_renderers_colors(viewer: Viewer, scenes: Path) -> None:
    viewer.choose("phong")
    viewer.drag(40, -10)
    viewer.page.wait_for_timeout(50)
    viewer.settled("phong")
    seen, shown, prepared = viewer.pixels("gl"), viewer.camera, stage_of(scenes)
    faces = picture_of(scenes, shown).face
    expected = face_colors(prepared.arrays, shown["m"][12:15])[faces]
    sure = inside(faces, prepared)
    assert sure.mean() > 0.15
    assert np.array_equal(seen[sure][:, :3], expected[sure])


@pytest.mark.parametrize("answered", [True, False])
def test_a_change_of_mode_waits_a_moment_for_its_picture_and_draws_once(viewer: Viewer, answered: bool) -> None:
    """And no longer than a moment, should none come."""
    drawn = viewer.page.evaluate(
        """async (answered) => {
          const { model } = viewer.layer, { draw } = model;
          const drawn = [], frame = () => new Promise(requestAnimationFrame), sent = viewer.traced.seq;
          const noon = performance.now();
          performance.now = () => noon; // time stands still, so that a slow machine changes nothing
          model.draw = (...a) => { drawn.push(viewer.stage.dataset.mode); draw.apply(model, a); };
          if (!answered) viewer.connection.send = () => {};
          viewer.setMode("phong");
          while (viewer.traced.seq === sent) await frame();
          for (let i = 0; i < 5 || (answered && viewer.stage.dataset.mode !== "phong"); i++) await frame();
          const inTime = drawn.length;
          delete performance.now;
          for (let i = 0; i < 100 && !drawn.length; i++) await new Promise((r) => setTimeout(r, 50));
          delete model.draw;
          delete viewer.connection.send;
          return [inTime, drawn.length > 0];
        }""",
        answered,
    )
    assert drawn == [int(answered), True]


def test_gl_lighting_is_phong(viewer: Viewer, scenes: Path) -> None:
    viewer.choose("gl")
    seen, shown, prepared = viewer.pixels("gl"), viewer.camera, stage_of(scenes)
    traced = picture_of(scenes, shown, max_depth=0, shadows=False)
    sure = inside(traced.face, prepared)
    difference = np.abs(seen[..., :3].astype(int) - srgb(traced.radiance))[sure]
    # WebGL's float32 may fall on the other side of where a code begins.
    assert difference.max() <= 1


@pytest.mark.parametrize("size, expected", [("scene", (320, 240)), ("512x512", (512, 512)), ("0.5", None)])
def test_the_picture_has_the_size_asked_for(viewer: Viewer, size: str, expected: tuple[int, int] | None) -> None:
    width, height = viewer.page.evaluate("() => [window.viewer.stage.clientWidth, window.viewer.stage.clientHeight]")
    viewer.page.select_option("[name=size]", size)
    viewer.settled("octree")
    frame, shown = viewer.page.locator("#frame").bounding_box(), viewer.camera
    assert (shown["w"], shown["h"]) == (expected or (int(width / 2 + 0.5), int(height / 2 + 0.5)))
    assert viewer.pixels("picture").shape == (shown["h"], shown["w"], 4)
    assert frame["width"] <= width and frame["height"] <= height
    # Sides on the screen are whole pixels.
    assert abs(frame["width"] * shown["h"] - frame["height"] * shown["w"]) <= max(shown["w"], shown["h"])


def test_the_panel_tells_of_the_scene(viewer: Viewer, scenes: Path) -> None:
    prepared = stage_of(scenes)
    readings = viewer.page.inner_text("#readings")
    for name, value in (("faces", len(prepared.mesh.faces)), ("nodes", prepared.octree.stats.nodes)):
        assert re.search(rf"{name}\s+{value:,}\b", readings, re.IGNORECASE), name
    assert "M rays/s" in readings and "final" in readings
    viewer.page.click("#needs summary")
    assert "every mesh is flat" in viewer.page.inner_text("#needs ul")


def test_brute_force_can_be_cancelled_and_started_again(viewer: Viewer) -> None:
    viewer.choose("brute")
    assert viewer.page.is_disabled("[name=samples]")
    viewer.page.select_option("[name=size]", "1024x1024")
    viewer.page.wait_for_selector("#progress:not([hidden])")
    viewer.page.click("#cancel")
    # One that was on its way when the button was pressed showed the bar again, for ever.
    viewer.page.evaluate("() => window.viewer.told({ type: 'progress', seq: window.viewer.traced.seq, done: 0.5 })")
    assert viewer.page.inner_text("#progress").split() == ["Cancelled", "Start"]
    viewer.page.click("#cancel")
    viewer.page.wait_for_function("() => viewer.traced.waiting && viewer.progress.shown")
    viewer.page.click("#cancel")
    viewer.page.select_option("[name=size]", "0.5")
    viewer.choose("octree")


@pytest.mark.parametrize("name", ["drag", "pan", "wheel", "ArrowLeft", "+", "w", "f"])
def test_a_movement_changes_the_picture(viewer: Viewer, name: str) -> None:
    before, camera = viewer.pixels("picture"), viewer.camera
    if name == "drag":
        viewer.drag(60, 20)
    elif name == "pan":
        viewer.drag(40, 10, button="right")
    elif name == "wheel":
        viewer.page.mouse.move(*viewer.centre())
        viewer.page.mouse.wheel(0, -200)
    else:
        viewer.page.locator("#stage").press(name)
    viewer.page.wait_for_timeout(50)
    viewer.settled("octree")
    assert viewer.camera["m"] != camera["m"]
    assert not np.array_equal(viewer.pixels("picture"), before)
    viewer.page.locator("#stage").press("r")
    viewer.settled("octree")
    assert viewer.camera == camera
    assert np.array_equal(viewer.pixels("picture"), before)


def test_walking_turns_the_head_and_moves_the_feet(viewer: Viewer) -> None:
    viewer.page.locator("#stage").press("l")
    start = viewer.camera["m"]
    viewer.drag(30, 10)
    viewer.page.wait_for_timeout(50)
    viewer.settled("octree")
    turned = viewer.camera["m"]
    assert turned[8:11] != start[8:11]
    assert np.allclose(turned[12:15], start[12:15], rtol=1e-12)  # rounding of a pivot that swings around the eye
    viewer.page.locator("#stage").press("w")
    viewer.settled("octree")
    walked = viewer.camera["m"]
    step = np.subtract(walked[12:15], turned[12:15])
    assert walked[8:11] == turned[8:11]
    assert np.allclose(step / np.linalg.norm(step), np.negative(turned[8:11]), atol=1e-6)  # six digits of a small step


def test_fit_brings_all_of_the_scene_into_the_picture(viewer: Viewer, scenes: Path) -> None:
    viewer.drag(70, 40)
    viewer.page.locator("#stage").press("f")
    viewer.settled("octree")
    shown = viewer.camera
    m = np.reshape(shown["m"], (4, 4)).T
    corners = np.array(list(product(*np.transpose(stage_of(scenes).mesh.bounds))))
    x, y, z, _ = np.linalg.inv(m) @ np.column_stack([corners, np.ones(8)]).T
    slope = np.tan(shown["fovy"] / 2)
    outmost = max(np.abs(x / z).max() * shown["h"] / shown["w"], np.abs(y / z).max()) / slope
    assert (z < 0).all()
    assert np.isclose(outmost, 1 / 1.05)  # a margin of a twentieth


def test_a_drag_picks_nothing(viewer: Viewer) -> None:
    viewer.drag(30, 0)
    viewer.settled("octree")
    viewer.page.wait_for_timeout(100)
    assert viewer.page.is_hidden("#card")


def test_every_pixel_is_the_python_renderers(viewer: Viewer, scenes: Path) -> None:
    viewer.drag(90, -30)
    viewer.drag(20, 15, button="right")
    viewer.page.mouse.wheel(0, -150)
    viewer.page.wait_for_timeout(50)
    viewer.settled("octree")
    seen, shown = viewer.pixels("picture"), viewer.camera
    assert seen.shape[:2] == (shown["h"], shown["w"])
    box = viewer.page.locator("#picture").bounding_box()
    assert (box["width"], box["height"]) == (shown["w"], shown["h"])
    assert np.array_equal(seen[..., :3], srgb(picture_of(scenes, shown).radiance))


def test_a_click_tells_of_the_ray(viewer: Viewer, scenes: Path) -> None:
    shown = viewer.camera
    x, y = shown["w"] // 2, shown["h"] // 2
    left, top = (viewer.page.locator("#frame").bounding_box()[k] for k in ("x", "y"))
    viewer.page.mouse.click(left + x + 0.5, top + y + 0.5)
    viewer.page.wait_for_selector("#card:not([hidden])")
    face = picture_of(scenes, shown).face[y, x]
    assert face >= 0
    assert re.search(rf"face\s*{face}\b", viewer.page.inner_text("#card"))
    assert "1 camera ray" in viewer.page.inner_text("#card")
    assert viewer.pixels("gl")[..., 3].any()  # the ray's way over the traced picture
    viewer.page.click("#card .close")
    assert viewer.page.is_hidden("#card")
    viewer.settled("octree")
    assert not viewer.pixels("gl")[..., 3].any()


def test_boxes_are_drawn_level_by_level(viewer: Viewer, scenes: Path) -> None:
    viewer.choose("gl")
    bare = viewer.pixels("gl")
    viewer.page.locator("#stage").press("b")
    viewer.page.wait_for_function("() => /node/.test(document.querySelector('[name=level_shown]').value)")
    viewer.settled("gl")
    boxed = viewer.pixels("gl")
    assert not np.array_equal(boxed, bare)
    viewer.page.locator("[name=level]").fill("0")
    viewer.page.wait_for_function("() => document.querySelector('[name=level_shown]').value === '0 · 1 node'")
    viewer.settled("gl")
    root = viewer.pixels("gl")
    assert not np.array_equal(root, boxed) and not np.array_equal(root, bare)


@pytest.mark.parametrize("name", ["shadows", "reflection", "refraction", "azimuth", "max_depth", "aov"])
def test_a_setting_changes_the_picture(viewer: Viewer, name: str) -> None:
    before = viewer.pixels("picture")
    field = viewer.page.locator(f"[name={name}]")
    if name == "aov":
        field.select_option("normal")
    elif name in ("azimuth", "max_depth"):
        field.fill({"azimuth": "-90", "max_depth": "0"}[name])
    else:
        field.click()
    viewer.settled("octree")
    assert not np.array_equal(viewer.pixels("picture"), before)


def test_another_scene_and_a_broken_one(viewer: Viewer) -> None:
    before = viewer.pixels("picture")
    viewer.page.select_option("[name=file]", "broken.toml")
    viewer.page.locator("#notices p", has_text="fov").wait_for()
    assert np.array_equal(viewer.pixels("picture"), before)
    assert viewer.page.input_value("[name=file]") == "blocks.toml"
    viewer.page.select_option("[name=file]", "other.toml")
    viewer.page.wait_for_function("() => document.querySelector('#name').textContent === 'other'")
    # The old picture stands until the new one comes.
    viewer.wait_until(lambda: np.array_equal(viewer.pixels("picture")[0, 0, :3], srgb([0.9, 0.5, 0.1])))
    viewer.page.select_option("[name=file]", "blocks.toml")
    viewer.page.wait_for_function("() => document.querySelector('#name').textContent === 'blocks'")
    viewer.settled("octree")


def test_what_an_address_asked_for_is_forgotten_when_it_fails_and_when_the_user_opens_another(viewer: Viewer) -> None:
    """The scene of an address came in place of the one that was chosen later."""
    viewer.page.evaluate(
        """() => {
            const { connection } = viewer, { send } = connection;
            window.opened = [];
            connection.send = (message) => {
                if (message.type === "scene") window.opened.push(message.file);
                return send.call(connection, message);
            };
            location.hash = "#file=broken.toml";
        }"""
    )
    viewer.page.locator("#notices p", has_text="fov").wait_for()
    viewer.page.evaluate("() => viewer.scenes.open('other.toml')")
    viewer.shows("other.toml")
    opened = "() => { delete viewer.connection.send; return window.opened; }"
    assert viewer.page.evaluate(opened) == ["broken.toml", "other.toml"]
    asks = "() => { const { scenes } = viewer; scenes.goTo({ file: 'broken.toml', hidden: [], chosen: {} }); return "
    then = "[scenes.asked.file, (scenes.open('blocks.toml'), scenes.asked)]; }"
    assert viewer.page.evaluate(asks + then) == ["broken.toml", None]
    viewer.shows("blocks.toml")
    viewer.settled("octree")


def test_picture_and_camera_are_saved(viewer: Viewer, tmp_path: Path) -> None:
    with viewer.page.expect_download() as picture:
        viewer.page.click("#save-picture")
    picture.value.save_as(tmp_path / "seen.png")
    assert np.array_equal(np.asarray(Pillow.open(tmp_path / "seen.png").convert("RGBA")), viewer.pixels("picture"))
    with viewer.page.expect_download() as camera:
        viewer.page.click("#save-camera")
    camera.value.save_as(tmp_path / "camera.toml")
    saved = PerspectiveCamera.model_validate(
        tomllib.loads((tmp_path / "camera.toml").read_text(encoding="utf-8"))["camera"]
    )
    assert np.allclose(saved.eye, viewer.camera["m"][12:15], rtol=1e-9)


def test_two_fingers_zoom_and_a_tap_picks(browser: Any, url: str) -> None:
    with Viewer(browser, url, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True) as phone:
        phone.open()
        before = phone.camera["m"]
        phone.pinch()
        phone.settled("octree")
        middle = np.array(before[12:15])
        assert np.linalg.norm(phone.camera["m"][12:15]) < np.linalg.norm(middle)  # closer to what is around the origin
        phone.page.touchscreen.tap(*phone.centre())
        phone.page.wait_for_selector("#card:not([hidden])")


def test_all_of_it_by_keyboard(viewer: Viewer) -> None:
    reached = set()
    for _ in range(80):  # once around the page, and some more
        viewer.page.keyboard.press("Tab")
        name, outlined = viewer.page.evaluate(
            """() => {
                const { activeElement: on } = document;
                const seen = on.matches(".modes input") ? on.nextElementSibling : on;
                return [on.name || on.id || on.innerText, getComputedStyle(seen).outlineStyle !== "none"];
            }"""
        )
        assert outlined or viewer.page.evaluate("() => document.activeElement === document.body"), name
        reached.add(name)
    assert {"mode", "stage", "boxes", "level", "file", "samples", "shadows", "reset-view", "save-camera"} <= reached
    viewer.choose("phong")
    viewer.page.keyboard.press("Enter")
    viewer.page.wait_for_selector("#card:not([hidden])")
    viewer.page.keyboard.press("Escape")
    assert viewer.page.is_hidden("#card")


def test_without_webgl_ray_tracing_works(browser: Any, url: str) -> None:
    with Viewer(browser, url) as bare:
        bare.page.add_init_script(
            """const context = HTMLCanvasElement.prototype.getContext;
            HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
                return kind.startsWith("webgl") ? null : context.call(this, kind, ...rest);
            };"""
        )
        bare.open()
        before = bare.pixels("picture")
        assert colors(before) > 15
        assert "WebGL2" in bare.page.inner_text("#notices")
        assert bare.page.is_disabled("[name=mode][value=gl]") and bare.page.is_disabled("[name=mode][value=phong]")
        assert bare.page.is_disabled("[name=boxes]") and bare.page.is_disabled("[name=level]")
        bare.drag(60, 20)
        bare.page.wait_for_timeout(50)
        bare.settled("octree")
        assert not np.array_equal(bare.pixels("picture"), before)


def test_the_page_comes_back_when_the_connection_does(viewer: Viewer) -> None:
    viewer.page.evaluate("() => window.viewer.connection.socket.close()")
    viewer.page.wait_for_selector("body[data-connected=false]")
    viewer.page.wait_for_selector("body[data-connected=true]")
    viewer.drag(40, 0)
    viewer.page.wait_for_timeout(50)
    viewer.settled("octree")


# A connection whose sockets are in the hands of a test; returns what `act` does with it.
CONNECTION = """async () => {
    const { Connection } = await import("./static/connection.js");
    const { WebSocket, setTimeout } = window, waits = [], sockets = [], refused = [];
    class Socket extends EventTarget {
        static OPEN = 1;
        constructor() { super(); sockets.push(this); this.readyState = 1; this.sent = []; }
        send(text) { this.sent.push(text); }
    }
    const happens = (kind, Event, values) => sockets.at(-1).dispatchEvent(new Event(kind, values));
    const opens = () => happens("open", Event), closes = (code) => happens("close", CloseEvent, { code });
    const says = (message) => happens("message", MessageEvent, { data: JSON.stringify(message) });
    window.WebSocket = Socket;
    window.setTimeout = (act, wait) => { waits.push(wait); act(); };
    try {
        const nothing = () => {};
        const connection =
            new Connection({ received: nothing, told: nothing, changed: nothing, refused: (too) => refused.push(too) });
        connection.open();
        ACT
    } finally {
        Object.assign(window, { WebSocket, setTimeout });
    }
}"""


def test_a_server_that_takes_no_more_pages_is_asked_ever_less_often(viewer: Viewer) -> None:
    """It was asked three times a second, because it opens a connection before it closes it."""
    waits = viewer.page.evaluate(
        CONNECTION.replace(
            "ACT",
            """
            for (let i = 0; i < 5; i++) { opens(); says({ type: "error", message: "too many" }); closes(1013); }
            opens(); says({ type: "scene", id: "1" }); closes(1006);
            return waits;
            """,
        )
    )
    assert waits == [300, 1000, 2000, 5000, 5000, 300]
    shown = """() => {
        for (let i = 0; i < 3; i++) viewer.notices.say("connections: too many");
        return [...document.querySelectorAll("#notices p")].filter((p) => p.textContent.includes("too many")).length;
    }"""
    assert viewer.page.evaluate(shown) == 1


def test_a_message_that_is_too_large_is_not_sent_again(viewer: Viewer) -> None:
    """The connection was closed for it without end."""
    sent, refused = viewer.page.evaluate(
        CONNECTION.replace(
            "ACT",
            """
            const view = (number) => ({ type: "view", edits: "x".repeat(number) });
            opens();
            const sent = [connection.send(view(100))];
            closes(1009);
            opens();
            const later = [view(100), view(200), { type: "ack" }, view(99)];
            sent.push(...later.map((message) => connection.send(message)));
            return [sent, refused];
            """,
        )
    )
    assert sent == [True, False, False, True, True] and refused == [True, True, True, False]
    # And the page says so as long as it is so, and waits for nothing.
    viewer.page.evaluate("() => { viewer.connection.limit = 100; viewer.moved(); }")
    viewer.page.locator("#notices p", has_text="too large").wait_for()
    assert not viewer.page.evaluate("() => viewer.traced.coming")
    viewer.page.evaluate("() => { viewer.connection.limit = Infinity; viewer.moved(); }")
    viewer.settled("octree")
    assert "too large" not in viewer.page.inner_text("#notices")


def test_ray_tracing_goes_on_when_the_browser_takes_webgl_away(browser: Any, url: str) -> None:
    with Viewer(browser, url) as left:
        left.open().page.keyboard.press("1")  # before anything is focused
        left.settled("gl")
        left.page.evaluate("() => window.viewer.layer.gl.getExtension('WEBGL_lose_context').loseContext()")
        left.page.wait_for_selector("body[data-gl=none]", state="attached")
        left.settled("octree")
        assert colors(left.pixels("picture")) > 15
        Viewer.faults[:] = [fault for fault in Viewer.faults if "CONTEXT_LOST" not in fault]  # the browser's own words
