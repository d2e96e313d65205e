"""Crossings and winding numbers in rational arithmetic, for the few points whose products float64 cannot represent.

Crossings follow the rules of ``crossings``: signs of areas and volumes, and points on edges moved by (e, e^2). Winding
numbers follow the formula of ``careful_angle``.
"""

import math
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from renderer.inside.careful_angle import PLAIN
from renderer.numerics.rational import Vector, corners_from, cross, dot, volume

Floats = NDArray[np.float64]

# Coordinates whose differences may overflow, and what they are multiplied by then.
_HUGE, _LESS = 2.0**1000, 2.0**-10


def crossings_of(point: Floats, triangles: Floats, axis: int) -> tuple[int, int]:
    """The winding number, and 1 for a point on a face, of the half-line from a point up an axis."""
    turned = np.roll(np.arange(3), -(axis + 1))
    point, triangles = point[turned], triangles[:, :, turned]
    # Only faces around the half-line, as seen along the axis, can matter.
    lower, upper = triangles[:, :, :2].min(axis=1), triangles[:, :, :2].max(axis=1)
    near = ((lower <= point[:2]) & (point[:2] <= upper)).all(axis=1)
    winding, on = 0, 0
    for triangle in triangles[near]:
        step, touches = _crossing(*corners_from(point, triangle))
        winding, on = winding + step, on | touches
    return winding, on


def _crossing(a: Vector, b: Vector, c: Vector) -> tuple[int, int]:
    """The change of the winding number at a face relative to the point, and whether the point lies on it."""
    pairs = ((b, c), (c, a), (a, b))
    areas = [p[0] * q[1] - p[1] * q[0] for p, q in pairs]
    if min(areas) < 0 < max(areas):
        return 0, 0
    above = volume(a, b, c)
    if above == 0:
        return 0, int(any(areas) or _on_upright(a, b, c))
    signs = [_sign(area) or _sign(p[1] - q[1]) or _sign(q[0] - p[0]) for area, (p, q) in zip(areas, pairs, strict=True)]
    crosses = abs(sum(signs)) == 3 and (above > 0) == (signs[0] > 0)
    return (signs[0] if crosses else 0), 0


def _on_upright(a: Vector, b: Vector, c: Vector) -> bool:
    """Whether the point lies on a face that is seen as a line and whose plane contains the point."""
    informed = False
    for u, v in ((1, 2), (2, 0)):
        areas = [p[u] * q[v] - p[v] * q[u] for p, q in ((b, c), (c, a), (a, b))]
        if min(areas) < 0 < max(areas):
            return False
        informed = informed or any(areas)
    return informed or all(min(x) <= 0 <= max(x) for x in zip(a, b, c, strict=True))


def _sign(x: Fraction) -> int:
    return (x > 0) - (x < 0)


def winding_of(point: Floats, triangles: Floats) -> float:
    """The winding number of triangles (F, 3 corners, 3) around a point (3,), each face to float64 precision.

    Float64 measures faces whose corners, edges and plane are far from the point; exact products measure the others.
    """
    huge = max(np.abs(point).max(), np.abs(triangles).max()) > _HUGE
    share = _LESS if huge else 1.0
    away = triangles * share - point * share
    with np.errstate(invalid="ignore", divide="ignore"):
        away /= np.abs(away).max(axis=2, keepdims=True)
        a, b, c = (away / np.sqrt((away * away).sum(axis=2, keepdims=True))).transpose(1, 0, 2)
        rest = 1.0 + (a * b).sum(axis=1) + (b * c).sum(axis=1) + (c * a).sum(axis=1)
        plain = rest > PLAIN
    volumes = (a * np.cross(b, c)).sum(axis=1)
    angle = math.fsum(np.arctan2(volumes[plain], rest[plain]))
    angle += math.fsum(_half_angle(*corners_from(point, triangle)) for triangle in triangles[~plain])
    return angle / (2.0 * math.pi)


def _half_angle(a: Vector, b: Vector, c: Vector) -> float:
    """Half the solid angle of a face relative to the point, by exact products; 0 in its plane."""
    side = volume(a, b, c)
    if side == 0:
        return 0.0
    between = [dot(_direction(u), _direction(v)) for u, v in ((b, c), (c, a), (a, b))]
    first = between.index(max(between))
    a, b, c = (a, b, c, a, b)[first : first + 3]
    m, n = _direction(cross(a, b)), _direction(cross(a, c))
    x, y, z = _direction(a), _direction(b), _direction(c)
    sine = math.hypot(*cross(m, n))
    return math.atan2(sine if side > 0 else -sine, dot(m, n) + _cotangent(x, y) * _cotangent(x, z))


def _cotangent(x: Vector, y: Vector) -> float:
    """The cotangent of half the angle between two directions."""
    return math.hypot(*cross(x, y)) / (1.0 - dot(x, y))


def _direction(a: Vector) -> Vector:
    """A vector, not 0, scaled to size one."""
    largest = max(abs(x) for x in a)
    x, y, z = (float(x / largest) for x in a)
    size = math.hypot(x, y, z)
    return x / size, y / size, z / size
