"""The view factor from a point to a polygon, and by its mean over a rectangle that from it to a polygon."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def element_to_polygon(point: ArrayLike, normal: ArrayLike, corners: ArrayLike) -> float:
    """F from a small plane area to a polygon (n, 3), of which only the part above the area's plane counts.

    Lambert, Photometria, 1760: the sum over edges of their angle at the point times the normal on the plane through
    edge and point, over 2 pi. Its sign is left out: either side of the polygon will do.

    >>> element_to_polygon([0, 0, 0], [0, 0, 1], [[-1e9, -1e9, 1], [1e9, -1e9, 1], [1e9, 1e9, 1], [-1e9, 1e9, 1]])
    1.0
    """
    up = np.asarray(normal, np.float64)
    up = up / np.linalg.norm(up)
    seen = _above(np.asarray(corners, np.float64) - np.asarray(point, np.float64), up)
    total = 0.0
    for a, b in zip(seen, np.roll(seen, -1, axis=0), strict=True):
        across = np.cross(a, b)
        size = float(np.linalg.norm(across))
        # An edge in line with the point has no angle.
        if size > 0.0:
            total += np.arctan2(size, float(a @ b)) * float(up @ across) / size
    return abs(total) / (2.0 * np.pi)


def mean_over_rectangle(rectangle: ArrayLike, normal: ArrayLike, corners: ArrayLike, count: int = 32) -> float:
    """F from a rectangle, corners (4, 3) in order, to a polygon that is nowhere hidden, by count^2 points of it.

    The points crowd towards the edges, where the view factor of a polygon that shares an edge has no derivative.
    """
    first, second, _, last = np.asarray(rectangle, np.float64)
    nodes, weights = np.polynomial.legendre.leggauss(count)
    # Twice x = (1 - cos u) / 2: distances from the edges go with the fourth power of the nodes'.
    turn, share = (nodes + 1.0) / 2.0, weights / 2.0
    for _ in range(2):
        share = share * np.sin(np.pi * turn) * np.pi / 2.0
        turn = (1.0 - np.cos(np.pi * turn)) / 2.0
    return float(sum(
        p * q * element_to_polygon(first + s * (second - first) + t * (last - first), normal, corners)
        for s, p in zip(turn, share, strict=True) for t, q in zip(turn, share, strict=True)
    ))  # fmt: skip


def _above(corners: Floats, up: Floats) -> Floats:
    """The polygon clipped by the plane through the origin (Sutherland and Hodgman, 1974)."""
    heights, kept = corners @ up, []
    for k in range(len(corners)):
        low, high = heights[k - 1], heights[k]
        if (low > 0.0) != (high > 0.0):
            kept.append(corners[k - 1] + low / (low - high) * (corners[k] - corners[k - 1]))
        if high > 0.0:
            kept.append(corners[k])
    return np.array(kept).reshape(-1, 3)
