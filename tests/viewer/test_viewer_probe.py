"""The value of one pixel: the one that the picture on the page is drawn from."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from viewer_client import SIZE, Client, looking

from renderer.diagnostics.ray_cost import camera_steps
from renderer.viewer.passes import Pass, picture
from renderer.viewer.probe import probed
from renderer.viewer.protocol import parse
from renderer.viewer.shown import ShownScene, open_file
from renderer.viewer.viewpoint import camera_of

PLACES = [(140, 100), (70, 60), (3, 3), (100, 130)]


@pytest.fixture(scope="module")
def shown(scene: Path) -> ShownScene:
    return open_file(scene)


def asked(kind: str, mode: str, settings: dict[str, Any], **more: Any) -> Any:
    view = {"type": kind, "seq": 1, "mode": mode, **looking((0.5, 2.6, 5.5)), **SIZE}
    return parse(json.dumps({**view, "settings": settings, **more}))


def expected(shown: ShownScene, mode: str, settings: dict[str, Any]) -> list[Any]:
    """The values of the whole picture at PLACES; None where there is no surface to have one."""
    aov, view = settings["aov"], asked("view", mode, settings)
    if aov in ("nodes", "triangles"):
        prepared = shown.brute if mode == "brute" else shown.prepared
        values = getattr(camera_steps(prepared, camera_of(view.m, view.fovy), (200, 150)), aov)
        return [values[y, x] for x, y in PLACES]
    # By itself brute force has one sample a pixel.
    image = picture(shown, view, Pass(0, True, (200, 150), settings["samples"] if mode == "octree" else 1))
    values = {"color": image.radiance, "cost": image.rays}.get(aov)
    if values is not None:
        return [values[y, x] for x, y in PLACES]
    return [getattr(image, aov)[y, x] if image.face[y, x] >= 0 else None for x, y in PLACES]


@cases("mode", ["octree", "brute"])
@cases("aov", ["color", "depth", "normal", "face", "cost", "nodes", "triangles"])
def test_a_pixel_has_the_value_that_the_picture_shows(shown: ShownScene, aov: str, mode: str) -> None:
    settings = {"aov": aov, "samples": 4, "max_depth": 3}
    values = expected(shown, mode, settings)
    for (x, y), value in zip(PLACES, values, strict=True):
        told = probed(shown, asked("probe", mode, settings, x=x, y=y))
        assert (told["aov"], told["scene"], told["seq"]) == (aov, shown.id, 1)
        assert told["value"] is None if value is None else np.array_equal(told["value"], value)
    assert len({str(value) for value in values}) > 1 or (mode == "brute" and aov in ("nodes", "triangles"))
    assert any(value is None for value in values) == (aov in ("depth", "normal", "face"))  # the sky


def test_a_page_asks_for_a_pixel(client: Client) -> None:
    at = {"x": 140, "y": 100, **looking((0.5, 2.6, 5.5)), **SIZE}
    client.send(type="pick", seq=1, **at)
    face = client.told("pick")["face"]
    client.send(type="probe", seq=5, mode="octree", settings={"aov": "face"}, **at)
    told = client.told("probe")
    assert told["seq"] == 5 and told["value"] == face is not None
