"""Vectors of rational numbers, for the few points whose products float64 cannot represent."""

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Of fractions, or of float64.
Vector = tuple[Any, Any, Any]


def exact(point: NDArray[np.float64]) -> Vector:
    """The coordinates of a point (3,)."""
    x, y, z = (Fraction(coordinate) for coordinate in point.tolist())
    return x, y, z


def corners_from(point: NDArray[np.float64], triangle: NDArray[np.float64]) -> tuple[Vector, Vector, Vector]:
    """The corners of a triangle (3 corners, 3) minus a point (3,)."""
    p = exact(point)
    a, b, c = (less(exact(corner), p) for corner in triangle)
    return a, b, c


def less(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a: Vector, b: Vector) -> Any:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def volume(a: Vector, b: Vector, c: Vector) -> Any:
    """The triple product a . (b x c): 0 if the origin lies in the plane of the corners."""
    return dot(a, cross(b, c))
