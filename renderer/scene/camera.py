"""All kinds of cameras as one type, and the rays of a whole picture."""

import math

import numpy as np
from numpy.typing import NDArray

from renderer.scene.cameras.base import BaseCamera
from renderer.scene.cameras.equirectangular import EquirectangularCamera
from renderer.scene.cameras.fisheye import FisheyeCamera
from renderer.scene.cameras.opencv import OpenCVCamera
from renderer.scene.cameras.opencv_fisheye import OpenCVFisheyeCamera
from renderer.scene.cameras.orthographic import OrthographicCamera
from renderer.scene.cameras.perspective import PerspectiveCamera
from renderer.scene.cameras.pinhole import PinholeCamera
from renderer.scene.cameras.thin_lens import ThinLensCamera

__all__ = [
    "Camera",
    "EquirectangularCamera",
    "FisheyeCamera",
    "OpenCVCamera",
    "OpenCVFisheyeCamera",
    "OrthographicCamera",
    "PerspectiveCamera",
    "PinholeCamera",
    "ThinLensCamera",
    "primary_rays",
    "sample_offsets",
]

Camera = (
    PerspectiveCamera
    | OrthographicCamera
    | PinholeCamera
    | OpenCVCamera
    | FisheyeCamera
    | OpenCVFisheyeCamera
    | EquirectangularCamera
    | ThinLensCamera
)


def sample_offsets(samples: int) -> NDArray[np.float64]:
    """Positions of a regular k x k grid in the unit pixel, (samples, 2) float64; the centre for one sample."""
    k = math.isqrt(max(samples, 0))
    if k < 1 or k * k != samples:
        raise ValueError(f"samples: expected a square number (1, 4, 9, ...), got {samples}")
    centres = (np.arange(k) + 0.5) / k
    y, x = np.meshgrid(centres, centres, indexing="ij")
    return np.stack([x.ravel(), y.ravel()], axis=1)


def primary_rays(
    camera: BaseCamera, width: int, height: int, offset: tuple[float, float] = (0.5, 0.5)
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rays through one position in every pixel, in scanline order from the top left.

    Returns origins and unit directions, each (height * width, 3) float64.
    """
    origins, directions = camera.primary_rays((width, height), offset)
    return origins.reshape(-1, 3), directions.reshape(-1, 3)
