"""The page's exposure, and the formats of a still."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow
from viewer_client import seen_by
from viewer_page import Viewer

from renderer import load_scene, srgb


def expose(viewer: Viewer, stops: str) -> None:
    viewer.page.locator("[name=exposure]").fill(stops)
    viewer.settled(viewer.page.evaluate("() => viewer.mode"))


def radiance(viewer: Viewer, scenes: Path) -> Any:
    return seen_by(viewer.camera, load_scene(scenes / "blocks.toml")).radiance


def test_the_picture_is_brighter_by_the_stops_and_undo_takes_them_back(viewer: Viewer, scenes: Path) -> None:
    dark = viewer.pixels("picture")
    expose(viewer, "1.5")
    assert viewer.page.inner_text("[name=exposure_shown]") == "+1.5"
    expected = srgb(radiance(viewer, scenes) * np.float32(2.0**1.5))
    assert np.array_equal(viewer.pixels("picture")[..., :3], expected)
    viewer.page.wait_for_function("() => viewer.past.timer === null")
    assert "exposure=1.5" in viewer.page.url
    viewer.page.click("#undo")
    viewer.page.wait_for_function("() => viewer.panel.settings.exposure === 0")
    viewer.settled("octree")
    assert np.array_equal(viewer.pixels("picture"), dark)


def test_other_values_than_colours_stay_as_they_are(viewer: Viewer) -> None:
    viewer.page.select_option("[name=aov]", "depth")
    viewer.settled("octree")
    before = viewer.pixels("picture")
    expose(viewer, "-3")
    assert np.array_equal(viewer.pixels("picture"), before)


def test_the_preview_is_as_bright_as_the_picture_and_flat_phong_says_that_it_is_not(viewer: Viewer) -> None:
    expose(viewer, "-1")
    corner = viewer.pixels("picture")[0, 0, :3].astype(int)  # the background
    viewer.choose("gl")
    assert np.abs(viewer.pixels("gl")[0, 0, :3] - corner).max() <= 1
    middle = viewer.pixels("gl").mean()
    expose(viewer, "1")
    assert viewer.pixels("gl").mean() > middle + 20
    viewer.choose("phong")
    assert viewer.page.is_disabled("[name=exposure]")


def saved(viewer: Viewer, kind: str, path: Path) -> str:
    """Save a still of that format to ``path``; the name that the page gives it."""
    viewer.page.evaluate("() => (document.querySelector('#share').open = true)")
    viewer.page.select_option("#still-size", "2")
    viewer.page.select_option("#still-format", kind)
    with viewer.page.expect_download() as download:
        viewer.page.click("#export-still")
    download.value.save_as(path)
    return download.value.suggested_filename


@pytest.mark.parametrize(("kind", "ending"), [("png", "png"), ("transparent", "png"), ("exr", "exr")])
def test_a_still_has_the_format_that_is_chosen(
    viewer: Viewer, scenes: Path, tmp_path: Path, kind: str, ending: str
) -> None:
    expose(viewer, "-2")
    size = [2 * side for side in viewer.pixels("picture").shape[1::-1]]
    seen = viewer.camera | dict(zip("wh", size, strict=True))
    image = seen_by(seen, load_scene(scenes / "blocks.toml"))
    path = tmp_path / f"still.{ending}"
    assert saved(viewer, kind, path) == f"blocks-{size[0]}x{size[1]}.{ending}"
    if kind == "exr":
        layers = pytest.importorskip("OpenEXR").File(str(path)).channels()
        assert np.array_equal(layers["RGB"].pixels, image.radiance / 4)
        assert np.array_equal(layers["Z"].pixels, image.depth.astype(np.float32))
        return
    with Pillow.open(path) as read:
        found = np.asarray(read)
    sky = image.face < 0
    assert np.array_equal(found[..., :3][~sky], srgb(image.radiance / 4)[~sky])
    if kind == "transparent":
        assert np.array_equal(found[..., 3], np.where(sky, 0, 255)) and not found[sky].any() and sky.any()
    else:
        assert found.shape[2] == 3


def test_a_still_of_depths_is_not_transparent(viewer: Viewer) -> None:
    viewer.page.select_option("[name=aov]", "depth")
    viewer.page.evaluate("() => (document.querySelector('#share').open = true)")
    viewer.page.select_option("#still-format", "transparent")
    viewer.page.click("#export-still")
    viewer.page.wait_for_function(
        "() => document.querySelector('#notices').textContent.includes(\"transparent: expected the picture in colour\")"
    )
    assert viewer.page.is_enabled("#export-still")
