"""What hands do to the viewer's page, on its controls, on its stage and on small screens."""

import math
from typing import Any

import numpy as np
import pytest
from viewer_page import Viewer


@pytest.mark.parametrize(
    "control", ["[name=mode][value=phong]", "[name=walk]", "#fit", "#keys summary", "[name=samples]"]
)
def test_keys_mean_the_stage_after_a_click_on_a_control(viewer: Viewer, control: str) -> None:
    """They were lost, and the arrows changed the mode."""
    if control == "[name=samples]":
        viewer.page.click(control)
        viewer.page.keyboard.press("Escape")
        viewer.page.select_option(control, "4")
    else:
        viewer.page.click(control)
    mode = viewer.page.evaluate("() => viewer.mode")
    viewer.settled(mode)
    before = viewer.camera["m"]
    viewer.page.keyboard.press("ArrowLeft")
    viewer.wait_until(lambda: viewer.camera["m"] != before)
    assert viewer.page.evaluate("() => viewer.mode") == mode
    viewer.page.keyboard.press("1")
    viewer.settled("gl")


def test_letters_mean_the_stage_where_a_slider_is_focused_and_arrows_the_slider(viewer: Viewer) -> None:
    viewer.page.focus("[name=max_depth]")
    before = viewer.camera["m"]
    viewer.page.keyboard.press("ArrowLeft")
    viewer.page.keyboard.press("ArrowLeft")
    viewer.settled("octree")
    assert viewer.page.input_value("[name=max_depth]") == "1" and viewer.camera["m"] == before
    viewer.page.keyboard.press("w")
    viewer.wait_until(lambda: viewer.camera["m"] != before)
    viewer.page.keyboard.press("2")
    viewer.settled("phong")


def picked(viewer: Viewer) -> str:
    """The card of a pixel whose ray goes on, and sends shadow rays."""
    left, top, width, height = (viewer.page.locator("#frame").bounding_box()[k] for k in ("x", "y", "width", "height"))
    for x, y in np.ndindex(9, 8):
        # The action bar covers the pixels at the top. The card may cover the next pixel.
        seq = viewer.page.evaluate("() => (viewer.rays.close(), viewer.rays.seq)")
        place = {"x": left + width * (x + 1) / 10, "y": top + height * (y + 2) / 10}
        if not viewer.page.evaluate("({ x, y }) => document.elementFromPoint(x, y).id === 'frame'", place):
            continue  # of the axes
        viewer.page.mouse.click(*place.values())
        viewer.page.wait_for_function(
            "(seq) => viewer.rays.seq > seq && viewer.rays.pick?.seq === viewer.rays.seq", arg=seq
        )
        card = viewer.page.inner_text("#card")
        if "shadow" in card and "reflected" in card:
            return card
    raise AssertionError("no such pixel")


@pytest.mark.parametrize(
    ("field", "kind"), [("max_depth", "reflected"), ("reflection", "reflected"), ("shadows", "shadow")]
)
def test_the_card_follows_the_settings(viewer: Viewer, field: str, kind: str) -> None:
    """It kept the rays of the settings before."""
    assert kind in picked(viewer)
    if field == "max_depth":
        viewer.page.locator("[name=max_depth]").fill("0")
    else:
        viewer.page.click(f"[name={field}]")
    viewer.page.wait_for_function("(kind) => !document.querySelector('#card').innerText.includes(kind)", arg=kind)
    assert "1 camera ray" in viewer.page.inner_text("#card")
    viewer.page.click("#card .close")
    viewer.page.click("[name=refraction]")
    viewer.settled("octree")
    assert viewer.page.is_hidden("#card")


def test_escape_closes_the_card_before_it_cancels(viewer: Viewer) -> None:
    picked(viewer)
    viewer.page.evaluate("() => { viewer.progress.show(0.5); viewer.stage.focus(); }")
    viewer.page.keyboard.press("Escape")
    assert viewer.page.is_hidden("#card") and viewer.page.is_visible("#progress")
    viewer.page.keyboard.press("Escape")
    assert "Cancelled" in viewer.page.inner_text("#progress")


