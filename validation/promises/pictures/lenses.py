"""Cameras by the formulas of OpenCV's documentation, of the equidistant fish-eye and of the equirectangular map.

Directions are to the right, up and back, as the rows of gluLookAt's matrix.
"""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.scene.camera import (
    Camera,
    EquirectangularCamera,
    FisheyeCamera,
    OpenCVCamera,
    OpenCVFisheyeCamera,
    PinholeCamera,
)

Floats = NDArray[np.float64]
BY = "the projection's formula"
# Number of kinds of ``random``.
KINDS = 5
# Steps that invert a lens: as many as leave roundings alone on these films.
_STEPS = 120


def random(rng: Generator, kind: int, place: dict[str, Any], size: tuple[int, int]) -> Camera:
    """A random camera at a place, for a film of some size."""
    if kind == 0:
        return FisheyeCamera(**place, fov=float(rng.uniform(30.0, 360.0)))
    if kind == 1:
        return EquirectangularCamera(**place)
    lens = dict(zip(("fx", "fy"), rng.uniform(0.4, 2.0, 2) * max(size), strict=True))
    lens |= dict(zip(("cx", "cy"), rng.uniform(0.2, 0.8, 2) * size, strict=True))
    film = {"width": size[0], "height": size[1], "skew": float(rng.uniform(-0.1, 0.1) * max(size)), **lens}
    if kind == 2:
        return PinholeCamera(**place, **film)
    if kind == 3:
        return OpenCVCamera(**place, **film, **lens_of(rng))
    return OpenCVFisheyeCamera(**place, **film, k1=0.02, k2=float(rng.uniform(0.0, 0.01)), k4=1e-4)


def lens_of(rng: Generator) -> dict[str, Any]:
    """Coefficients of a lens whose picture goes on to all sides."""
    radial = rng.uniform((0.01, 0.002, 1e-4), (0.05, 0.006, 3e-4))
    return dict(zip(("k1", "k2", "k3", "p1", "p2"), (*radial, *rng.uniform(-0.01, 0.01, 2)), strict=True))


def bent(lens: dict[str, Any], x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The place at which a lens shows what a pinhole shows at (x, y)."""
    radial, aside, below = _parts(lens, x, y)
    return x * radial + aside, y * radial + below


def _parts(lens: dict[str, Any], x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """The radial factor and the two tangential terms of OpenCV's documentation."""
    square = x**2 + y**2
    radial = 1.0 + lens["k1"] * square + lens["k2"] * square**2 + lens["k3"] * square**3
    p1, p2 = lens["p1"], lens["p2"]
    return radial, 2.0 * p1 * x * y + p2 * (square + 2.0 * x**2), p1 * (square + 2.0 * y**2) + 2.0 * p2 * x * y


def _straight(lens: dict[str, Any], x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The inverse of ``bent``, by the iteration of ``cv2.undistortPoints``, far longer."""
    u, v = x, y
    for _ in range(_STEPS):
        radial, aside, below = _parts(lens, u, v)
        u, v = (x - aside) / radial, (y - below) / radial
    return u, v


def ways(camera: Camera, width: int, height: int) -> Floats:
    """The direction of each pixel, (height, width, 3); NaN where the film shows nothing."""
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    if isinstance(camera, EquirectangularCamera):
        turn, rise = 2.0 * np.pi * u / width - np.pi, np.pi / 2.0 - np.pi * v / height
        return np.stack([np.sin(turn) * np.cos(rise), np.sin(rise), -np.cos(turn) * np.cos(rise)], axis=-1)
    if isinstance(camera, FisheyeCamera):
        right, up = u - width / 2.0, height / 2.0 - v
        angle = np.radians(camera.fov) * np.sqrt(right**2 + up**2) / min(width, height)
        return _away(np.where(angle > np.radians(camera.fov) / 2.0, np.nan, angle), np.arctan2(up, right))
    assert isinstance(camera, PinholeCamera | OpenCVCamera | OpenCVFisheyeCamera)
    matrix = np.array([[camera.fx, camera.skew, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
    right, down, one = np.moveaxis(np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(matrix).T, -1, 0)
    if isinstance(camera, OpenCVCamera):
        lens = {name: getattr(camera, name) for name in ("k1", "k2", "k3", "p1", "p2")}
        right, down = _straight(lens, right, down)
    if isinstance(camera, PinholeCamera | OpenCVCamera):
        return np.stack([right, -down, -one], axis=-1)
    return _away(_undistorted(camera, np.sqrt(right**2 + down**2)), np.arctan2(-down, right))


def _away(angle: Floats, azimuth: Floats) -> Floats:
    """The directions at an angle from the axis, and at an azimuth from the right towards up."""
    return np.stack([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), -np.cos(angle)], axis=-1)


def _undistorted(camera: OpenCVFisheyeCamera, distance: Floats) -> Floats:
    """The angle of a ray at a distance from the principal point, by halving; NaN beyond a half turn."""
    least, most = np.zeros_like(distance), np.full_like(distance, np.pi)
    k = camera.k1, camera.k2, camera.k3, camera.k4

    def distorted(angle: Floats) -> Floats:
        return angle * (1.0 + k[0] * angle**2 + k[1] * angle**4 + k[2] * angle**6 + k[3] * angle**8)

    beyond = distorted(most) < distance
    for _ in range(60):
        middle = (least + most) / 2.0
        short = distorted(middle) < distance
        least, most = np.where(short, middle, least), np.where(short, most, middle)
    return np.where(beyond, np.nan, least)
