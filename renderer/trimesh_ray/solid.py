"""The faces of a mesh that bound its inside, where several stand at one place.

A body that is there twice has an inside if faces at one place count once. Of two bodies that share a wall both of its
faces count: a way out passes two. So each part of a mesh is taken in the first of these two ways by which it is closed,
and in the first where it is open in both. A part that is there several times as a whole counts as if it were once.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.edges import sides
from renderer.trimesh_ray.distinct import standing_together

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


def solid_faces(vertices: Floats, faces: NDArray[np.integer[Any]], rows: Integers, distinct: Integers) -> Integers:
    """The rows of faces that bound the inside, ascending.

    rows      of all faces that have a place
    distinct  of those of them that stand where none before them does
    """
    if len(distinct) == len(rows):
        return distinct
    edges, bounding = _edges(vertices, faces[rows])
    once = np.isin(rows, distinct, assume_unique=True)
    odd_once = _is_odd(edges, bounding & once[:, None])
    if not odd_once.any():
        return distinct
    place, many = standing_together(edges)
    part = _parts(edges[once], bounding[once])[place[once].argsort()][place]
    many //= _common(part, many)
    odd = _is_odd(edges, bounding & (once & (many % 2 == 1))[:, None])
    all_count = (_any_in(part, odd_once[edges]) & ~_any_in(part, odd[edges]))[part]
    both = all_count & (many % 2 == 0) & _is_second(place)
    return rows[once | both] if both.any() else distinct


def _edges(vertices: Floats, faces: NDArray[np.integer[Any]]) -> tuple[Integers, Flags]:
    """The number (f, 3) of each side's edge, and whether the side bounds anything: from a place to itself none does.

    Edges with the same end positions are one edge.
    """
    start, end, keys = sides(vertices, faces)
    return np.unique(keys, return_inverse=True)[1].reshape(faces.shape).astype(np.int64), start != end


def _is_odd(edges: Integers, counted: Flags) -> Flags:
    """Whether each edge has an odd number of the counted sides."""
    odd: Flags = np.bincount(edges[counted], minlength=edges.max() + 1) % 2 == 1
    return odd


def _parts(edges: Integers, bounding: Flags) -> Integers:
    """The lowest face (f,) of the part that each of distinct faces belongs to: faces with a common edge are of one."""
    sides = np.flatnonzero(bounding.ravel())
    owner, edge = sides // 3, edges.ravel()[sides]
    part = np.arange(len(edges))
    while True:
        low = np.full(edges.max() + 1, len(edges))
        np.minimum.at(low, edge, part[owner])
        nearer = part.copy()
        np.minimum.at(nearer, owner, low[edge])
        # The lowest face of a part hears too, and then all that name it: chains halve, however they are numbered.
        np.minimum.at(nearer, part, nearer.copy())
        nearer = nearer[nearer]
        if np.array_equal(nearer, part):
            return part
        part = nearer


def _common(part: Integers, many: Integers) -> Integers:
    """The greatest number (f,) that divides ``many`` of all faces in each face's part."""
    common = np.zeros(part.max() + 1, np.int64)
    np.gcd.at(common, part, many)
    return common[part]


def _any_in(part: Integers, sides: Flags) -> Flags:
    """Whether any side (f, 3) of any face in each part is set, by the part's lowest face."""
    found = np.zeros(part.max() + 1, np.bool_)
    found[part[sides.any(axis=1)]] = True
    return found


def _is_second(place: Integers) -> Flags:
    """Whether exactly one face before each stands at its place."""
    order = np.argsort(place, kind="stable")
    first = np.r_[True, place[order][1:] != place[order][:-1]]
    since = np.arange(len(place)) - np.maximum.accumulate(np.where(first, np.arange(len(place)), 0))
    second = np.zeros(len(place), np.bool_)
    second[order] = since == 1
    return second