def test_light_and_camera_are_reset_each_by_itself(viewer: Viewer) -> None:
    start, own = viewer.camera, viewer.pixels("picture")
    assert viewer.page.is_disabled("#reset-light")
    viewer.page.locator("[name=azimuth]").fill("-90")
    viewer.settled("octree")
    lit = viewer.pixels("picture")
    viewer.drag(60, 20)
    viewer.page.click("#reset-view")
    viewer.settled("octree")
    assert viewer.camera == start and np.array_equal(viewer.pixels("picture"), lit)
    viewer.drag(60, 20)
    viewer.page.wait_for_timeout(50)
    viewer.settled("octree")
    moved = viewer.camera
    viewer.page.click("#reset-light")
    viewer.settled("octree")
    assert viewer.camera == moved != start
    viewer.page.locator("#stage").press("r")
    viewer.settled("octree")
    assert np.array_equal(viewer.pixels("picture"), own) and not np.array_equal(own, lit)


@pytest.mark.parametrize(
    ("rate", "said"), [(0.00012, "0.12 k"), (0.0042, "4.20 k"), (0.06, "60.0 k"), (2.5, "2.50 M"), (42, "42.0 M")]
)
def test_slow_and_fast_pictures_have_a_speed(viewer: Viewer, rate: float, said: str) -> None:
    told = viewer.page.evaluate(
        """(rate) => {
            viewer.readings.ofPicture({ kind: 1, step: 2, last: true, w: 8, h: 8, ms: 5, rate }, 6, 1, { w: 8, h: 8 });
            return [viewer.readings.values.speed.textContent, document.querySelector("#hud").textContent];
        }""",
        rate,
    )
    assert told[0] == f"{said} rays/s" and told[1].endswith(f"{said} rays/s")


