"""Cameras, and the affine map from film to rays that the kernels read.

Every camera here is affine in the film position (x, y), measured in pixels with (0, 0) the
top left corner of the film and (0.5, 0.5) the centre of its first pixel:

    origin(x, y)    = rows[0] + x rows[1] + y rows[2]
    direction(x, y) = rows[3] + x rows[4] + y rows[5]      (not normalised)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from numbers import Integral
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from renderer.arguments.arrays import real_argument
from renderer.arguments.limits import FARTHEST
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.scene.fields import Fields, FiniteVector, stated


def unit(vector: ArrayLike) -> NDArray[np.float64]:
    """The vector at unit length, scaled first so that no square overflows or vanishes; zero gives nan."""
    scaled = np.asarray(vector, np.float64) / np.abs(vector).max()
    return scaled / np.linalg.norm(scaled)


def checked_vector(argument: str, value: ArrayLike) -> tuple[float, float, float]:
    """Three numbers (3,) as a tuple. Raises ``ValueError`` naming ``argument`` where they are not, or not finite."""
    array = np.asarray(value, np.float64)
    expect(array.shape == (3,) and bool(np.isfinite(array).all()), argument, "three finite numbers", repr(value))
    x, y, z = array.tolist()
    return x, y, z


class _Camera(Fields):
    eye: FiniteVector
    target: FiniteVector
    up: FiniteVector = (0.0, 1.0, 0.0)

    @model_validator(mode="after")
    def _has_a_view_direction(self) -> _Camera:
        with np.errstate(all="ignore"):
            right = np.cross(unit(np.subtract(self.target, self.eye)), unit(self.up))
        if not np.linalg.norm(right) > 0.0:
            raise ValueError("expected target != eye and up not parallel to the view direction")
        return self

    @field_validator("eye")
    @classmethod
    def _is_near_enough(cls, eye: tuple[float, float, float]) -> tuple[float, float, float]:
        # rule: eye-within-limit
        if max(map(abs, eye)) > FARTHEST:
            raise ValueError(f"expected coordinates within {FARTHEST:.3g}, as far as rays are traced")
        return eye

    def frame(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """The camera's axes in world space.

        Returns
        -------
        right, up, forward : ndarray, shape (3,), float64
            Unit vectors.

        Examples
        --------
        >>> from renderer import PerspectiveCamera
        >>> right, up, forward = PerspectiveCamera(eye=(5, 0, 0), target=(0, 0, 0)).frame()
        >>> right, up, forward
        (array([ 0.,  0., -1.]), array([0., 1., 0.]), array([-1.,  0.,  0.]))
        """
        forward = unit(np.subtract(self.target, self.eye))
        right = unit(np.cross(forward, unit(self.up)))
        return right, np.cross(right, forward), forward

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        """The affine map from film to rays.

        Parameters
        ----------
        width, height : int
            The size of the film in pixels.

        Returns
        -------
        ndarray, shape (6, 3), float64
            The ray through ``(x, y)``, in pixels from the top left corner of the film, has the origin ``rows[0] + x *
            rows[1] + y * rows[2]`` and the direction ``rows[3] + x * rows[4] + y * rows[5]``, which is not normalised.

        Examples
        --------
        >>> from renderer import PerspectiveCamera
        >>> rows = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0), fov=90).rows(4, 4)
        >>> (rows[0] + 2 * rows[1] + 2 * rows[2]).tolist(), (rows[3] + 2 * rows[4] + 2 * rows[5]).round(12).tolist()
        ([0.0, 0.0, 5.0], [0.0, 0.0, -1.0])
        """
        raise NotImplementedError

    def primary_rays(
        self, resolution: int | Sequence[int], offset: Sequence[float] = (0.5, 0.5)
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The rays of a picture, one through each pixel: those that ``render`` traces with one sample a pixel.

        Parameters
        ----------
        resolution : int or (int, int)
            Width and height in pixels; one number is both.
        offset : (float, float), default (0.5, 0.5)
            The place in the pixel, from its top left corner: the centre by default.

        Returns
        -------
        origins, directions : ndarray, shape (height, width, 3), float64
            Row 0 is the top of the picture. Directions have unit length.

        Raises
        ------
        ValueError
            For a resolution that is not one or two integers above 0, or an offset that is not two finite numbers.

        Examples
        --------
        >>> from renderer import Octree, PerspectiveCamera, shapes
        >>> octree = Octree.from_mesh(shapes.box())
        >>> camera = PerspectiveCamera(eye=(0.5, 0.5, 3), target=(0.5, 0.5, 0))
        >>> octree.closest_hit(*camera.primary_rays((3, 1))).hit
        array([[False,  True, False]])
        """
        pair = (resolution, resolution) if isinstance(resolution, Integral) else resolution
        sizes = np.asarray(pair)
        whole = sizes.shape == (2,) and sizes.dtype.kind in "iu" and bool((sizes > 0).all())
        expect(whole, "resolution", "one or two integers above 0", repr(resolution))
        place = real_argument("offset", offset)
        expect(place.shape == (2,) and bool(np.isfinite(place).all()), "offset", "two finite numbers", repr(offset))
        width, height = sizes.tolist()
        x, y = place.tolist()
        origins, directions = (r.reshape(height, width, 3) for r in primary_rays(self, width, height, (x, y)))
        return origins, directions


class PerspectiveCamera(_Camera):
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
            degrees = math.degrees(self.fov)
            yield f"fov: expected degrees, got {self.fov:.6g}. If these are radians, write fov={degrees:.6g}."

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        right, up, forward = self.frame()
        pixel = 2.0 * math.tan(math.radians(self.fov) / 2.0) / height
        zero = np.zeros(3)
        corner = forward - right * (pixel * width / 2.0) + up * (pixel * height / 2.0)
        return np.array([self.eye, zero, zero, corner, right * pixel, -up * pixel])


class OrthographicCamera(_Camera):
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

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        right, up, forward = self.frame()
        pixel = self.height / height
        zero = np.zeros(3)
        corner = np.asarray(self.eye) - right * (pixel * width / 2.0) + up * (pixel * height / 2.0)
        return np.array([corner, right * pixel, -up * pixel, forward, zero, zero])


Camera = PerspectiveCamera | OrthographicCamera


def sample_offsets(samples: int) -> NDArray[np.float64]:
    """Positions of a regular k x k grid in the unit pixel, (samples, 2) float64; the centre for one sample."""
    k = math.isqrt(max(samples, 0))
    if k < 1 or k * k != samples:
        raise ValueError(f"samples: expected a square number (1, 4, 9, ...), got {samples}")
    centres = (np.arange(k) + 0.5) / k
    y, x = np.meshgrid(centres, centres, indexing="ij")
    return np.stack([x.ravel(), y.ravel()], axis=1)


def primary_rays(
    camera: _Camera, width: int, height: int, offset: tuple[float, float] = (0.5, 0.5)
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rays through one position in every pixel, in scanline order from the top left.

    Returns origins and unit directions, each (height * width, 3) float64.
    """
    rows = camera.rows(width, height)
    y, x = np.meshgrid(np.arange(height) + offset[1], np.arange(width) + offset[0], indexing="ij")
    x, y = x.reshape(-1, 1), y.reshape(-1, 1)
    origins = rows[0] + x * rows[1] + y * rows[2]
    directions = rows[3] + x * rows[4] + y * rows[5]
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)
