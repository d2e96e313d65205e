"""Cameras, and the affine map from film to rays that the kernels read.

Every camera here is affine in the film position (x, y), measured in pixels with (0, 0) the
top left corner of the film and (0.5, 0.5) the centre of its first pixel:

    origin(x, y)    = rows[0] + x rows[1] + y rows[2]
    direction(x, y) = rows[3] + x rows[4] + y rows[5]      (not normalised)
"""

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, field_validator, model_validator

from renderer.arguments.limits import FARTHEST
from renderer.errors import expect
from renderer.scene.fields import Fields, FiniteVector


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
    def _has_a_view_direction(self) -> "_Camera":
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
        """Unit vectors (right, up, forward) in world space, each (3,) float64.

        >>> from renderer import PerspectiveCamera
        >>> right, up, forward = PerspectiveCamera(eye=(5, 0, 0), target=(0, 0, 0)).frame()
        >>> right, up, forward
        (array([ 0.,  0., -1.]), array([0., 1., 0.]), array([-1.,  0.,  0.]))
        """
        forward = unit(np.subtract(self.target, self.eye))
        right = unit(np.cross(forward, unit(self.up)))
        return right, np.cross(right, forward), forward


class PerspectiveCamera(_Camera):
    """A pinhole camera; ``fov`` is the vertical field of view in degrees.

    >>> from renderer import Octree, PerspectiveCamera
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import depth_map
    >>> camera = PerspectiveCamera(eye=(0.5, 0.25, 3), target=(0.5, 0.25, 0), fov=60)
    >>> depth_map(Octree.from_mesh(box()), camera, 3, 1)
    array([[inf,  2., inf]])
    """

    type: Literal["perspective"] = "perspective"
    fov: Annotated[float, Field(gt=0.0, lt=180.0, strict=True)] = 45.0

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        """The affine map of the module's docstring, (6, 3) float64.

        >>> from renderer import PerspectiveCamera
        >>> rows = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0), fov=90).rows(4, 4)
        >>> (rows[0] + 2 * rows[1] + 2 * rows[2]).tolist(), (rows[3] + 2 * rows[4] + 2 * rows[5]).round(12).tolist()
        ([0.0, 0.0, 5.0], [0.0, 0.0, -1.0])
        """
        right, up, forward = self.frame()
        pixel = 2.0 * math.tan(math.radians(self.fov) / 2.0) / height
        zero = np.zeros(3)
        corner = forward - right * (pixel * width / 2.0) + up * (pixel * height / 2.0)
        return np.array([self.eye, zero, zero, corner, right * pixel, -up * pixel])


class OrthographicCamera(_Camera):
    """Parallel rays; ``height`` is the height of the film in scene units, up to ``limits.FARTHEST``.

    >>> from renderer import Octree, OrthographicCamera
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import depth_map
    >>> camera = OrthographicCamera(eye=(0.5, 0.25, 3), target=(0.5, 0.25, 0), height=0.9)
    >>> depth_map(Octree.from_mesh(box()), camera, 3, 1)
    array([[inf,  2., inf]])
    """

    type: Literal["orthographic"] = "orthographic"
    height: Annotated[float, Field(gt=0.0, le=FARTHEST, strict=True)]

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        """The affine map of the module's docstring, (6, 3) float64.

        >>> from renderer import OrthographicCamera
        >>> rows = OrthographicCamera(eye=(0, 0, 5), target=(0, 0, 0), height=4).rows(4, 4)
        >>> rows[0] + 1 * rows[1] + 2 * rows[2], rows[3]
        (array([-1.,  0.,  5.]), array([ 0.,  0., -1.]))
        """
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
    camera: Camera, width: int, height: int, offset: tuple[float, float] = (0.5, 0.5)
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
