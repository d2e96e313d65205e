"""Winding numbers in rational arithmetic, for the few points whose products float64 cannot hold."""

import math

import numpy as np
from numpy.typing import NDArray

from renderer.inside.careful_angle import PLAIN
from renderer.numerics.rational import Vector, cross, dot, exact, less

# Coordinates whose differences may overflow, and what they are multiplied by then.
_HUGE, _LESS = 2.0**1000, 2.0**-10


def number_of(point: NDArray[np.float64], triangles: NDArray[np.float64]) -> float:
    """The winding number of triangles (F, 3 corners, 3) around a point (3,), each face to float64's digits.

    Faces that no corner, edge or plane is near are told by float64, the others by the formula of ``careful_angle``.
    """
    huge = max(np.abs(point).max(), np.abs(triangles).max()) > _HUGE
    share = _LESS if huge else 1.0
    away = triangles * share - point * share
    with np.errstate(invalid="ignore", divide="ignore"):
        away /= np.abs(away).max(axis=2, keepdims=True)
        a, b, c = (away / np.sqrt((away * away).sum(axis=2, keepdims=True))).transpose(1, 0, 2)
        rest = 1.0 + (a * b).sum(axis=1) + (b * c).sum(axis=1) + (c * a).sum(axis=1)
        plain = rest > PLAIN
    volume = (a * np.cross(b, c)).sum(axis=1)
    angle = math.fsum(np.arctan2(volume[plain], rest[plain]))
    angle += math.fsum(_angle(point, triangle) for triangle in triangles[~plain])
    return angle / (2.0 * math.pi)


def _angle(point: NDArray[np.float64], triangle: NDArray[np.float64]) -> float:
    """Half the solid angle of one face, by exact products; 0 in its plane."""
    p = exact(point)
    a, b, c = (less(exact(corner), p) for corner in triangle)
    volume = dot(a, cross(b, c))
    if volume == 0:
        return 0.0
    between = [dot(_direction(u), _direction(v)) for u, v in ((b, c), (c, a), (a, b))]
    first = between.index(max(between))
    a, b, c = (a, b, c, a, b)[first : first + 3]
    m, n = _direction(cross(a, b)), _direction(cross(a, c))
    x, y, z = _direction(a), _direction(b), _direction(c)
    sine = math.hypot(*cross(m, n))
    return math.atan2(sine if volume > 0 else -sine, dot(m, n) + _cotangent(x, y) * _cotangent(x, z))


def _cotangent(x: Vector, y: Vector) -> float:
    """The cotangent of half the angle between two directions."""
    return math.hypot(*cross(x, y)) / (1.0 - dot(x, y))


def _direction(a: Vector) -> Vector:
    """A vector made of size one; it is not 0."""
    largest = max(abs(x) for x in a)
    x, y, z = (float(x / largest) for x in a)
    size = math.hypot(x, y, z)
    return x / size, y / size, z / size
