"""A fish-eye whose picture is equidistant: the distance from its middle is proportional to the angle."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from renderer.arguments.fields import in_degrees, stated
from renderer.arguments.types import ArrayLike
from renderer.scene.cameras.base import AngularCamera, Floats


def turned_away(angle: Floats, right: Floats, down: Floats) -> Floats:
    """Unit directions (..., 3) to the right, up and forward, ``angle`` away from forward towards (right, down)."""
    length = np.hypot(right, down)
    share = np.sin(angle) / np.where(length > 0.0, length, 1.0)
    return np.stack([right * share, -down * share, np.cos(angle)], axis=-1)


class FisheyeCamera(AngularCamera):
    """An equidistant fish-eye. Its circle just fits into the film, and outside it the picture is black.

    Parameters
    ----------
    eye : array_like, shape (3,)
        The place of the camera.
    target : array_like, shape (3,)
        The point in the middle of the picture.
    up : array_like, shape (3,), default (0, 1, 0)
        The direction that points up in the picture; it need not be perpendicular to the view.
    fov : float, default 180
        The angle across the circle in degrees, above 0 and at most 360.

    Raises
    ------
    SceneError
        For values that are not finite, ``eye`` equal to ``target``, or ``up`` along the view.

    See Also
    --------
    OpenCVFisheyeCamera : a calibrated fish-eye

    Examples
    --------
    >>> from renderer import FisheyeCamera
    >>> camera = FisheyeCamera(eye=(0, 0, 0), target=(0, 0, -1))
    >>> camera.project([[0, 0, -1], [1, 0, -1], [1, 0, 0]], 360)[0].tolist()
    [[180.0, 180.0], [270.0, 180.0], [360.0, 180.0]]
    """

    type: Literal["fisheye"] = "fisheye"
    fov: Annotated[float, Field(gt=0.0, le=360.0, strict=True)] = 180.0

    @stated
    def __init__(
        self,
        *,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 1.0, 0.0),
        fov: float = 180.0,
        type: Literal["fisheye"] = "fisheye",
    ) -> None: ...

    def _slips(self) -> Iterable[str]:
        if self.fov < 6.3:  # a full turn in radians
            yield in_degrees("fov", self.fov)

    def _directions(self, x: Floats, y: Floats, width: int, height: int) -> Floats:
        right, down = x - width / 2.0, y - height / 2.0
        # rule: equidistant
        angle = np.hypot(right, down) * self._radians_per_pixel(width, height)
        directions = turned_away(angle, right, down)
        directions[angle > math.radians(self.fov) / 2.0] = np.nan
        return directions

    def _film(self, across: Floats, above: Floats, ahead: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        aside = np.hypot(across, above)
        angle = np.arctan2(aside, ahead)
        share = angle / self._radians_per_pixel(width, height) / np.where(aside > 0.0, aside, 1.0)
        # Behind the camera a circle of 360 degrees shows one point all around.
        unseen = (angle > math.radians(self.fov) / 2.0) | ((aside == 0.0) & (ahead <= 0.0))
        share = np.where(unseen, np.nan, share)
        return width / 2.0 + across * share, height / 2.0 - above * share

    def _radians_per_pixel(self, width: int, height: int) -> float:
        return math.radians(self.fov) / min(width, height)
