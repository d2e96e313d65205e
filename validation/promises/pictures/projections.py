"""Points on films: where OpenCV's formulas say that lenses of its own models show them."""

from typing import Any

import numpy as np
from numpy.random import Generator

from renderer.scene.camera import OpenCVCamera, OpenCVFisheyeCamera
from validation.promises.pictures import lenses
from validation.promises.pictures.lenses import Floats
from validation.promises.row import row

_BY = "OpenCV's formula"
_ROUNDING = 1e-11


def check_projections(rng: Generator, count: int) -> list[dict[str, Any]]:
    """Points before cameras of OpenCV's matrices, where the centre of the first pixel is at (0, 0)."""
    off: dict[str, list[Floats]] = {"lens": [], "fish-eye": []}
    for _ in range(count):
        turn, move = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
        turn *= np.linalg.det(turn)
        (fx, fy), (cx, cy) = rng.uniform(20.0, 900.0, (2, 2))
        film = np.array([[fx, 3.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        ahead = rng.uniform((-1.0, -1.0, 0.5), (1.0, 1.0, 4.0), (40, 3))
        lens, k = lenses.lens_of(rng), rng.uniform(0.0, (0.02, 0.01, 0.001, 1e-4))
        given: dict[str, Any] = {"R": turn, "t": move, "width": 640, "height": 480}
        order = [lens[name] for name in ("k1", "k2", "p1", "p2", "k3")]
        for name, camera, plane in (
            (
                "lens",
                OpenCVCamera.from_opencv(film, order, **given),
                lenses.bent(lens, *(ahead[:, :2] / ahead[:, 2:]).T),
            ),
            ("fish-eye", OpenCVFisheyeCamera.from_opencv(film, k, **given), _fisheye(k, ahead)),
        ):
            expected = np.stack([*plane, np.ones(len(ahead))], axis=-1) @ film[:2].T
            found = camera.project((ahead - move) @ turn)[0] - 0.5
            off[name].append(np.abs(found - expected).max(axis=1) / np.abs(expected).max())
    return [row(f"points appear where a {name} of OpenCV's shows them", _BY, np.concatenate(each) <= _ROUNDING)
            for name, each in off.items()]  # fmt: skip


def _fisheye(k: Floats, ahead: Floats) -> tuple[Floats, Floats]:
    """Points on a fish-eye's film, in focal lengths."""
    x, y = (ahead[:, :2] / ahead[:, 2:]).T
    r = np.sqrt(x**2 + y**2)
    theta = np.arctan(r)
    share = theta * (1.0 + k @ [theta**2, theta**4, theta**6, theta**8]) / r
    return share * x, share * y