def test_more_boxes_than_can_be_drawn_are_not_drawn_and_that_is_said(viewer: Viewer) -> None:
    """48,311 boxes stalled software GL for seconds a picture."""
    budget = viewer.page.evaluate("() => viewer.layer.mostBoxes")
    assert budget == 1000  # the tests' GL is software
    viewer.page.evaluate("() => { viewer.layer.mostBoxes = 5; }")
    try:
        viewer.choose("gl")
        deepest = viewer.page.get_attribute("[name=level]", "max")
        viewer.page.locator("[name=level]").fill(deepest)
        viewer.page.wait_for_function("() => viewer.scenes.boxes.count > 0")
        count, edges, panes, everything = viewer.page.evaluate(
            "() => (({ count, edges, panes, all }) => [count, edges.count, panes.count, all])(viewer.scenes.boxes)"
        )
        assert (count, edges, panes) == (5, 60, 5) and everything > 5
        shown = viewer.page.evaluate("() => viewer.panel.fields.level_shown.value")
        assert shown == f"{deepest} · 5 of {everything:,} nodes"
        # They are of all of the level: of its first and of its last parts.
        corners = viewer.page.evaluate(
            """async (level) => {
                const { fetchBoxes } = await import("./static/nodes.js");
                const [few, all] = await Promise.all([5, 1e9].map((most) => fetchBoxes(viewer.scene.id, level, most)));
                return [few, all].map(({ panes }) => [...panes.floats].filter((_, i) => i % 7 < 6));
            }""",
            int(deepest),
        )
        few, all_of_them = (np.reshape(values, (-1, 6)) for values in corners)
        assert np.array_equal(few, all_of_them[np.arange(5) * len(all_of_them) // 5])
    finally:
        viewer.page.evaluate("(budget) => { viewer.layer.mostBoxes = budget; }", budget)


def wheel(viewer: Viewer, x: float, y: float, **options: Any) -> None:
    viewer.page.evaluate(
        "([clientX, clientY, options]) => viewer.stage.dispatchEvent("
        "new WheelEvent('wheel', { clientX, clientY, cancelable: true, ...options }))",
        [x, y, options],
    )


def test_a_pinch_on_a_trackpad_zooms_as_far_as_the_fingers_part(viewer: Viewer) -> None:
    """A tenth of it was zoomed: browsers tell of it as a wheel with the control key, in hundredths of a power of e."""
    before = viewer.page.evaluate("() => viewer.camera.distance")
    wheel(viewer, *viewer.centre(), deltaY=-100 * math.log(1.5), ctrlKey=True)
    assert viewer.page.evaluate("() => viewer.camera.distance") == pytest.approx(before / 1.5)


def place(viewer: Viewer, point: list[float]) -> tuple[float, float]:
    """Where a point of the scene is in the window."""
    x, y, z, _ = np.linalg.inv(np.reshape(viewer.page.evaluate("() => viewer.camera.matrix()"), (4, 4)).T) @ [
        *point,
        1.0,
    ]
    box, fovy = viewer.page.locator("#frame").bounding_box(), viewer.page.evaluate("() => viewer.camera.fovy")
    scale = box["height"] / 2 / math.tan(fovy / 2) / -z
    return box["x"] + box["width"] / 2 + x * scale, box["y"] + box["height"] / 2 - y * scale


def test_the_wheel_zooms_towards_the_pointer(viewer: Viewer) -> None:
    pivot, right, up = viewer.page.evaluate("() => [viewer.camera.pivot, ...viewer.camera.frame().slice(0, 2)]")
    point = (np.array(pivot) + 0.7 * np.array(right) - 0.4 * np.array(up)).tolist()
    before = place(viewer, point)
    wheel(viewer, *before, deltaY=-300)
    # An event's place is in whole pixels; by e^0.36 - 1 of one the zoom moves the rest.
    assert place(viewer, point) == pytest.approx(before, abs=0.44)
    assert math.dist(place(viewer, pivot), before) > 20.0


def test_a_double_click_turns_about_what_is_there(viewer: Viewer) -> None:
    viewer.page.mouse.dblclick(viewer.centre()[0] + 40, viewer.centre()[1] + 30)
    viewer.page.wait_for_function(
        "() => viewer.rays.pick && String(viewer.camera.pivot) === String(viewer.rays.pick.point)"
    )
    point, distance = viewer.page.evaluate("() => [viewer.rays.pick.point, viewer.camera.distance]")
    assert place(viewer, point) == pytest.approx(viewer.centre())
    viewer.settled("octree")
    assert math.dist(viewer.camera["m"][12:15], point) == pytest.approx(distance)


# Take the card to where the middle of that part of it is at a point, and away with null.
PLACE_CARD = """([part, x, y]) => {
    const card = document.querySelector("#card");
    card.style.translate = "none";
    if (!part) return;
    const { left, top, width, height } = card.querySelector(part).getBoundingClientRect();
    card.style.translate = `${x - left - width / 2}px ${y - top - height / 2}px`;
    return document.elementFromPoint(x, y).matches(part);
}"""


@pytest.mark.parametrize("part", [".close", "h2"])
def test_a_double_click_is_one_though_a_card_has_come_between(viewer: Viewer, part: str) -> None:
    """Its second click fell on the card: nothing was turned, and what it met there was pressed or selected."""
    x, y = viewer.centre()[0] + 40, viewer.centre()[1] + 30
    viewer.pick(x, y)
    met = viewer.page.evaluate(PLACE_CARD, [part, x, y])
    viewer.page.mouse.down(click_count=2)
    viewer.page.mouse.up(click_count=2)
    viewer.page.evaluate(PLACE_CARD, [None, 0, 0])
    assert met
    assert viewer.page.locator("#card").is_hidden()  # which the first click had opened
    pivot, point, selected = viewer.page.evaluate(
        "() => [viewer.camera.pivot, viewer.rays.pick.point, String(getSelection())]"
    )
    assert (pivot, selected) == (point, "")


def test_the_second_click_on_what_closes_the_card_picks_nothing(viewer: Viewer) -> None:
    """It fell on the picture that the card had covered, and a card came again."""
    x, y = viewer.centre()[0] + 40, viewer.centre()[1] + 30
    viewer.pick(x - 80, y)
    assert viewer.page.evaluate(PLACE_CARD, [".close", x, y])
    asked, pivot = viewer.page.evaluate("() => [viewer.rays.seq, viewer.camera.pivot]")
    viewer.page.mouse.dblclick(x, y)
    viewer.page.evaluate(PLACE_CARD, [None, 0, 0])
    closed = viewer.page.evaluate("() => [viewer.rays.seq, viewer.camera.pivot, viewer.rays.asked]")
    assert closed == [asked + 1, pivot, None]
    # Another means the picture again, also a finger's, whose mouse events come when it has left.
    connection = viewer.context.new_cdp_session(viewer.page)
    for kind, points in (("touchStart", [{"x": x - 80, "y": y}]), ("touchEnd", [])):
        connection.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    viewer.page.wait_for_selector("#card")


def test_a_double_click_beside_the_picture_or_on_a_control_turns_about_nothing(viewer: Viewer) -> None:
    """Beside it the camera turned about what was clicked before."""
    viewer.page.select_option("[name=size]", "scene")
    viewer.choose("proof")
    viewer.pick(viewer.centre()[0] + 40, viewer.centre()[1] + 30)
    state = "() => [viewer.camera.pivot, viewer.rays.seq]"
    before = viewer.page.evaluate(state)
    stage, frame = (viewer.page.locator(name).bounding_box() for name in ("#stage", "#frame"))
    assert frame["x"] + frame["width"] + 8 < stage["x"] + stage["width"]
    viewer.page.mouse.dblclick(stage["x"] + stage["width"] - 4, stage["y"] + stage["height"] / 2)
    assert viewer.page.evaluate(state) == before
    viewer.page.locator("#divider").press("End")  # from under the card
    viewer.page.locator("#divider").dblclick(position={"x": 8, "y": 30})
    assert viewer.page.evaluate(state) == before


def test_a_double_click_may_be_at_the_pictures_right(viewer: Viewer) -> None:
    """Further right than the picture is high, where it is known for beside the picture if its sides are mistaken."""
    frame = viewer.page.locator("#frame").bounding_box()
    x, y = frame["x"] + frame["width"] - 60, frame["y"] + frame["height"] - 40
    assert x > frame["y"] + frame["height"]
    viewer.pick(x, y)
    assert viewer.page.evaluate("() => viewer.rays.pick.hit")
    viewer.page.mouse.dblclick(x, y)
    viewer.page.wait_for_function("() => String(viewer.camera.pivot) === String(viewer.rays.pick.point)")


def test_a_control_is_pressed_by_keyboard_after_a_click_on_the_picture(viewer: Viewer) -> None:
    viewer.pick(*viewer.centre())
    viewer.page.focus("[name=shadows]")
    viewer.page.keyboard.press("Space")
    assert not viewer.page.is_checked("[name=shadows]")
    assert viewer.page.evaluate("() => document.activeElement.name") == "shadows"


def test_two_clicks_on_the_card_turn_about_nothing(viewer: Viewer) -> None:
    viewer.pick(viewer.centre()[0] + 40, viewer.centre()[1] + 30)
    pivot = viewer.page.evaluate("() => viewer.camera.pivot")
    viewer.page.locator("#card h2").dblclick()
    assert viewer.page.evaluate("() => [viewer.camera.pivot, String(getSelection()) !== '']") == [pivot, True]


def test_a_ray_is_seen_from_the_side_beside_its_card(viewer: Viewer) -> None:
    """Its middle was the picture's, beneath the card, which lies over the picture where the panel is closed."""
    viewer.page.click("#toggle-panel")
    viewer.settled("octree")
    viewer.page.mouse.click(viewer.centre()[0] + 40, viewer.centre()[1] + 30)
    viewer.page.click("#card >> text=View from the side")
    viewer.settled("octree")
    card, frame = (viewer.page.locator(name).bounding_box() for name in ("#card", "#frame"))
    left, right = card["x"] + card["width"], frame["x"] + frame["width"]
    start, end = np.array(viewer.page.evaluate("() => [viewer.rays.pick.path[0].start, viewer.rays.pick.path[0].end]"))
    x, y = zip(*(place(viewer, point.tolist()) for point in (start, end)), strict=True)
    assert left < min(x) < max(x) < right and frame["x"] < left
    assert frame["y"] < min(y) and max(y) < frame["y"] + frame["height"]
    back = viewer.camera["m"][8:11]
    assert abs((end - start) @ back) < 0.3 * math.dist(start, end)  # across the view, but for the tilt
    middle = place(viewer, ((start + end) / 2).tolist())
    assert middle[0] == pytest.approx((left + right) / 2)
    viewer.page.click("#toggle-panel")


def test_the_divider_goes_to_its_ends(viewer: Viewer) -> None:
    viewer.choose("proof")
    divider = viewer.page.locator("#divider")
    for key, value in (("Home", "0"), ("End", "100"), ("ArrowLeft", "98")):
        divider.press(key)
        assert divider.get_attribute("aria-valuenow") == value
    viewer.page.evaluate("() => viewer.proof.move(0.5)")
    divider.press("x")  # which is a shortcut there, too
    assert viewer.page.evaluate("() => viewer.proof.differences") and divider.is_hidden()
    viewer.page.keyboard.press("x")
    assert divider.is_visible()


def test_settings_on_a_phone_are_folded_and_come_into_view(browser: Any, url: str) -> None:
    """They were open below the window, and the first touch hid them."""
    size = {"width": 390, "height": 844}
    with Viewer(browser, url, folded=True, viewport=size, has_touch=True, is_mobile=True) as page:
        page.open()
        assert page.page.is_hidden("#panel")
        page.page.tap("#frame")
        page.page.wait_for_selector("#card:not([hidden])")
        page.page.tap("#toggle-panel")
        page.page.wait_for_function("() => document.querySelector('#panel').getBoundingClientRect().top < 400")
        assert page.page.is_visible("#fold-scene > summary")
