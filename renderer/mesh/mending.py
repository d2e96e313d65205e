"""Mends common faults of generators, on request: corners at one place that are several vertices, and faces twice."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.edges import places

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# So many distances are computed at once.
_BLOCK = 1 << 20


def joined(vertices: NDArray[np.float64], tolerance: float) -> Ints:
    """The vertex that each one becomes: the first at its place, or the first that it is within ``tolerance`` of, by
    steps over others.
    """
    place = places(vertices)
    if tolerance > 0.0:
        place = _linked(vertices, place, tolerance)
    _, first, number = np.unique(place, return_index=True, return_inverse=True)
    found: Ints = first[number.ravel()]
    return found


def _linked(vertices: NDArray[np.float64], place: Ints, tolerance: float) -> Ints:
    """The numbers of places, those linked by pairs closer than ``tolerance`` being one."""
    _, first = np.unique(place, return_index=True)
    points = vertices[first]
    pairs = _close_pairs(points, tolerance)
    number = np.arange(len(points))
    while True:
        least = number.copy()
        np.minimum.at(least, pairs[:, 0], number[pairs[:, 1]])
        np.minimum.at(least, pairs[:, 1], number[pairs[:, 0]])
        least = least[least]
        if np.array_equal(least, number):
            return number[place]
        number = least


def _close_pairs(points: Floats, tolerance: float) -> Ints:
    """Pairs of points at most ``tolerance`` apart, (k, 2): those in the same cell or cells beside each other are tried.

    Cells are as wide as twice the tolerance. A cell's number that float64 does not hold to a half is that of points so
    far out that others differ by more than the tolerance.
    """
    with np.errstate(over="ignore"):
        cells = np.floor(points / tolerance / 2.0)
    order = np.lexsort(cells.T[::-1])
    starts = np.unique(cells[order], axis=0, return_index=True)[1]
    rows = {tuple(cell): k for k, cell in enumerate(cells[order][starts].tolist())}
    ends = np.append(starts[1:], len(order))
    found = [np.empty((0, 2), np.int64)]
    for cell, k in rows.items():
        mine = order[starts[k] : ends[k]]
        for other in _around(cell, rows):
            found += _pairs(points, mine, order[starts[other] : ends[other]], tolerance)
    return np.concatenate(found)


def _around(cell: tuple[float, ...], rows: dict[tuple[float, ...], int]) -> set[int]:
    """The cells at ``cell`` and beside it, each pair of cells from one of its sides."""
    steps = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) >= (0, 0, 0)]
    beside = (rows.get((cell[0] + x, cell[1] + y, cell[2] + z)) for x, y, z in steps)
    return {row for row in beside if row is not None}


def _pairs(points: Floats, mine: Ints, theirs: Ints, tolerance: float) -> Iterator[Ints]:
    """Pairs of different points, a block at a time so that memory stays small."""
    step = max(1, _BLOCK // len(theirs))
    for begin in range(0, len(mine), step):
        some = mine[begin : begin + step]
        with np.errstate(over="ignore"):
            x, y, z = np.moveaxis(points[some][:, None] - points[theirs][None], 2, 0)
            near = np.hypot(np.hypot(x, y), z) <= tolerance
        i, j = np.nonzero(near)
        yield np.stack([some[i], theirs[j]], axis=1)[some[i] != theirs[j]]


class Twins(NamedTuple):
    """Of each face a number that faces with the same corners share, and whether it is wound as the lowest of them."""

    number: Ints
    alike: NDArray[np.bool_]


def twins(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> Twins:
    """Faces with the same three corner positions, from whichever corner and either way round."""
    return _twins(places(vertices)[faces])


def _twins(corners: Ints) -> Twins:
    """The same of faces by the places of their corners, (F, 3)."""
    order = np.argsort(corners, axis=1, kind="stable")
    number = np.unique(np.take_along_axis(corners, order, axis=1), axis=0, return_inverse=True)[1].ravel()
    # Sorting is an even permutation where the corners already go round that way.
    even = ((order[:, 1] - order[:, 0]) % 3) == 1
    _, first = np.unique(number, return_index=True)
    return Twins(number.astype(np.int64), even == even[first[number]])


def enclosed_share(bounds: tuple[Floats, Floats], triangles: Floats) -> float:
    """The share of their box that triangles (F, 3, 3) enclose, less than nothing where they are inside out."""
    lower, upper = bounds
    sides = np.where(upper > lower, upper / 2 - lower / 2, 1.0)
    a, b, c = np.moveaxis((triangles - (lower / 2 + upper / 2)) / sides, 1, 0)  # within a box from -1 to 1
    return float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum()) / 48.0


def cancels(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> bool:
    """Whether each face is there as often one way round as the other, so that together they bound nothing."""
    corners = places(vertices)[faces]
    flat = (corners == np.roll(corners, 1, axis=1)).any(axis=1)  # two corners at one place bound nothing
    number, alike = _twins(corners[~flat])
    balance = np.bincount(number, weights=np.where(alike, 1.0, -1.0))
    return len(faces) > 0 and not balance.any()
