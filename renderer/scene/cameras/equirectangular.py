"""A camera that sees all around: 360 degrees across the picture and 180 down."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from renderer.arguments.fields import stated
from renderer.arguments.types import ArrayLike
from renderer.scene.cameras.base import AngularCamera, Floats


class EquirectangularCamera(AngularCamera):
    """A camera that sees all around, as panoramas and environment maps have it.

    Longitude runs from -180 degrees at the left edge to 180 at the right one, latitude from 90 at the top to -90 at the
    bottom. A picture twice as wide as high has square pixels at its equator.

    Parameters
    ----------
    eye : array_like, shape (3,)
        The place of the camera.
    target : array_like, shape (3,)
        The point in the middle of the picture.
    up : array_like, shape (3,), default (0, 1, 0)
        The direction of the picture's top, if it is perpendicular to the view. Otherwise the picture is tilted with
        the view: for a level horizon put the target as high as the eye.

    Raises
    ------
    SceneError
        For values that are not finite, ``eye`` equal to ``target``, or ``up`` along the view.

    Examples
    --------
    >>> from renderer import EquirectangularCamera
    >>> camera = EquirectangularCamera(eye=(0, 0, 0), target=(0, 0, -1))
    >>> camera.project([[0, 0, -1], [1, 0, 0], [0, 1, 0]], (360, 180))[0].tolist()
    [[180.0, 90.0], [270.0, 90.0], [180.0, 0.0]]
    """

    type: Literal["equirectangular"] = "equirectangular"

    @stated
    def __init__(
        self,
        *,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 1.0, 0.0),
        type: Literal["equirectangular"] = "equirectangular",
    ) -> None: ...

    def _directions(self, x: Floats, y: Floats, width: int, height: int) -> Floats:
        longitude, latitude = (x / width - 0.5) * (2.0 * math.pi), (0.5 - y / height) * math.pi
        level = np.cos(latitude)
        return np.stack([level * np.sin(longitude), np.sin(latitude), level * np.cos(longitude)], axis=-1)

    def _film(self, across: Floats, above: Floats, ahead: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        level = np.hypot(across, ahead)
        longitude, latitude = np.arctan2(across, ahead), np.arctan2(above, level)
        x, y = (longitude / (2.0 * math.pi) + 0.5) * width, (0.5 - latitude / math.pi) * height
        nowhere = (level == 0.0) & (above == 0.0)
        return np.where(nowhere, np.nan, x), np.where(nowhere, np.nan, y)
