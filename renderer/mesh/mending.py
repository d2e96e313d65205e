"""What generators get wrong, mended on request: corners at one place that are several vertices, and faces twice."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def places(vertices: NDArray[np.float64]) -> Ints:
    """A number for each vertex that those at the same place share."""
    # 0.0 added, so that -0.0 is the same place.
    rows = np.ascontiguousarray(vertices + 0.0).view("V24").ravel()
    return np.unique(rows, return_inverse=True)[1].ravel().astype(np.int64)


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


def _close_pairs(points: NDArray[np.float64], tolerance: float) -> Ints:
    """Pairs of points at most ``tolerance`` apart, (k, 2): those in cells of that size beside each other are tried."""
    cells = np.floor((points - points.min(axis=0)) / tolerance).astype(np.int64)
    order = np.lexsort(cells.T[::-1])
    starts = np.unique(cells[order], axis=0, return_index=True)[1]
    rows = {tuple(cell): k for k, cell in enumerate(cells[order][starts].tolist())}
    ends = np.append(starts[1:], len(order))
    found = [np.empty((0, 2), np.int64)]
    steps = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) >= (0, 0, 0)]
    for (x, y, z), k in rows.items():
        mine = order[starts[k] : ends[k]]
        for dx, dy, dz in steps:
            other = rows.get((x + dx, y + dy, z + dz))
            if other is None:
                continue
            theirs = order[starts[other] : ends[other]]
            near = np.linalg.norm(points[mine][:, None] - points[theirs][None], axis=2) <= tolerance
            i, j = np.nonzero(np.triu(near, 1) if other == k else near)
            found.append(np.stack([mine[i], theirs[j]], axis=1))
    return np.concatenate(found)


class Twins(NamedTuple):
    """Of each face a number that faces with the same corners share, and whether it is wound as the lowest of them."""

    number: Ints
    alike: NDArray[np.bool_]


def twins(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> Twins:
    """Faces with the same three corners, told apart by position, from whichever corner and either way round."""
    corners = places(vertices)[faces]
    order = np.argsort(corners, axis=1, kind="stable")
    number = np.unique(np.take_along_axis(corners, order, axis=1), axis=0, return_inverse=True)[1].ravel()
    # Sorting is an even permutation where the corners already go round that way.
    even = ((order[:, 1] - order[:, 0]) % 3) == 1
    _, first = np.unique(number, return_index=True)
    return Twins(number.astype(np.int64), even == even[first[number]])


def cancels(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> bool:
    """Whether each face is there as often one way round as the other, so that together they bound nothing."""
    corners = places(vertices)[faces]
    flat = (corners == np.roll(corners, 1, axis=1)).any(axis=1)  # two corners at one place bound nothing
    number, alike = twins(vertices, faces[~flat])
    balance = np.bincount(number, weights=np.where(alike, 1.0, -1.0))
    return len(faces) > 0 and not balance.any()
