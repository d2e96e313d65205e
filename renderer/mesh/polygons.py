"""Cutting polygons into triangles.

A fan from the first corner is right for convex polygons and for every other one that the first corner sees
whole; nearly all polygons in files are like that, and keep their fan. The rest lose one ear after the other
(``ears``).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

# A fan's triangle is turned over where the sine of its angle at the first corner is below this; corners on one line,
# rounded to float32, stay above.
_TURNED_OVER = -1e-6
# A polygon keeps its fan where it strays from its plane by more than this share of its extent, within a factor of two.
_OUT_OF_PLANE = 0.05
# Corners on one line, rounded to float64, make a triangle of less than this over the square of the extent.
_FLAT = 1e-12
# Cutting ears takes up to the square of the corners: some hundredths of a second for this many.
_MOST_CORNERS = 4096
_BLOCK_CORNERS = 1 << 18


def triangulate(positions: _Floats, corners: _Ints, starts: _Ints) -> _Ints:
    """Triangles of polygons as (F, 3) places in ``corners``: those of a polygon together, polygons in their order.

    positions : (V, 3), of any value.
    corners : rows of ``positions``; polygon p has corners[starts[p] : starts[p + 1]], at least three.

    Polygon a b c d ... becomes abc, acd, ... where those triangles do not overlap, else as many others that do not
    overlap and are wound as the polygon is. The fan stays for polygons that have no area, cross or touch themselves,
    stray from a plane, have more than 4096 corners, or name a vertex that is not there or not finite.
    """
    places = _fans(starts)
    lengths = np.diff(starts)
    if not len(positions) or not (lengths > 3).any():
        return places
    finite = np.abs(positions[np.isfinite(positions)])
    # Near 1, the products below neither overflow nor vanish.
    near_one = np.ldexp(positions, -np.frexp(finite.max(initial=0.0))[1])
    first_triangles = starts[:-1] - 2 * np.arange(len(lengths))
    for rows in _rows_of_one_length(lengths):
        around = starts[rows] + np.arange(lengths[rows[0]])[:, None]
        suspects = np.flatnonzero(_fan_may_be_wrong(near_one, corners[around]))
        for suspect, triangles in _cut_notched(near_one, corners[around[:, suspects]].T):
            row = rows[suspects[suspect]]
            places[first_triangles[row] : first_triangles[row] + len(triangles)] = starts[row] + triangles
    return places


def _fans(starts: _Ints) -> _Ints:
    cuts = np.diff(starts) - 2
    firsts = np.repeat(starts[:-1], cuts)
    steps = np.arange(cuts.sum()) - np.repeat(np.cumsum(cuts) - cuts, cuts) + 1
    return np.stack([firsts, firsts + steps, firsts + steps + 1], axis=1)


def _rows_of_one_length(lengths: _Ints) -> Iterator[_Ints]:
    """The polygons that a fan may be wrong for, a block of equally many corners at a time."""
    rows = np.flatnonzero((lengths > 3) & (lengths <= _MOST_CORNERS))
    rows = rows[np.argsort(lengths[rows], kind="stable")]
    begin = 0
    for length, count in zip(*np.unique(lengths[rows], return_counts=True), strict=True):
        end = begin + count
        step = max(1, _BLOCK_CORNERS // int(length))
        for at in range(begin, end, step):
            yield rows[at : min(at + step, end)]
        begin = end


def _fan_may_be_wrong(positions: _Floats, polygons: _Ints) -> NDArray[np.bool_]:
    """Whether a triangle of the fan is turned against the polygon's (Newell) normal, for polygons (corners, m)."""
    there = ((polygons >= 0) & (polygons < len(positions))).all(axis=0)
    polygons = polygons if there.all() else np.where(there, polygons, 0)
    # By component: NumPy is several times faster along contiguous columns than along rows of three.
    with np.errstate(invalid="ignore"):  # inf - inf; NaN compares false below
        x, y, z = (column[polygons[1:]] - column[polygons[0]] for column in np.ascontiguousarray(positions.T))
        cross = [
            y[:-1] * z[1:] - z[:-1] * y[1:],
            z[:-1] * x[1:] - x[:-1] * z[1:],
            x[:-1] * y[1:] - y[:-1] * x[1:],
        ]
        along = sum(component * component.sum(axis=0) for component in cross)
        wrong: NDArray[np.bool_] = there & (along < 0).any(axis=0)
    return wrong


def _cut_notched(positions: _Floats, polygons: _Ints) -> Iterator[tuple[int, _Ints]]:
    """For each of the polygons (s, n) whose fan is wrong and whose ears can be cut, its row and its triangles.

    The triangles are (n - 2, 3) numbers of the polygon's corners.
    """
    # Imported here, because most files need no compiler.
    from renderer.mesh import ears

    step = max(1, (1 << 22) // polygons.shape[1] ** 2)
    for begin in range(0, len(polygons), step):
        points = positions[polygons[begin : begin + step]]
        points = points - points[:, :1]
        points = np.ldexp(points, -np.frexp(np.abs(points).max(axis=(1, 2), keepdims=True))[1])
        before, after = points[:, 1:-1], points[:, 2:]
        cross = np.cross(before, after)
        normals = cross.sum(axis=1, keepdims=True)
        normals = normals / np.linalg.norm(normals, axis=2, keepdims=True)
        sizes = np.linalg.norm(before, axis=2) * np.linalg.norm(after, axis=2)
        notched = ((cross * normals).sum(axis=2) < _TURNED_OVER * sizes).any(axis=1)
        planar = np.ptp((points * normals).sum(axis=2), axis=1) <= _OUT_OF_PLANE
        flat = _projected(points, normals[:, 0])
        for k in np.flatnonzero(notched & planar):
            outline, count = np.ascontiguousarray(flat[k]), polygons.shape[1]
            if not ears.is_simple(outline, np.argsort(np.minimum(outline, np.roll(outline, -1, axis=0))[:, 0])):
                continue
            links, triangles = np.empty((3, count), np.int64), np.empty((count - 2, 3), np.int64)
            # Outlines with steps finer than _FLAT are rare, and are cut without a tolerance.
            if ears.cut_ears(outline, _FLAT, links, triangles) or ears.cut_ears(outline, 0.0, links, triangles):
                yield begin + int(k), triangles


def _projected(points: _Floats, normals: _Floats) -> _Floats:
    """(s, n, 2): the points without the axis along which the normal is longest, wound counter-clockwise.

    Unlike a projection onto axes within the plane, this rounds nothing: points on a line stay on it.
    """
    longest = np.abs(normals).argmax(axis=1)
    turned = np.take_along_axis(normals, longest[:, None], axis=1)[:, 0] < 0
    kept = (longest[:, None] + np.where(turned[:, None], [2, 1], [1, 2])) % 3
    return np.take_along_axis(points, kept[:, None, :], axis=2)
