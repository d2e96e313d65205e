"""Pictures of a camera at rest: they grow finer by themselves, and say how much of an error is left."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_page import CHROMIUM, SCENE, Viewer

pytest.importorskip("uvicorn", reason="the extra viewer is not installed")

from viewer_client import Client, Got, rendered

import renderer
from renderer import load_scene
from renderer.picture.image import srgb
from renderer.viewer import passes

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("growth") / "blocks.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def url(scene: Path) -> Iterator[str]:
    with renderer.view(scene, browser=False) as viewing:
        yield viewing.url


@pytest.fixture
def client(url: str) -> Iterator[Client]:
    with Client(url) as client:
        yield client


def grown(client: Client, samples: int, **settings: Any) -> tuple[list[Got], list[dict[str, Any]]]:
    """All pictures of a view up to that number of samples, and what was told of them."""
    client.view(settings={"refine": samples, **settings})
    got, told = [], []
    while not (told and told[-1]["samples"] == samples):
        message = client.next()
        if isinstance(message, Got):
            got.append(message)
            client.acknowledge(message)
        else:
            told.append(message)
    return got, told


@pytest.mark.parametrize("banded", [False, True])
def test_a_picture_at_rest_grows_to_the_renderers_of_many_samples(
    client: Client, scene: Path, monkeypatch: pytest.MonkeyPatch, banded: bool
) -> None:
    if banded:
        monkeypatch.setattr(passes, "BAND_PIXELS", 10_000)
    got, told = grown(client, 64)
    assert [message["samples"] for message in told] == [4, 16, 64]
    full = [p for p in got if p.w == 200]
    number = 5 if banded else 1
    assert len(full) == 4 * number and all(p.last == ((i + 1) % number == 0) for i, p in enumerate(full))
    for i, samples in enumerate((1, 4, 16, 64)):
        seen = np.concatenate([p.rgb for p in full[i * number : (i + 1) * number]])
        assert np.array_equal(seen, srgb(rendered(load_scene(scene), samples=samples).radiance))


def test_the_error_that_is_told_is_near_the_one_that_is_left(client: Client, scene: Path) -> None:
    """By a picture of 1,024 samples, whose own error is a quarter of that of 64 at the most."""
    got, told = grown(client, 64)
    truth = srgb(rendered(load_scene(scene), samples=1024).radiance).astype(float)
    for message, picture in zip(told, [p for p in got if p.w == 200][1:], strict=True):
        left = float(np.sqrt(np.mean((picture.rgb - truth) ** 2)))
        # An estimate that errs towards more: by twice where errors fall as the number of samples instead of its root.
        assert left < message["error"] < 4.0 * left


@pytest.mark.parametrize("settings", [{"aov": "normal"}, {"samples": 16}, {"mode": "brute"}])
def test_what_cannot_grow_ends_as_before(client: Client, settings: dict[str, Any]) -> None:
    changes = {"mode": settings.pop("mode")} if "mode" in settings else {}
    seq = client.view(w=64, h=48, settings={"refine": 16, **settings}, **changes)
    client.passes(seq)
    new = client.view(w=32, h=32)
    first = client.next()
    assert isinstance(first, Got) and first.seq == new


def test_a_newer_view_comes_before_a_finer_picture(client: Client) -> None:
    old = client.view(w=1000, h=1000, settings={"refine": 64})
    client.passes(old)
    new = client.view(w=64, h=64)
    assert [got.seq for got in client.passes(new)][-1] == new


@needs_browser
def test_the_page_grows_its_picture_and_says_so(browser: Any, url: str, scene: Path) -> None:
    page = Viewer(browser, url, refine=True).open()
    page.page.wait_for_function(
        "() => document.querySelector('#hud').textContent.startsWith('16 samples a pixel, within')"
    )
    shown = page.camera
    from renderer.viewer.viewpoint import camera_of

    seen = load_scene(scene).model_copy(update={"camera": camera_of(shown["m"], shown["fovy"])})
    expected = renderer.render(seen, resolution=(shown["w"], shown["h"]), samples=16)
    assert np.array_equal(page.pixels("picture")[..., :3], srgb(expected.radiance))
    page.context.close()


@needs_browser
def test_what_is_copied_and_saved_has_the_samples_of_the_picture_that_is_seen(viewer: Viewer) -> None:
    """It had the one that the picture began with."""
    viewer.page.evaluate("() => { viewer.panel.fields.refine.value = '4'; viewer.changed('refine'); }")
    viewer.page.wait_for_function("() => document.querySelector('#hud').textContent.startsWith('4 samples')")
    asked = viewer.page.evaluate(
        """() => {
            const { connection } = viewer, samples = [];
            connection.send = ({ settings }) => samples.push(settings.samples);
            const press = () => ["copy-command", "save-camera"].map((id) => document.getElementById(id).click());
            press();
            viewer.camera.orbit(0.1, 0);
            viewer.moved(); // after which another picture is to come
            press();
            delete connection.send;
            return samples;
        }"""
    )
    assert asked == [4, 4, 1, 1]


@needs_browser
def test_what_is_left_of_an_error_is_read_only_of_the_picture_that_is_seen(viewer: Viewer) -> None:
    """It stayed in other modes and for other scenes."""
    read = viewer.page.evaluate(
        """() => {
            const { readings, scene } = viewer, picture = { kind: 1, step: 1, last: true, w: 8, h: 8, ms: 5, rate: 1 };
            const later = [
                () => readings.ofPicture({ ...picture, seq: 7 }, 6, 1, { w: 8, h: 8 }),
                () => readings.ofPicture({ ...picture, seq: 8 }, 6, 1, { w: 8, h: 8 }),
                () => readings.ofGl({ w: 8, h: 8 }), () => readings.ofScene(scene),
            ];
            return later.map((happens) => {
                readings.refined({ seq: 7, samples: 16, error: 0.5 });
                happens();
                return readings.values.refined.textContent;
            });
        }"""
    )
    assert read == ["16 samples a pixel, within about 0.50 of 255", "–", "–", "–"]
