"""A camera of parallel rays."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from renderer.arguments.fields import stated
from renderer.arguments.limits import FARTHEST
from renderer.arguments.types import ArrayLike
from renderer.numerics.film_rays import along
from renderer.scene.cameras.base import AffineCamera, Floats


class OrthographicCamera(AffineCamera):
    """A camera of parallel rays.

    Parameters
    ----------
    eye : array_like, shape (3,)
        The point in the middle of the film, from which rays start.
    target : array_like, shape (3,)
        A point that the camera looks at.
    up : array_like, shape (3,), default (0, 1, 0)
        The direction that points up in the picture; it need not be perpendicular to the view.
    height : float
        The height of the film in scene units, above 0 and at most 2**126.

    Raises
    ------
    SceneError
        For values that are not finite, ``eye`` equal to ``target``, or ``up`` along the view.

    Examples
    --------
    >>> from renderer import Octree, OrthographicCamera, shapes
    >>> from renderer.studies import depth_map
    >>> camera = OrthographicCamera(eye=(0.5, 0.25, 3), target=(0.5, 0.25, 0), height=0.9)
    >>> depth_map(Octree.from_mesh(shapes.box()), camera, 3, 1)
    array([[inf,  2., inf]])
    """

    type: Literal["orthographic"] = "orthographic"
    height: Annotated[float, Field(gt=0.0, le=FARTHEST, strict=True)]

    @stated
    def __init__(
        self,
        *,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 1.0, 0.0),
        height: float,
        type: Literal["orthographic"] = "orthographic",
    ) -> None: ...

    def rows(self, width: int, height: int) -> Floats:
        right, up, forward = self.frame()
        pixel = self.height / height
        zero = np.zeros(3)
        corner = np.asarray(self.eye) - right * (pixel * width / 2.0) + up * (pixel * height / 2.0)
        return np.array([corner, right * pixel, -up * pixel, forward, zero, zero])

    def _film_of(self, points: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        corner, across, down, forward, _, _ = self.rows(width, height)
        away, pixel = points - corner, self.height / height
        x, y = along(away, across / pixel) / pixel, along(away, down / pixel) / pixel
        behind = ~(along(points - np.asarray(self.eye), forward) >= 0.0)
        return np.where(behind, np.nan, x), np.where(behind, np.nan, y)
