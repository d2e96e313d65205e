"""Large pictures on the page: the screen's own pixels, and bands drawn over the picture before."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from viewer_client import seen_by
from viewer_page import Viewer

from renderer import load_scene
from renderer.viewer import passes
from renderer.viewer.protocol import CameraMessage


@pytest.fixture(scope="module")
def dense(browser: Any, url: str) -> Iterator[Viewer]:
    """A page on a screen with two device pixels along each CSS pixel's side."""
    with Viewer(browser, url, viewport={"width": 1180, "height": 760}, device_scale_factor=2).open() as page:
        yield page


def test_pictures_have_the_screens_pixels(dense: Viewer, scenes: Path) -> None:
    """They had at most 1,024 along a side and were stretched: the best mode was the blurriest."""
    stage = dense.page.evaluate("() => [viewer.stage.clientWidth, viewer.stage.clientHeight]")
    assert [dense.camera["w"], dense.camera["h"]] == [2 * side for side in stage]
    assert dense.camera["w"] * dense.camera["h"] > passes.BAND_PIXELS
    expected = seen_by(dense.camera, load_scene(scenes / "blocks.toml"))
    assert np.array_equal(dense.pixels("picture")[..., :3], expected.srgb)


def test_bands_are_drawn_over_the_whole_picture_before(dense: Viewer) -> None:
    """Rows that have not come yet show the coarse picture: none is empty, and none of another camera."""
    dense.page.evaluate(
        """() => {
            const { picture } = viewer, { show } = picture;
            window.empty = [];
            picture.show = async (arrived) => {
                await show.call(picture, arrived);
                const { width, height } = picture.canvas;
                const copy = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
                copy.drawImage(picture.canvas, 0, 0);
                const below = copy.getImageData(0, 0, width, height).data;
                let holes = 0;
                for (let i = 3; i < below.length; i += 4) holes += below[i] !== 255;
                window.empty.push([arrived.first, arrived.rows, arrived.h, height, holes]);
            };
        }"""
    )
    dense.page.locator("#stage").press("ArrowLeft")
    dense.settled("octree")
    drawn = dense.page.evaluate("() => { delete viewer.picture.show; return window.empty; }")
    assert all(height == h and holes == 0 for _, _, h, height, holes in drawn)
    assert sum(rows < h for _, rows, h, *_ in drawn) > 1


@cases(
    ("stage", "chosen", "density", "expected"),
    [
        ([980, 747], "1", 1, [980, 747]),
        ([980, 747], "1", 2, [1960, 1494]),
        ([980, 747], "0.5", 1, [490, 374]),
        ([2560, 1400], "1", 2, None),
        ([390, 500], "1", 3, [1170, 1500]),
        ([980, 747], "5000x100", 1, [4096, 81]),
        ([980, 747], "4096x4096", 1, None),
    ],
)
def test_the_size_is_what_the_server_allows(
    dense: Viewer, stage: list[int], chosen: str, density: float, expected: list[int] | None
) -> None:
    found = dense.page.evaluate(
        """async (given) => (await import("./static/film.js")).film(given[0], given[1], [320, 240], given[2])""",
        [stage, chosen, density],
    )
    w, h = found["size"]["w"], found["size"]["h"]
    # The server's check lets it through.
    CameraMessage(type="view", seq=1, mode="octree", m=np.eye(4).ravel().tolist(), fovy=0.7, w=w, h=h)
    if expected:
        assert [w, h] == expected
    else:
        assert w * h > 0.99 * 2**23
