"""A pinhole camera by its field of view."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from renderer.arguments.fields import in_degrees, stated
from renderer.arguments.types import ArrayLike
from renderer.scene.cameras.base import CentralCamera, Floats
from renderer.scene.cameras.intrinsics import Intrinsics


class PerspectiveCamera(CentralCamera):
    """A pinhole camera.

    Parameters
    ----------
    eye : array_like, shape (3,)
        The place of the camera.
    target : array_like, shape (3,)
        The point in the middle of the picture.
    up : array_like, shape (3,), default (0, 1, 0)
        The direction that points up in the picture; it need not be perpendicular to the view.
    fov : float, default 45
        The vertical field of view, in degrees, between 0 and 180.

    Raises
    ------
    SceneError
        For values that are not finite, ``eye`` equal to ``target``, or ``up`` along the view.

    Examples
    --------
    >>> from renderer import Octree, PerspectiveCamera, shapes
    >>> from renderer.studies import depth_map
    >>> camera = PerspectiveCamera(eye=(0.5, 0.25, 3), target=(0.5, 0.25, 0), fov=60)
    >>> depth_map(Octree.from_mesh(shapes.box()), camera, 3, 1)
    array([[inf,  2., inf]])
    """

    type: Literal["perspective"] = "perspective"
    fov: Annotated[float, Field(gt=0.0, lt=180.0, strict=True)] = 45.0

    @stated
    def __init__(
        self,
        *,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 1.0, 0.0),
        fov: float = 45.0,
        type: Literal["perspective"] = "perspective",
    ) -> None: ...

    def _slips(self) -> Iterable[str]:
        if 0.15 < self.fov < 2.0:  # 9 to 114 degrees in radians
            yield in_degrees("fov", self.fov)

    def _intrinsics(self, width: int, height: int) -> Intrinsics:
        focal = height / (2.0 * math.tan(math.radians(self.fov) / 2.0))
        return Intrinsics(focal, focal, width / 2.0, height / 2.0, 0.0)

    def rows(self, width: int, height: int) -> Floats:
        right, up, forward = self.frame()
        pixel = 2.0 * math.tan(math.radians(self.fov) / 2.0) / height
        zero = np.zeros(3)
        corner = forward - right * (pixel * width / 2.0) + up * (pixel * height / 2.0)
        return np.array([self.eye, zero, zero, corner, right * pixel, -up * pixel])
