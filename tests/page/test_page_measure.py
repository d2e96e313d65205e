"""Measuring between two clicks, and the value of the pixel under the pointer."""

import re
from pathlib import Path

import numpy as np
import pytest
from cases import cases
from viewer_client import seen_by
from viewer_page import Viewer

from renderer import load_scene
from renderer.viewer.measure import measured
from renderer.viewer.protocol import Measure, Pixel
from renderer.viewer.shown import open_file

# Places on the picture beside its middle: the stairs, the floor, and the sky.
STAIRS, FLOOR, SKY = (-60, 10), (40, 20), (150, -80)


def click(viewer: Viewer, *places: tuple[int, int]) -> None:
    """Click on places beside the picture's middle, and wait for each answer."""
    for x, y in places:
        seq, (left, top) = viewer.page.evaluate("() => viewer.measure.seq"), viewer.centre()
        viewer.page.evaluate("() => (window.answered = false)")
        viewer.page.mouse.click(left + x, top + y)
        viewer.page.wait_for_function("(seq) => viewer.measure.seq > seq && window.answered", arg=seq)


@pytest.fixture
def measuring(viewer: Viewer) -> Viewer:
    """The page after the key M; it marks when an answer was taken."""
    viewer.page.evaluate(
        """() => {
            const { measure } = viewer;
            measure.show = (told) => (measure.constructor.prototype.show.call(measure, told), (window.answered = true));
        }"""
    )
    viewer.page.locator("#stage").press("m")
    return viewer


def test_two_clicks_are_a_distance_and_a_third_begins_anew(measuring: Viewer, scenes: Path) -> None:
    page = measuring.page
    assert page.get_attribute("#measure", "aria-pressed") == "true" and page.is_visible("#measured")
    click(measuring, STAIRS)
    assert page.is_hidden("#distance") and "second point" in page.inner_text("#measured")
    page.keyboard.press("ArrowLeft")  # the second point is of another view
    measuring.settled("octree")
    click(measuring, FLOOR)
    pixels = page.evaluate("() => viewer.measure.pixels")
    told = measured(
        open_file(scenes / "blocks.toml"), Measure(type="measure", seq=1, pixels=[Pixel(**p) for p in pixels])
    )
    length, bound = page.inner_text("#distance").split(" ± ")
    assert pixels[0]["m"] != pixels[1]["m"] and float(length) == told["distance"]["length"]
    assert told["distance"]["bound"] <= float(bound) < 1e-13
    card = page.inner_text("#measured")
    assert page.inner_text("#distance") in card and all(repr(x) in card for x in told["distance"]["vector"])
    click(measuring, STAIRS)
    assert page.is_hidden("#distance") and "second point" in page.inner_text("#measured")


def test_the_sky_has_no_point_and_the_first_one_stays(measuring: Viewer) -> None:
    click(measuring, SKY)
    assert (
        "no surface" in measuring.page.inner_text("#notices")
        and measuring.page.evaluate("() => viewer.measure.pixels") == []
    )
    click(measuring, STAIRS, SKY, FLOOR)
    measuring.page.wait_for_selector("#distance:not([hidden])")


def test_escape_ends_it_and_a_click_follows_a_ray_again(measuring: Viewer) -> None:
    plain = measuring.pixels("gl")
    click(measuring, STAIRS, FLOOR)
    assert (measuring.pixels("gl") != plain).any()
    measuring.page.keyboard.press("Escape")
    measuring.page.wait_for_timeout(100)
    assert measuring.page.is_hidden("#measured") and measuring.page.is_hidden("#distance")
    assert measuring.page.get_attribute("#measure", "aria-pressed") == "false"
    np.testing.assert_array_equal(measuring.pixels("gl"), plain)
    measuring.pick(*measuring.centre())
    assert measuring.page.is_visible("#card")
    measuring.page.evaluate("() => document.querySelector('#measure').click()")  # the panel covers it here
    assert measuring.page.is_hidden("#card") and measuring.page.is_visible("#measured")


