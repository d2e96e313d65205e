"""Milliseconds from a camera message to its pictures in the viewer, over a real socket.

    python -m validation.benchmark.measures.viewing [SCENE] [--views N]

Medians over cameras along a turn, each picture acknowledged as by the page. The browser's drawing time is not included.
"""

import argparse
import json
import math
import statistics
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import connect
from websockets.typing import Origin

import renderer
from renderer.scene.camera import PerspectiveCamera
from renderer.viewer.protocol import HEADER
from validation.scenes import SCENES

_SIZE = 512
# Radians of one step of the turn; each step shows other parts of the scene.
_STEP = 0.05
# First views that are not timed: kernels load, threads start.
_UNSEEN = 3


def main() -> None:
    """Measure and print the results."""
    parser = argparse.ArgumentParser(description="Time the viewer's answers.")
    parser.add_argument("scene", nargs="?", type=Path, default=SCENES / "three_models.toml")
    parser.add_argument("--views", type=int, default=25)
    options = parser.parse_args()
    for mode in ("octree", "phong"):
        for label, seconds in measure(options.scene, mode, options.views).items():
            low, middle, high = min(seconds), statistics.median(seconds), max(seconds)
            print(f"{mode}, {label}: median {1e3 * middle:.1f} ms, {1e3 * low:.1f} to {1e3 * high:.1f}")


def measure(file: Path, mode: str, views: int) -> dict[str, list[float]]:
    """Seconds from sending a view to the last byte of each of its pictures, by the picture's size."""
    camera = renderer.load_scene(file).camera
    assert isinstance(camera, PerspectiveCamera), "the viewer's camera is a perspective one"
    seconds: dict[str, list[float]] = defaultdict(list)
    with renderer.view(file, browser=False) as viewing:
        url = viewing.url.replace("http", "ws", 1).rstrip("/") + "/ws"
        with connect(url, origin=Origin(viewing.url.rstrip("/")), max_size=None) as socket:
            for number in range(_UNSEEN + views):
                began, last = time.perf_counter(), 0
                socket.send(json.dumps(_view(camera, mode, number)))
                while not last:
                    message = socket.recv()
                    assert isinstance(message, bytes), message
                    _, seq, step, last, width, height, *_ = HEADER.unpack_from(message)
                    if number >= _UNSEEN:
                        what = "colours" if mode == "phong" else f"{width} x {height}"
                        seconds[what].append(time.perf_counter() - began)
                    socket.send(json.dumps({"type": "ack", "seq": seq, "step": step}))
    return seconds


def _view(camera: PerspectiveCamera, mode: str, number: int) -> dict[str, Any]:
    """The message for a camera turned by ``number`` steps about the vertical through its target."""
    x, y, z = np.subtract(camera.eye, camera.target).tolist()
    c, s = math.cos(_STEP * number), math.sin(_STEP * number)
    eye = np.add(camera.target, (c * x + s * z, y, c * z - s * x))
    turned = camera.model_copy(update={"eye": tuple(eye.tolist())})
    right, up, forward = turned.frame()
    columns = [*right, 0.0, *up, 0.0, *-forward, 0.0, *eye, 1.0]
    return {"type": "view", "seq": number, "mode": mode, "m": [float(v) for v in columns],
            "fovy": math.radians(camera.fov), "w": _SIZE, "h": _SIZE}  # fmt: skip


if __name__ == "__main__":
    main()
