"""Cutting polygons into triangles.

A fan from the first corner is right for convex polygons and for every other one that the first corner sees
whole; nearly all polygons in files are like that, and keep their fan. The rest lose one ear after the other (Meisters,
"Polygons have ears", 1975).
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]
_Point = tuple[float, float]

# A fan's triangle is turned over where the sine of its angle at the first corner is below this; corners on one line,
# rounded to float32, stay above.
_TURNED_OVER = -1e-6
# A polygon keeps its fan where it strays from its plane by more than this share of its extent, within a factor of two.
_OUT_OF_PLANE = 0.05
# Corners on one line, rounded to float64, make a triangle of less than this over the square of the extent.
_FLAT = 1e-12
# Cutting ears takes up to the square of the corners: a few seconds for this many.
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
        for k in np.flatnonzero(notched & planar & _is_simple(flat)):
            outline = [(float(x), float(y)) for x, y in flat[k]]
            # Outlines with steps finer than _FLAT are rare, and are cut without a tolerance.
            triangles = _cut_ears(outline, _FLAT) or _cut_ears(outline, 0.0)
            if triangles:
                yield begin + int(k), np.array(triangles, np.int64)


def _projected(points: _Floats, normals: _Floats) -> _Floats:
    """(s, n, 2): the points without the axis along which the normal is longest, wound counter-clockwise.

    Unlike a projection onto axes within the plane, this rounds nothing: points on a line stay on it.
    """
    longest = np.abs(normals).argmax(axis=1)
    turned = np.take_along_axis(normals, longest[:, None], axis=1)[:, 0] < 0
    kept = (longest[:, None] + np.where(turned[:, None], [2, 1], [1, 2])) % 3
    return np.take_along_axis(points, kept[:, None, :], axis=2)


def _is_simple(polygons: _Floats) -> NDArray[np.bool_]:
    """Whether edges that are not neighbours stay apart, for polygons (s, n, 2)."""
    count = polygons.shape[1]
    low_x = np.minimum(polygons, np.roll(polygons, -1, axis=1))[:, :, 0]
    order = np.argsort(low_x, axis=1, kind="stable")
    starts, ends = (np.take_along_axis(p, order[:, :, None], 1) for p in (polygons, np.roll(polygons, -1, axis=1)))
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    simple = np.ones(len(polygons), np.bool_)
    row, first = (index.ravel() for index in np.indices(order.shape))
    # Edges by where they begin along x, each against the next one, then the one after it, until that begins too late.
    for distance in range(1, count):
        inside = first < count - distance
        row, first = row[inside], first[inside]
        second = first + distance
        near = simple[row] & (low[row, second, 0] <= high[row, first, 0])
        row, first, second = row[near], first[near], second[near]
        if not len(row):
            break
        apart = (order[row, second] - order[row, first]) % count
        meet = (apart != 1) & (apart != count - 1)
        meet &= (low[row, second, 1] <= high[row, first, 1]) & (low[row, first, 1] <= high[row, second, 1])
        a, b, c, d = starts[row, first], ends[row, first], starts[row, second], ends[row, second]
        meet &= (_sides(a, b, c) * _sides(a, b, d) <= 0) & (_sides(c, d, a) * _sides(c, d, b) <= 0)
        simple[row[meet]] = False
    return simple


def _sides(a: _Floats, b: _Floats, p: _Floats) -> _Floats:
    """1 where p lies to the left of the way from a to b, -1 to its right, 0 on it; (m, 2) each."""
    sides: _Floats = np.sign((b[:, 0] - a[:, 0]) * (p[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (p[:, 0] - a[:, 0]))
    return sides


def _cut_ears(outline: list[_Point], flat: float) -> list[tuple[int, int, int]] | None:
    """Triangles of a simple polygon wound counter-clockwise, or None where rounding leaves no ear to cut."""
    count = len(outline)
    before, after = [count - 1, *range(count - 1)], [*range(1, count), 0]

    def turns_left(k: int) -> bool:
        return _turn(outline[before[k]], outline[k], outline[after[k]]) > flat

    # Of the remaining corners, only one that does not turn left can be the first to lie in an ear.
    blockers = sorted((*outline[k], k) for k in range(count) if not turns_left(k))
    triangles: list[tuple[int, int, int]] = []
    at, missed = 1, 0
    while len(triangles) < count - 2:
        a, c = before[at], after[at]
        if turns_left(at) and not _any_inside(blockers, outline, (a, at, c), flat):
            triangles.append((a, at, c))
            after[a], before[c] = c, a
            for k in (a, c):
                place = bisect_left(blockers, (*outline[k], k))
                if blockers[place : place + 1] == [(*outline[k], k)] and turns_left(k):
                    del blockers[place]
            at, missed = a, 0
        else:
            at, missed = c, missed + 1
            if missed > count - len(triangles):
                return None
    return triangles


def _any_inside(
    blockers: list[tuple[float, float, int]], outline: list[_Point], corners: tuple[int, int, int], flat: float
) -> bool:
    """Whether any of ``blockers``, in their order along x, lies in the triangle or on its edges."""
    a, b, c = (outline[k] for k in corners)
    begin = bisect_left(blockers, (min(a[0], b[0], c[0]),))
    end = bisect_right(blockers, (max(a[0], b[0], c[0]), math.inf))
    for x, y, k in blockers[begin:end]:
        p = (x, y)
        if _turn(c, a, p) >= -flat and _turn(a, b, p) >= -flat and _turn(b, c, p) >= -flat and k not in corners:
            return True
    return False


def _turn(a: _Point, b: _Point, c: _Point) -> float:
    """Twice the area of a b c; positive where the way from a over b to c turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
