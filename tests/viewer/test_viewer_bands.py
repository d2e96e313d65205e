"""Pictures of the screen's own pixels: traced band by band, and drawn where they belong."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from viewer_client import Client, Got, rendered
from viewer_page import SCENE

import renderer
from renderer import load_scene
from renderer.picture.image import srgb
from renderer.viewer import passes
from renderer.viewer.passes import passes_of
from renderer.viewer.protocol import CameraMessage, ViewSettings

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


def test_the_bands_together_are_the_renderers_picture(client: Any) -> None:
    *_, last = got = client.passes(client.view(settings={"samples": 4}))
    bands = [p for p in got if p.rows < p.h]
    assert len(bands) == 5 and last is bands[-1] and (last.w, last.h) == (200, 150)
    assert [(p.first, p.rows) for p in bands] == [(0, 32), (32, 32), (64, 32), (96, 32), (128, 22)]
    expected = srgb(rendered(client.scene, samples=4).radiance)
    assert np.array_equal(np.concatenate([p.rgb for p in bands]), expected)


def test_a_newer_view_does_not_wait_for_all_bands(client: Any) -> None:
    old = client.view(settings={"samples": 64})
    first = client.next()
    new = client.view(w=64, h=64)
    assert isinstance(first, Got)
    client.acknowledge(first)
    got = client.passes(new)
    assert len([p for p in got if p.seq == old]) <= 1
