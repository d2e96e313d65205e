"""Files that the page saves: stills and turntables."""

from pathlib import Path

import numpy as np
from viewer_client import decoded, frames, seen_by
from viewer_page import Viewer

from renderer import load_scene


def shared(viewer: Viewer) -> None:
    viewer.page.evaluate("() => (document.querySelector('#share').open = true)")


def test_the_page_saves_a_still(viewer: Viewer, scenes: Path, tmp_path: Path) -> None:
    shared(viewer)
    before = viewer.pixels("picture")
    viewer.page.select_option("#still-size", "1920x1080")
    viewer.page.evaluate("() => (viewer.panel.fields.refine.value = '16')")  # as if the view had rested
    with viewer.page.expect_download() as download:
        viewer.page.click("#export-still")
        viewer.page.wait_for_selector("#exporting:not([hidden])")
        assert viewer.page.is_disabled("#export-still") and viewer.page.is_disabled("#export-turntable")
    assert download.value.suggested_filename == "blocks-1920x1080.png"
    download.value.save_as(tmp_path / "still.png")
    viewer.page.wait_for_selector("#exporting", state="hidden")
    assert viewer.page.is_enabled("#export-still") and "16 samples a pixel" in viewer.page.inner_text("#notices")
    # With as many samples as the view at rest.
    expected = seen_by(viewer.camera, load_scene(scenes / "blocks.toml"), resolution=(1920, 1080), samples=16).srgb
    assert np.array_equal(decoded((tmp_path / "still.png").read_bytes()), expected)
    assert np.array_equal(viewer.pixels("picture"), before)  # the view stays


def test_the_page_saves_a_still_of_the_views_own_shape(viewer: Viewer, tmp_path: Path) -> None:
    shared(viewer)
    viewer.page.select_option("#still-size", "2")
    with viewer.page.expect_download() as download:
        viewer.page.click("#export-still")
    download.value.save_as(tmp_path / "still.png")
    h, w = viewer.pixels("picture").shape[:2]
    assert decoded((tmp_path / "still.png").read_bytes()).shape == (2 * h, 2 * w, 3)


def test_the_page_saves_a_turntable(viewer: Viewer, tmp_path: Path) -> None:
    shared(viewer)
    for field, value in (("height", "240"), ("frames", "24"), ("format", "gif")):
        viewer.page.select_option(f"#turntable-{field}", value)
    with viewer.page.expect_download() as download:
        viewer.page.click("#export-turntable")
    assert download.value.suggested_filename == "blocks-turntable.gif"
    download.value.save_as(tmp_path / "turn.gif")
    seen = frames((tmp_path / "turn.gif").read_bytes())
    size = viewer.page.evaluate("() => window.viewer.size")
    assert len(seen) == 24 and seen[0].shape == (240, round(240 * size["w"] / size["h"]), 3)


def test_the_page_can_cancel_a_file(viewer: Viewer) -> None:
    shared(viewer)
    viewer.page.select_option("[name=samples]", "16")
    viewer.page.click("#export-still")
    viewer.page.wait_for_selector("#exporting:not([hidden])")
    viewer.page.click("#stop-export")
    viewer.page.wait_for_selector("#exporting", state="hidden")
    assert viewer.page.is_enabled("#export-still") and "3840" not in viewer.page.inner_text("#notices")
