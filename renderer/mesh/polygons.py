"""Cutting polygons into triangles.

A fan from the first corner is right for convex polygons and for every other one that the first corner sees
whole; nearly all polygons in files are like that, and keep their fan. The rest are cut by mapbox_earcut, also
polygons that touch themselves, such as those with a hole by a bridge. A cut counts if it is proven right: triangles
that are all wound as the polygon and have its area cover it once.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

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
_ROUNDED = 2.0**-52
_TRIES = 8
# Corners up to which they are compared with all edges: some 100 MB.
_MOST_TOUCHING = 1 << 10
_BLOCK_CORNERS = 1 << 18


class Cut(NamedTuple):
    """Polygons cut into triangles.

    places : (F, 3) places in the corners, those of a polygon together, polygons in their order.
    polygons : (F,) the polygon of each triangle, rising.
    wrong : the polygons that keep a fan although it does not cover them once.
    """

    places: _Ints
    polygons: _Ints
    wrong: _Ints


def triangulate(positions: _Floats, corners: _Ints, starts: _Ints) -> Cut:
    """Triangles of polygons.

    positions : (V, 3), of any value.
    corners : rows of ``positions``; polygon p has corners[starts[p] : starts[p + 1]], at least three.

    Polygon a b c d ... becomes abc, acd, ... where those triangles do not overlap, else others that do not overlap and
    are wound as the polygon is. The fan stays for polygons that have no area, and, as ``wrong`` ones, for those that
    cross themselves or stray from a plane. What a polygon winds around twice is covered twice.
    """
    places = _fans(starts)
    lengths = np.diff(starts)
    polygons = np.repeat(np.arange(len(lengths)), lengths - 2)
    cuts: dict[int, _Ints | None] = {}
    if len(positions) and (lengths > 3).any():
        finite = np.abs(positions[np.isfinite(positions)])
        # Near 1, the products below neither overflow nor vanish.
        near_one = np.ldexp(positions, -np.frexp(finite.max(initial=0.0))[1])
        for rows in _rows_of_one_length(lengths):
            around = starts[rows] + np.arange(lengths[rows[0]])[:, None]
            suspects = np.flatnonzero(_fan_may_be_wrong(near_one, corners[around]))
            for suspect, triangles in _cut_notched(near_one, corners[around[:, suspects]].T):
                row = int(rows[suspects[suspect]])
                cuts[row] = None if triangles is None else starts[row] + triangles
    wrong = np.array(sorted(row for row, triangles in cuts.items() if triangles is None), np.int64)
    return Cut(*_replaced(places, polygons, cuts), wrong)


def _replaced(places: _Ints, polygons: _Ints, cuts: dict[int, _Ints | None]) -> tuple[_Ints, _Ints]:
    """Triangles and their polygons with the fans of some polygons replaced by their cuts, which may have fewer."""
    own = {row: triangles for row, triangles in cuts.items() if triangles is not None}
    if not own:
        return places, polygons
    kept = ~np.isin(polygons, list(own))
    owners = np.concatenate([polygons[kept], *(np.full(len(t), row) for row, t in own.items())])
    order = np.argsort(owners, kind="stable")
    return np.concatenate([places[kept], *own.values()])[order], owners[order]


def _fans(starts: _Ints) -> _Ints:
    cuts = np.diff(starts) - 2
    firsts = np.repeat(starts[:-1], cuts)
    steps = np.arange(cuts.sum()) - np.repeat(np.cumsum(cuts) - cuts, cuts) + 1
    return np.stack([firsts, firsts + steps, firsts + steps + 1], axis=1)


def _rows_of_one_length(lengths: _Ints) -> Iterator[_Ints]:
    """The polygons that a fan may be wrong for, a block of equally many corners at a time."""
    rows = np.flatnonzero(lengths > 3)
    rows = rows[np.argsort(lengths[rows], kind="stable")]
    begin = 0
    for length, count in zip(*np.unique(lengths[rows], return_counts=True), strict=True):
        end = begin + count
        step = max(1, _BLOCK_CORNERS // int(length))
        for at in range(begin, end, step):
            yield rows[at : min(at + step, end)]
        begin = end


def _fan_may_be_wrong(positions: _Floats, polygons: _Ints) -> NDArray[np.bool_]:
    """Whether a triangle of the fan is turned against the polygon's (Newell) normal, or there is none though triangles
    have areas, for polygons (corners, m).
    """
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
        normal = [component.sum(axis=0) for component in cross]
        along = sum(component * total for component, total in zip(cross, normal, strict=True))
        # Halves that cancel, as those of a bow-tie, have no normal to be turned against.
        cancelled = ~np.any(normal, axis=0) & np.any(cross, axis=(0, 1))
        wrong: NDArray[np.bool_] = there & ((along < 0).any(axis=0) | cancelled)
    return wrong


def _cut_notched(positions: _Floats, polygons: _Ints) -> Iterator[tuple[int, _Ints | None]]:
    """For each of the polygons (s, n) whose fan is wrong, its row and its triangles; None where they cannot be cut.

    The triangles are (n - 2, 3) numbers of the polygon's corners, fewer where it goes there and back.
    """
    points = positions[polygons]
    points = points - points[:, :1]
    points = np.ldexp(points, -np.frexp(np.abs(points).max(axis=(1, 2), keepdims=True))[1])
    before, after = points[:, 1:-1], points[:, 2:]
    cross = np.cross(before, after)
    normals = cross.sum(axis=1, keepdims=True)
    lengths = np.linalg.norm(normals, axis=2, keepdims=True)
    normals = normals / np.where(lengths > 0.0, lengths, 1.0)
    sizes = np.linalg.norm(before, axis=2) * np.linalg.norm(after, axis=2)
    turned = (cross * normals).sum(axis=2) < _TURNED_OVER * sizes
    notched = turned.any(axis=1) | (lengths[:, 0, 0] == 0.0)
    planar = (np.ptp((points * normals).sum(axis=2), axis=1) <= _OUT_OF_PLANE) & (lengths[:, 0, 0] > 0.0)
    flat = _projected(points, normals[:, 0])
    for k in np.flatnonzero(notched):
        yield int(k), _cut_outline(flat[k]) if planar[k] else None


def _cut_outline(outline: _Floats) -> _Ints | None:
    """Triangles of an outline (n, 2) that is wound counter-clockwise; None where they do not cover it once."""
    triangles = _covered(outline)
    if triangles is not None or len(outline) > _MOST_TOUCHING:
        return triangles
    ring = _with_touching(outline)
    triangles = _covered(outline[ring]) if len(ring) > len(outline) else None
    return None if triangles is None else ring[triangles]


def _covered(outline: _Floats) -> _Ints | None:
    """``_cut_outline`` of an outline whose corners lie beside its edges, or on their other corners."""
    # Imported here, because few files have such polygons.
    from mapbox_earcut import triangulate_float64

    ends, fan = np.array([len(outline)], np.uint32), np.arange(1, len(outline) - 1)
    whole = _doubled_areas(outline, np.stack([0 * fan, fan, fan + 1], axis=1))
    # What is missing is more than the sums round.
    room = _ROUNDED * len(outline) * np.abs(whole).sum()
    for first in range(min(len(outline), _TRIES)):  # from another corner it may find what it did not
        places = triangulate_float64(np.roll(outline, -first, axis=0), ends).reshape(-1, 3)
        triangles: _Ints = (places.astype(np.int64) + first) % len(outline)
        areas = _doubled_areas(outline, triangles)
        if len(areas) and areas.min() >= -_FLAT and abs(areas.sum() - whole.sum()) <= room:
            return triangles
    return None


def _with_touching(outline: _Floats) -> _Ints:
    """The numbers of an outline's corners, also between the ends of each edge on which they lie but for rounding; each
    once where edges cross.
    """
    n = len(outline)
    starts, ends = outline, np.roll(outline, -1, axis=0)
    along = (ends - starts)[:, None]
    to = outline[None] - starts[:, None]
    squares = (along**2).sum(axis=2)
    places = (to * along).sum(axis=2) / np.where(squares > 0.0, squares, 1.0)
    off = along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0]
    on_line = np.abs(off) <= _FLAT * np.sqrt(squares)
    own, sides = np.arange(n), np.where(on_line, 0.0, np.sign(off))
    apart = sides * np.roll(sides, -1, axis=1) < 0.0
    if (apart & apart.T).any():
        return own
    touching = on_line & (places > 0.0) & (places < 1.0)
    touching[own, own] = touching[own, (own + 1) % n] = False
    edges, corners = np.nonzero(touching)
    order = np.lexsort((places[edges, corners], edges))
    return np.insert(own, edges[order] + 1, corners[order])


def _doubled_areas(outline: _Floats, triangles: _Ints) -> _Floats:
    a, b, c = np.moveaxis(outline[triangles], 1, 0)
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])


def _projected(points: _Floats, normals: _Floats) -> _Floats:
    """(s, n, 2): the points without the axis along which the normal is longest, wound counter-clockwise.

    Unlike a projection onto axes within the plane, this rounds nothing: points on a line stay on it.
    """
    longest = np.abs(normals).argmax(axis=1)
    turned = np.take_along_axis(normals, longest[:, None], axis=1)[:, 0] < 0
    kept = (longest[:, None] + np.where(turned[:, None], [2, 1], [1, 2])) % 3
    return np.take_along_axis(points, kept[:, None, :], axis=2)
