"""Crossings of a half-line in rational arithmetic, for the few points whose products float64 cannot hold.

The rules are those of ``crossings``: signs of areas and volumes, and points on edges moved by (e, e^2).
"""

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

_Corner = list[Fraction]


def crossings_of(point: NDArray[np.float64], triangles: NDArray[np.float64], axis: int) -> tuple[int, int]:
    """The winding number, and 1 for a point on a face, of the half-line from a point up an axis."""
    turned = np.roll(np.arange(3), -(axis + 1))
    point, triangles = point[turned], triangles[:, :, turned]
    # Only faces around the half-line, as seen along the axis, can matter.
    lower, upper = triangles[:, :, :2].min(axis=1), triangles[:, :, :2].max(axis=1)
    near = ((lower <= point[:2]) & (point[:2] <= upper)).all(axis=1)
    p = [Fraction(float(x)) for x in point]
    winding, on = 0, 0
    for triangle in triangles[near]:
        corners = [[Fraction(float(x)) - o for x, o in zip(corner, p, strict=True)] for corner in triangle]
        step, touches = _crossing(*corners)
        winding, on = winding + step, on | touches
    return winding, on


def _crossing(a: _Corner, b: _Corner, c: _Corner) -> tuple[int, int]:
    """The change of the winding number at a face relative to the point, and whether the point lies on it."""
    pairs = ((b, c), (c, a), (a, b))
    areas = [p[0] * q[1] - p[1] * q[0] for p, q in pairs]
    if min(areas) < 0 < max(areas):
        return 0, 0
    volume = sum(corner[2] * area for corner, area in zip((a, b, c), areas, strict=True))
    if volume == 0:
        return 0, int(any(areas) or _on_upright(a, b, c))
    signs = [_sign(area) or _sign(p[1] - q[1]) or _sign(q[0] - p[0]) for area, (p, q) in zip(areas, pairs, strict=True)]
    crosses = abs(sum(signs)) == 3 and (volume > 0) == (signs[0] > 0)
    return (signs[0] if crosses else 0), 0


def _on_upright(a: _Corner, b: _Corner, c: _Corner) -> bool:
    """Whether the point lies on a face that is seen as a line and whose plane it lies in."""
    informed = False
    for u, v in ((1, 2), (2, 0)):
        areas = [p[u] * q[v] - p[v] * q[u] for p, q in ((b, c), (c, a), (a, b))]
        if min(areas) < 0 < max(areas):
            return False
        informed = informed or any(areas)
    return informed or all(min(x) <= 0 <= max(x) for x in zip(a, b, c, strict=True))


def _sign(x: Fraction) -> int:
    return (x > 0) - (x < 0)
