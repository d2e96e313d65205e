"""The passes of a picture: in bands where it is large, finer at rest, with a scale where it shows counts."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from viewer_client import Client, Got, looking, rendered

from renderer import load_scene
from renderer.diagnostics import ray_cost
from renderer.diagnostics.false_color import shades_of
from renderer.diagnostics.ray_cost import camera_steps
from renderer.picture.image import srgb
from renderer.picture.prepare import PreparedScene
from renderer.scene.camera import primary_rays
from renderer.viewer import passes
from renderer.viewer.passes import passes_of
from renderer.viewer.protocol import CameraMessage, ViewSettings
from renderer.viewer.shown import open_file
from renderer.viewer.viewpoint import camera_of

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


def grown(client: Client, samples: int, **size: int) -> tuple[list[Got], list[dict[str, Any]]]:
    """All pictures of a view up to that number of samples, and what was told of them."""
    client.view(settings={"refine": samples}, **size)
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
        monkeypatch.setattr(passes, "BAND_PIXELS", 3_000)
    got, told = grown(client, 64, w=64, h=75)
    assert [message["samples"] for message in told] == [4, 16, 64]
    full = [p for p in got if p.w == 64]
    number = 3 if banded else 1
    assert len(full) == 4 * number and all(p.last == ((i + 1) % number == 0) for i, p in enumerate(full))
    for i, samples in enumerate((1, 4, 16, 64)):
        seen = np.concatenate([p.rgb for p in full[i * number : (i + 1) * number]])
        assert np.array_equal(seen, srgb(rendered(load_scene(scene), resolution=(64, 75), samples=samples).radiance))


def test_the_error_that_is_told_is_near_the_one_that_is_left(client: Client, scene: Path) -> None:
    """By a picture of 1,024 samples, whose own error is a quarter of that of 64 at the most."""
    got, told = grown(client, 64, w=40, h=30)
    truth = srgb(rendered(load_scene(scene), resolution=(40, 30), samples=1024).radiance).astype(float)
    for message, picture in zip(told, got[-3:], strict=True):
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
    old = client.view(w=500, h=500, settings={"refine": 64})
    client.passes(old)
    new = client.view(w=64, h=64)
    assert [got.seq for got in client.passes(new)][-1] == new


@pytest.fixture(scope="module")
def prepared(scene: Path) -> PreparedScene:
    return open_file(scene).prepared


@pytest.mark.parametrize("aov", ["nodes", "triangles"])
def test_the_heat_map_is_that_of_the_counted_steps(client: Client, prepared: PreparedScene, aov: str) -> None:
    eye = (4.0, 0.4, 3.0)
    client.view(eye, w=100, h=75, settings={"aov": aov})
    view = looking(eye)
    origins, directions = primary_rays(camera_of(view["m"], view["fovy"]), 100, 75)
    counts = getattr(prepared.octree.count_steps(origins, directions), aov).reshape(75, 100)
    high = np.sort(counts.ravel())[-counts.size // 100]  # the count that 1 % of pixels exceed
    told, got = client.next(), client.next()
    assert isinstance(told, dict) and isinstance(got, Got)
    assert (told["type"], told["aov"], told["low"], told["high"]) == ("legend", aov, counts.min(), high)
    assert told["colors"][0] == [68, 1, 84] and told["colors"][-1] == [253, 231, 37]  # viridis
    # Rays through rounded directions may enter another box at its very edge.
    assert (got.rgb == shades_of(counts, counts.min(), high)).all(axis=2).mean() > 0.999
    assert len(np.unique(counts)) > 3


def test_brute_force_tests_all_triangles_and_no_node(client: Client, prepared: PreparedScene) -> None:
    for aov, number in (("nodes", 0), ("triangles", len(prepared.mesh.faces))):
        client.view(mode="brute", w=40, h=30, settings={"aov": aov})
        while (told := client.next())["type"] == "progress":  # type: ignore[index]
            pass
        assert isinstance(told, dict) and told["low"] == told["high"] == number
        got = client.next()
        assert isinstance(got, Got)
        client.acknowledge(got)


def test_steps_are_counted_in_parts_that_are_the_whole(
    prepared: PreparedScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, shares = prepared.scene.camera, list[float]()
    whole = camera_steps(prepared, camera, (64, 48))
    monkeypatch.setattr(ray_cost, "_RAYS", 300)
    parts = camera_steps(prepared, camera, (64, 48), shares.append)
    assert whole.nodes.shape == (48, 64) and len(shares) == 12 and sum(shares) == pytest.approx(1.0, abs=1e-12)
    assert np.array_equal(parts.nodes, whole.nodes) and np.array_equal(parts.triangles, whole.triangles)