@pytest.mark.parametrize("mode", ["gl", "phong", "brute", "proof"])
def test_the_line_is_drawn_in_every_mode(measuring: Viewer, mode: str) -> None:
    measuring.choose(mode)
    plain = measuring.pixels("gl")
    click(measuring, STAIRS, FLOOR)
    measuring.page.wait_for_selector("#distance:not([hidden])")
    drawn = (measuring.pixels("gl") != plain).any(axis=2)
    # The label is above the line, whose middle is seen.
    x, y = np.add(measuring.centre(), np.add(STAIRS, FLOOR) / 2)
    label, frame = (measuring.page.locator(name).bounding_box() for name in ("#distance", "#frame"))
    assert abs(label["x"] + label["width"] / 2 - x) < 3 and y - 40 < label["y"] + label["height"] < y
    column, row = round(x - frame["x"]), round(y - frame["y"])
    assert drawn[row - 2 : row + 3, column - 2 : column + 3].any() and 20 < drawn.sum() < 0.05 * drawn.size


def test_a_bound_is_rounded_up_to_a_digit(viewer: Viewer) -> None:
    bounds = [2.0**-k for k in range(30, 70)] + [1e-16, 9.5e-16, 1.04e-15, 5e-324]
    shown = viewer.page.evaluate(
        "async (bounds) => bounds.map((await import('./static/measure.js')).roundedUp)", bounds
    )
    for bound, text in zip(bounds, shown, strict=True):
        assert re.fullmatch(r"\de[+-]\d+", text) and bound <= float(text) <= 2.0 * bound


# The value under the pointer


def value_at(viewer: Viewer, x: float, y: float) -> str:
    """What the page says of a place of the window, once it does; until then it may say that of the one before."""
    viewer.page.mouse.move(x, y)
    viewer.page.wait_for_function(
        """([x, y]) => {
            const { at, waiting, said, seq } = viewer.pointed;
            return at?.[0] === x && at[1] === y && !waiting && said === seq;
        }""",
        arg=[x, y],
    )
    return viewer.page.inner_text("#pointed")


@cases("aov", ["color", "depth", "normal", "face", "cost", "nodes", "triangles"])
def test_the_pixel_under_the_pointer_has_its_value(viewer: Viewer, scenes: Path, aov: str) -> None:
    viewer.page.select_option("[name=aov]", aov)
    viewer.settled("octree")
    image = seen_by(viewer.camera, load_scene(scenes / "blocks.toml"), max_depth=3 if aov in ("color", "cost") else 0)
    (left, top), frame = viewer.centre(), viewer.page.locator("#frame").bounding_box()
    for place in (STAIRS, FLOOR):
        x, y = (int(a + b) for a, b in zip((left, top), place, strict=True))
        said = value_at(viewer, x, y)
        at = int(y - frame["y"]), int(x - frame["x"])
        numbers = [float(text) for text in re.findall(r"-?\d[\d.e-]*", said)]
        values = {"color": image.radiance, "depth": image.depth, "normal": image.normal, "face": image.face}
        values["cost"] = image.rays
        if aov in values:
            assert np.allclose(numbers, values[aov][at], rtol=5e-3, atol=5e-4), said
        else:
            assert len(numbers) == 1 and numbers[0] > 0
        assert re.match("Colour|Depth|Normal|Face|Cost|.* visited|.* tested", said)
    viewer.page.mouse.move(left, 5)
    assert viewer.page.inner_text("#pointed") == ""


def test_no_value_of_another_view_is_shown(viewer: Viewer) -> None:
    x, y = viewer.centre()
    assert value_at(viewer, x, y)
    late = """() => {
        const { pointed, scene } = viewer;
        const answer = { seq: pointed.seq, scene: scene.id, aov: "depth", value: 7 };
        const line = document.querySelector("#pointed"), seen = [];
        const say = (told) => (pointed.show(told), seen.push(line.textContent));
        say(answer);
        say({ ...answer, scene: "another" });
        say({ ...answer, seq: answer.seq - 1, value: 8 });
        viewer.camera.orbit(0.1, 0);
        viewer.moved();
        pointed.refresh();
        seen.push(line.textContent);
        say(answer);
        return seen;
    }"""
    assert viewer.page.evaluate(late) == ["Depth 7.0000"] * 3 + ["", ""]
    viewer.settled("octree")
    viewer.page.wait_for_function("() => document.querySelector('#pointed').textContent.startsWith('Colour')")
    viewer.choose("gl")
    assert viewer.page.inner_text("#pointed") == ""
