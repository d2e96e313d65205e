"""Pictures of a camera at rest: they grow finer by themselves, and say how much of an error is left."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_client import Client, Got, rendered

from renderer import load_scene
from renderer.picture.image import srgb
from renderer.viewer import passes


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
