"""The faces of a mesh that bound its inside, where several stand at one place.

A body that is there twice has an inside if faces at one place count once. Of two bodies that share a wall both of its
faces count: a way out passes two. So each part of a mesh, of faces that hang together by edges, is taken in the first
of these two ways by which it is closed.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def solid_faces(vertices: Floats, faces: NDArray[np.integer[Any]], rows: Integers, distinct: Integers) -> Integers:
    """The rows of faces that bound the inside, ascending.

    rows      of all faces that have a place
    distinct  of those of them that stand where none before them does
    """
    if len(distinct) == len(rows):
        return distinct
    edges = _edges(vertices, faces[rows])
    once = np.isin(rows, distinct, assume_unique=True)
    odd_once, odd = _is_odd(edges, once), _is_odd(edges, np.ones(len(rows), np.bool_))
    if not odd_once.any():
        return distinct
    part = _parts(edges)
    is_open, is_open_once = (_any_in(part, side_open) for side_open in (odd[edges], odd_once[edges]))
    both = (is_open_once & ~is_open)[part]
    return rows[once | both] if both.any() else distinct


def _edges(vertices: Floats, faces: NDArray[np.integer[Any]]) -> Integers:
    """The number (f, 3) of each side's edge; edges are told apart by the places of their ends."""
    place = np.unique(np.ascontiguousarray(vertices + 0.0).view("V24").ravel(), return_inverse=True)[1].ravel()
    start, end = place[faces], np.roll(place[faces], -1, axis=1)
    keys = np.minimum(start, end).astype(np.int64) * len(vertices) + np.maximum(start, end)
    return np.unique(keys, return_inverse=True)[1].reshape(faces.shape).astype(np.int64)


def _is_odd(edges: Integers, counted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether an odd number of the counted faces has each edge."""
    odd: NDArray[np.bool_] = np.bincount(edges[counted].ravel(), minlength=edges.max() + 1) % 2 == 1
    return odd


def _parts(edges: Integers) -> Integers:
    """The lowest face (f,) of the part that each face belongs to: faces with a common edge are of one part."""
    part = np.arange(len(edges))
    while True:
        low = np.full(edges.max() + 1, len(edges))
        np.minimum.at(low, edges.ravel(), np.repeat(part, 3))
        nearer = low[edges].min(axis=1)
        # The part of a part's lowest face is its own: chains of any length halve each time.
        nearer = np.minimum(nearer, nearer[nearer])
        if np.array_equal(nearer, part):
            return part
        part = nearer


def _any_in(part: Integers, sides: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether any side of any face in each part is set, by the part's lowest face."""
    found = np.zeros(len(part), np.bool_)
    np.logical_or.at(found, part, sides.any(axis=1))
    return found
