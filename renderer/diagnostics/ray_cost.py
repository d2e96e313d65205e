"""The cost of camera rays: the nodes and triangles that each of them tests."""

from collections.abc import Callable

import numpy as np

from renderer.picture.prepare import PreparedScene
from renderer.results.steps import Steps
from renderer.scene.camera import Camera

# Rays of a call: of so many their arrays take a few megabytes, and Ctrl-C waits some 10 ms.
_RAYS = 1 << 16


def camera_steps(
    prepared: PreparedScene,
    camera: Camera,
    size: tuple[int, int],
    finished: Callable[[float], object] | None = None,
    band: tuple[int, int] | None = None,
) -> Steps:
    """The steps of the ray through each pixel's centre, (h, w) each, of a picture of ``size`` (w, h); of a ``band`` of
    rows, first and end, only these.

    ``finished(share)`` is called with the share of the picture counted since the last call. An exception from it ends
    the counting.
    """
    width, height = size
    steps = []
    at_a_time, (begin, end) = max(1, _RAYS // width), band or (0, height)
    x = np.arange(width) + 0.5
    for first in range(begin, end, at_a_time):
        y = np.arange(first, min(first + at_a_time, end)) + 0.5
        pixels = np.stack(np.meshgrid(x, y), axis=-1)
        steps.append(prepared.octree.count_steps(*camera.rays(pixels, size)))
        if finished is not None:
            finished(len(y) / (end - begin))
    return Steps(*(np.concatenate([getattr(some, name) for some in steps]) for name in ("nodes", "triangles")))
