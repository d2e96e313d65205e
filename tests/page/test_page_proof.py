"""The proof on the page: both pictures, their difference, and what stands for which view."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from viewer_page import Viewer


@pytest.fixture(scope="module")
def page(browser: Any, url: str) -> Iterator[Viewer]:
    with Viewer(browser, url, viewport={"width": 900, "height": 560}).open() as page:
        yield page


def kept(page: Viewer) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    page.settled("proof")
    return page.pixels("picture"), page.page.evaluate("() => viewer.proof.told")


def test_no_difference_is_said_of_a_comparison_alone(page: Viewer) -> None:
    """It stood on the picture before one came, and stayed in every other mode."""
    page.page.evaluate("() => { viewer.proof.forget(); viewer.proof.toggle(); }")
    assert page.page.is_hidden("#no-difference")
    page.page.evaluate("() => viewer.proof.toggle()")


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


def test_a_clicked_pixel_of_the_proof_shows_both_values(page: Viewer) -> None:
    page.page.evaluate("() => (viewer.panel.fields.pair.value = 'brute')")
    page.choose("proof")
    x, y = page.centre()
    page.page.mouse.click(x + 60, y + 20)
    page.page.wait_for_selector("#card:not([hidden]) .values")
    rows = page.page.locator("#card .values tr").all_inner_texts()
    assert len(rows) == 3 and rows[0].split()[1:] == rows[1].split()[2:]  # "octree", "brute force"
    assert "Identical to the bit, the same" in page.page.inner_text("#card")
    page.page.locator("#stage").press("Escape")
    page.choose("octree")


def test_nothing_of_a_proof_stands_for_another_view(page: Viewer) -> None:
    """A verdict belongs to one camera, one pair and one scene."""
    page.choose("proof")
    assert page.page.inner_text("#proof output")
    said = """() => {
        viewer.camera.orbit(0.3, 0);
        viewer.moved();
        return document.querySelector("#proof output").value;  // at once, before another is computed
    }"""
    assert page.page.evaluate(said) == ""
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


def test_the_values_on_the_card_are_those_of_the_proof_that_stands(page: Viewer) -> None:
    """After an edit they stayed those of the scene before, for ever."""
    page.page.select_option("[name=size]", "0.25")
    page.page.evaluate("() => (viewer.panel.fields.pair.value = 'brute')")
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
        page.page.wait_for_function("() => !viewer.traced.dirty")
        assert page.page.evaluate(seen) == ["", False, False]  # the picture stands until the next one comes
        page.page.evaluate("() => viewer.cancel()")
        page.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert page.page.evaluate(seen) == ["", True, True]
    finally:
        page.page.evaluate("() => { delete viewer.connection.send; }")
        page.restart()
