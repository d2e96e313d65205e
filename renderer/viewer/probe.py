"""The value that one pixel of a traced picture shows: what the picture's colours stand for."""

from typing import Any

from renderer.diagnostics.ray_cost import camera_steps
from renderer.picture.image import Image
from renderer.viewer.passes import STEPS, Pass, picture
from renderer.viewer.protocol import Probe
from renderer.viewer.shown import ShownScene
from renderer.viewer.viewpoint import camera_of


def probed(shown: ShownScene, asked: Probe) -> dict[str, Any]:
    """The message for ``asked``: linear RGB, depth, normal, face or a count; null for what the background has not."""
    aov = asked.settings.aov
    value = _steps(shown, asked) if aov in STEPS else _value(_row(shown, asked), aov, asked.x)
    return {"type": "probe", "seq": asked.seq, "scene": shown.id, "aov": aov, "value": value}


def _band(asked: Probe) -> tuple[int, int]:
    return asked.y, asked.y + 1


def _steps(shown: ShownScene, asked: Probe) -> int:
    prepared = shown.brute if asked.mode == "brute" else shown.prepared
    camera = camera_of(asked.m, asked.fovy, height=asked.height)
    steps = camera_steps(prepared, camera, (asked.w, asked.h), band=_band(asked))
    return int(getattr(steps, asked.settings.aov)[0, asked.x])


def _row(shown: ShownScene, asked: Probe) -> Image:
    """The pixel's row of the picture. By brute force it has one sample a pixel, and else the bits of the octree's."""
    samples = asked.settings.samples if asked.mode == "octree" else 1
    view = asked.model_copy(update={"mode": "octree"})
    return picture(shown, view, Pass(0, True, (asked.w, asked.h), samples, _band(asked)))


def _value(row: Image, aov: str, x: int) -> Any:
    if aov == "color":
        return row.radiance[0, x].tolist()
    if aov == "cost":
        return int(row.rays[0, x])
    return getattr(row, aov)[0, x].tolist() if row.face[0, x] >= 0 else None
