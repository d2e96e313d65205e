"""Shared by all cameras: a place in the world, rays through film positions, and the way back from points.

Film positions (x, y) are in pixels: (0, 0) is the top left corner of the film and (0.5, 0.5) the centre of its first
pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator, model_validator

from renderer.arguments.arrays import real_argument
from renderer.arguments.fields import Fields, FiniteVector
from renderer.arguments.limits import FARTHEST
from renderer.arguments.points import check_points
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.numerics.film_rays import affine_rays, along, unit_rows
from renderer.scene.cameras.intrinsics import Intrinsics
from renderer.scene.vectors import unit

Floats = NDArray[np.float64]


class BaseCamera(Fields):
    """A camera with a place. Its subclasses have its rays."""

    eye: FiniteVector
    target: FiniteVector
    up: FiniteVector = (0.0, 1.0, 0.0)

    @model_validator(mode="after")
    def _has_a_view_direction(self) -> BaseCamera:
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

    @property
    def film_size(self) -> tuple[int, int] | None:
        """Width and height in pixels of the film that the camera is calibrated for; None for any.

        Examples
        --------
        >>> from renderer import PinholeCamera
        >>> PinholeCamera(eye=(0, 0, 5), target=(0, 0, 0), width=640, height=480, fx=500, fy=500).film_size
        (640, 480)
        """
        return None

    def frame(self) -> tuple[Floats, Floats, Floats]:
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

    def rays(self, pixels: ArrayLike, resolution: int | Sequence[int] | None = None) -> tuple[Floats, Floats]:
        """The rays through film positions.

        Parameters
        ----------
        pixels : array_like, shape (..., 2)
            Positions x and y in pixels from the top left corner of the film. The centre of the first pixel is at
            (0.5, 0.5), so OpenCV's pixel coordinates are half a pixel less.
        resolution : int or (int, int), optional
            Width and height in pixels; one number is both. By default those that the camera is calibrated for.

        Returns
        -------
        origins, directions : ndarray, shape (..., 3), float64
            Directions have unit length. A film position that shows nothing, as outside a fish-eye's circle, has NaN.

        Raises
        ------
        ValueError
            If an argument is not as above.

        See Also
        --------
        project : the inverse

        Examples
        --------
        >>> from renderer import PerspectiveCamera
        >>> camera = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        >>> origin, direction = camera.rays((320, 240), (640, 480))
        >>> origin, direction.round(12)
        (array([0., 0., 5.]), array([ 0.,  0., -1.]))
        """
        width, height = self._resolution(resolution)
        places = real_argument("pixels", pixels).astype(np.float64)
        expect(places.ndim >= 1 and places.shape[-1] == 2, "pixels", "shape (..., 2)", f"shape {places.shape}")
        expect(bool(np.isfinite(places).all()), "pixels", "finite numbers", "others")
        return self._rays(places[..., 0], places[..., 1], width, height)

    def primary_rays(
        self, resolution: int | Sequence[int] | None = None, offset: Sequence[float] = (0.5, 0.5)
    ) -> tuple[Floats, Floats]:
        """The rays of a picture, one through each pixel: those that ``render`` traces with one sample a pixel.

        Parameters
        ----------
        resolution : int or (int, int), optional
            As of ``rays``.
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
        width, height = self._resolution(resolution)
        place = real_argument("offset", offset)
        expect(place.shape == (2,) and bool(np.isfinite(place).all()), "offset", "two finite numbers", repr(offset))
        x, y = np.meshgrid(np.arange(width) + place[0], np.arange(height) + place[1])
        return self._rays(x, y, width, height)

    def project(
        self,
        points: ArrayLike,
        resolution: int | Sequence[int] | None = None,
        *,
        depth: Literal["distance", "z"] = "distance",
    ) -> tuple[Floats, Floats]:
        """The pixels at which points appear, and their depths: the inverse of ``rays``.

        Parameters
        ----------
        points : array_like, shape (..., 3)
        resolution : int or (int, int), optional
            As of ``rays``.
        depth : {"distance", "z"}, default "distance"
            The distance along the ray, or along the camera's axis, as of ``studies.depth_map``.

        Returns
        -------
        pixels : ndarray, shape (..., 2), float64
            Positions as of ``rays``, also outside the film. Their integer parts are the pixel's column and row. A point
            behind the camera, which no ray reaches, has NaN.
        depths : ndarray, shape (...,), float64
            In scene units; NaN for a point behind the camera.

        Raises
        ------
        ValueError
            If an argument is not as above.

        Examples
        --------
        >>> from renderer import PerspectiveCamera
        >>> camera = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0), fov=90)
        >>> pixels, depths = camera.project([[0, 0, 0], [1, 0, 4], [0, 0, 9]], (640, 480))
        >>> pixels.round(9), depths.round(9)
        (array([[320., 240.],
               [560., 240.],
               [ nan,  nan]]), array([5.        , 1.41421356,        nan]))
        """
        width, height = self._resolution(resolution)
        expect(isinstance(depth, str) and depth in ("distance", "z"), "depth", "'distance' or 'z'", repr(depth))
        places, shape = check_points("points", points, FARTHEST)
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = self._film_of(places, width, height)
            pixels = np.stack([x, y], axis=-1)
            if depth == "z":
                away = along(places - np.asarray(self.eye), self.frame()[2])
            else:
                away = np.linalg.norm(places - self._rays(x, y, width, height)[0], axis=-1)
        depths = np.where(np.isnan(x), np.nan, away)
        return pixels.reshape(*shape, 2), depths.reshape(shape)

    def _rays(self, x: Floats, y: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        """Origins and unit directions (..., 3) of the rays through checked film positions (...)."""
        raise NotImplementedError

    def _film_of(self, points: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        """The film positions of points (n, 3), NaN for those that no ray reaches."""
        raise NotImplementedError

    def _has_lens(self, samples: int) -> bool:
        """Whether the samples of a pixel, if there are so many, start at different points of a lens."""
        return False

    def _rows_for(self, width: int, height: int, samples: int) -> Floats | None:
        """The rows of the map from film to rays if that is affine for so many samples of a pixel."""
        return None

    def _sample_rays(
        self, x: Floats, y: Floats, width: int, height: int, number: int, samples: int
    ) -> tuple[Floats, Floats]:
        """``_rays`` of the sample with this number; for ``samples`` itself, those through the middle of a lens."""
        return self._rays(x, y, width, height)

    def _resolution(self, resolution: int | Sequence[int] | None) -> tuple[int, int]:
        """The checked width and height."""
        given = self.film_size if resolution is None else resolution
        sizes = np.asarray((given, given) if isinstance(given, Integral) else given)
        whole = sizes.shape == (2,) and sizes.dtype.kind in "iu" and bool((sizes > 0).all())
        expect(whole, "resolution", "one or two integers above 0", repr(resolution))
        width, height = sizes.tolist()
        return width, height


class AffineCamera(BaseCamera):
    """A camera whose rays are affine in the film position, so that six rows are all that a picture's kernel reads."""

    def rows(self, width: int, height: int) -> Floats:
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

    def _rays(self, x: Floats, y: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        return affine_rays(self.rows(width, height), x, y)

    def _rows_for(self, width: int, height: int, samples: int) -> Floats | None:
        return None if self._has_lens(samples) else self.rows(width, height)


class CentralCamera(AffineCamera):
    """An affine camera whose rays all start at its eye."""

    def _intrinsics(self, width: int, height: int) -> Intrinsics:
        """Those for a film of some size."""
        raise NotImplementedError

    def _film_of(self, points: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        right, up, forward = self.frame()
        away = points - np.asarray(self.eye)
        z = along(away, forward)
        z[~(z > 0.0)] = np.nan
        return self._intrinsics(width, height).film(along(away, right) / z, -along(away, up) / z)


class AngularCamera(BaseCamera):
    """A camera whose rays all start at its eye, in directions that are not affine in the film position."""

    def _directions(self, x: Floats, y: Floats, width: int, height: int) -> Floats:
        """Unit directions (..., 3) along the axes right, up and forward; NaN where the film shows nothing."""
        raise NotImplementedError

    def _film(self, across: Floats, above: Floats, ahead: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        """The film positions of points with these components along the axes; NaN where no ray reaches them."""
        raise NotImplementedError

    def _rays(self, x: Floats, y: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        (right, up, forward), local = self.frame(), self._directions(x, y, width, height)
        across, above, ahead = (local[..., k : k + 1] for k in range(3))
        directions = unit_rows(across * right + above * up + ahead * forward)
        return np.broadcast_to(np.asarray(self.eye), directions.shape), directions

    def _film_of(self, points: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        away = points - np.asarray(self.eye)
        across, above, ahead = (along(away, axis) for axis in self.frame())
        return self._film(across, above, ahead, width, height)
