"""Views that are kept, and the bar that says how large things are."""

import numpy as np
import pytest
from viewer_page import Viewer


def test_a_kept_view_is_seen_again_after_the_page_is_loaded_again(viewer: Viewer) -> None:
    """With its settings; and it is gone once it is removed."""
    viewer.drag(60, 20)
    viewer.page.locator("[name=max_depth]").fill("2")
    viewer.settled("octree")
    kept = viewer.camera
    viewer.page.click("#keep-view")
    viewer.page.click("#sides >> text=Back")
    viewer.page.locator("[name=max_depth]").fill("5")
    viewer.settled("octree")
    viewer.page.click("#keep-view")
    viewer.page.reload()
    viewer.page.wait_for_selector("body[data-ready]")
    viewer.settled("octree")
    assert viewer.camera != kept
    viewer.page.click("#views >> text=View 1")
    viewer.wait_until(lambda: viewer.camera == kept)
    assert viewer.page.input_value("[name=max_depth]") == "2"
    viewer.page.click("[aria-label='Remove View 1']")
    viewer.page.click("#keep-view")
    assert viewer.page.locator("#views button:not(.remove)").all_inner_texts() == ["View 2", "View 3"]
    for name in ("View 2", "View 3"):
        viewer.page.click(f"[aria-label='Remove {name}']")
    assert viewer.page.locator("#views li").count() == 0


def test_kept_views_that_are_none_do_not_stop_the_page(viewer: Viewer) -> None:
    kept = '{"blocks.toml": [3, {"name": 5}, {"name": "View 1", "address": "#mode=gl"}]}'
    for content in ('{"blocks.toml": 5}', kept):
        viewer.page.evaluate("(content) => localStorage.setItem('octree-render-views', content)", content)
        viewer.page.reload()
        viewer.page.wait_for_selector("body[data-ready]")
        viewer.settled("octree")
    assert viewer.page.locator("#views li").count() == 1
    viewer.page.evaluate("() => localStorage.removeItem('octree-render-views')")


@pytest.mark.parametrize("size", [3e-9, 0.02, 1.0, 7.3, 999.0, 4e8])
def test_the_scale_bar_is_as_long_as_it_says(viewer: Viewer, size: float) -> None:
    """And between a half and all of the room that it has, by a round number."""
    width, text = viewer.page.evaluate(
        """(height) => {
            const { scale, camera } = viewer;
            scale.show(Object.assign(Object.create(camera), { height }), 500);
            return [parseFloat(scale.bar.style.width), scale.bar.textContent];
        }""",
        size,
    )
    length = float(text.replace(",", ""))
    assert 52 <= width <= 130 and text.strip("0.,E-")[:1] in "125"
    np.testing.assert_allclose(width / 500 * size, length, rtol=1e-5)  # styles keep six digits


def test_the_scale_bar_measures_what_the_pivot_is_as_far_away_as(viewer: Viewer) -> None:
    """A step in the film's plane through the pivot has on the screen the length of the bar that says so."""
    viewer.page.evaluate("() => { viewer.camera.fit(1.6); viewer.moved(); }")
    viewer.settled("octree")
    frame = viewer.page.locator("#frame").bounding_box()["height"]
    width, text = viewer.page.evaluate("() => [parseFloat(viewer.scale.bar.style.width), viewer.scale.bar.textContent]")
    pivot = np.array(viewer.page.evaluate("() => viewer.camera.pivot"))
    m = np.reshape(viewer.camera["m"], (4, 4))
    step = pivot + float(text.removeprefix("≈ ")) * m[0, :3] - m[3, :3]
    seen = step @ m[0, :3] / -(step @ m[2, :3]) / np.tan(viewer.camera["fovy"] / 2) * frame / 2
    assert width == pytest.approx(seen, rel=1e-5)
