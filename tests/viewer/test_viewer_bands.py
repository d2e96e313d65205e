"""Pictures of the screen's own pixels: traced band by band, and drawn where they belong."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from viewer_page import CHROMIUM, SCENE, Viewer

pytest.importorskip("uvicorn", reason="the extra viewer is not installed")

from viewer_client import Client, Got, rendered

import renderer
from renderer import load_scene
from renderer.picture.image import srgb
from renderer.viewer import passes
from renderer.viewer.passes import passes_of
from renderer.viewer.protocol import CameraMessage, ViewSettings

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium")
M = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.5, 1.0, 4.0, 1.0]


def view(w: int, h: int, **settings: Any) -> CameraMessage:
    asked = ViewSettings.model_validate(settings)
    return CameraMessage(type="view", seq=1, mode="octree", m=M, fovy=0.7, w=w, h=h, settings=asked)


@cases(("w", "h"), [(4096, 2048), (2048, 4096), (1620, 1030), (1025, 1024), (4096, 257)])
def test_the_bands_of_a_large_picture_are_its_rows(w: int, h: int) -> None:
    (*small,) = (p for p in passes_of(view(w, h)) if p.band is None)
    bands = [p for p in passes_of(view(w, h)) if p.band is not None]
    assert all(p.size[0] * p.size[1] <= w * h / 4 and not p.last for p in small)
    rows = [y for p in bands for y in range(*p.band)]
    assert rows == list(range(h)) and len(bands) > 1
    assert [p.last for p in bands] == [False] * (len(bands) - 1) + [True]
    assert all(p.size == (w, h) and (p.band[1] - p.band[0]) * w <= passes.BAND_PIXELS for p in bands)
    assert [p.step for p in (*small, *bands)] == list(range(len(small) + len(bands)))


def test_a_picture_that_is_not_large_or_on_a_scale_of_its_own_comes_whole() -> None:
    assert [p.band for p in passes_of(view(1024, 1024))][-1] is None
    for aov in ("depth", "cost"):
        assert [p.band for p in passes_of(view(2048, 2048, aov=aov))][-1] is None


@pytest.fixture
def client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Client]:
    """A page of a server whose bands have 10,000 pixels."""
    monkeypatch.setattr(passes, "BAND_PIXELS", 10_000)
    (tmp_path / "blocks.toml").write_text(SCENE)
    with renderer.view(tmp_path / "blocks.toml", browser=False) as viewing, Client(viewing.url) as client:
        client.scene = load_scene(tmp_path / "blocks.toml")
        yield client


@pytest.mark.parametrize("settings", [{}, {"samples": 4}, {"aov": "normal"}])
def test_the_bands_together_are_the_renderers_picture(client: Any, settings: dict[str, Any]) -> None:
    *_, last = got = client.passes(client.view(settings=settings))
    bands = [p for p in got if p.rows < p.h]
    assert len(bands) == 5 and last is bands[-1] and (last.w, last.h) == (200, 150)
    assert [(p.first, p.rows) for p in bands] == [(0, 32), (32, 32), (64, 32), (96, 32), (128, 22)]
    if "aov" not in settings:
        expected = srgb(rendered(client.scene, **settings).radiance)
        assert np.array_equal(np.concatenate([p.rgb for p in bands]), expected)


def test_a_newer_view_does_not_wait_for_all_bands(client: Any) -> None:
    old = client.view(settings={"samples": 64})
    first = client.next()
    new = client.view(w=64, h=64)
    assert isinstance(first, Got)
    client.acknowledge(first)
    got = client.passes(new)
    assert len([p for p in got if p.seq == old]) <= 1


@pytest.fixture(scope="module")
def dense(browser: Any, url: str) -> Iterator[Viewer]:
    """A page on a screen with two device pixels along each CSS pixel's side."""
    page = Viewer(browser, url, viewport={"width": 1180, "height": 760}, device_scale_factor=2).open()
    yield page
    page.context.close()


@needs_browser
def test_pictures_have_the_screens_pixels(dense: Viewer, scenes: Path) -> None:
    """They had at most 1,024 along a side and were stretched: the best mode was the blurriest."""
    stage = dense.page.evaluate("() => [viewer.stage.clientWidth, viewer.stage.clientHeight]")
    assert [dense.camera["w"], dense.camera["h"]] == [2 * side for side in stage]
    assert dense.camera["w"] * dense.camera["h"] > passes.BAND_PIXELS
    scene, shown = load_scene(scenes / "blocks.toml"), dense.camera
    from renderer.viewer.viewpoint import camera_of

    seen = scene.model_copy(update={"camera": camera_of(shown["m"], shown["fovy"])})
    expected = renderer.render(seen, resolution=(shown["w"], shown["h"]))
    assert np.array_equal(dense.pixels("picture")[..., :3], srgb(expected.radiance))


@needs_browser
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


@needs_browser
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
    assert view(w, h).w == w  # which the server's check lets through
    if expected:
        assert [w, h] == expected
    else:
        assert w * h > 0.99 * 2**23
