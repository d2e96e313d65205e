"""Among the faces that meet at a nearest point, the one that faces the query most, as trimesh chooses."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.trimesh_ray.distinct import standing_together

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Faces looked at together: some 100 MB.
_TOGETHER = 1 << 20
# Weights that rounding leaves of 0: 1 - u - v of an edge.
_NO_WEIGHT = 2.0**-50


class Rings(NamedTuple):
    """The faces around each place of a vertex i, ``faces[starts[i] : starts[i + 1]]``; the corners (f, 3) of all faces,
    as numbers of places; and which faces stand where another does.
    """

    starts: Integers
    faces: Integers
    corners: Integers
    again: NDArray[np.bool_]


def rings_of(vertices: Floats, faces: NDArray[np.integer[Any]], rows: Integers) -> Rings:
    """The rings of the faces in ``rows``; vertices at one position are one vertex."""
    _, places = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    corners = places.reshape(-1)[faces]
    there = corners[rows]
    starts = np.zeros(len(vertices) + 1, np.int64)
    np.cumsum(np.bincount(there.ravel(), minlength=len(vertices)), out=starts[1:])
    around = rows[np.argsort(there.ravel(), kind="stable") // 3]
    return Rings(starts, around, corners, standing_together(corners)[1] > 1)


def facing_faces(
    rings: Rings, normals: Floats, points: Floats, nearest: Floats, faces: Integers, weights: Floats
) -> Integers:
    """For each of ``points`` (n, 3) a face (n,) that has its ``nearest`` point, the one least aslant to the query.

    normals  (f, 3) of the mesh's faces
    faces    (n,) of each nearest point, one face
    weights  (n, 3) of that face's corners. Where two are 0 the point is the third corner, where one is 0 it lies on an
             edge: the faces with those corners have it too; else those with all three

    Of equally aslant ones it is the first.
    """
    chosen, has = faces.copy(), weights > _NO_WEIGHT
    shared = np.flatnonzero(~has.all(axis=1) | rings.again[faces])
    # The faces around one corner; those that have the other corners too will count.
    first = rings.corners[faces[shared], has[shared].argmax(axis=1)]
    ends = np.cumsum(rings.starts[first + 1] - rings.starts[first])
    begin = 0
    while begin < len(shared):
        end = int(np.searchsorted(ends, (ends[begin - 1] if begin else 0) + _TOGETHER, side="right"))
        rows, end = shared[begin : max(end, begin + 1)], max(end, begin + 1)
        owner, candidates = _around(rings, first[begin:end])
        needed = rings.corners[faces[rows]][owner]
        found = (needed[:, :, None] == rings.corners[candidates][:, None, :]).any(axis=2)
        there = (found | ~has[rows][owner]).all(axis=1)
        chosen[rows] = _least_aslant(normals, points[rows] - nearest[rows], owner[there], candidates[there])
        begin = end
    return chosen


def _around(rings: Rings, vertices: Integers) -> tuple[Integers, Integers]:
    """The faces around each of some vertices, (m,), after the vertex's place among them, (m,)."""
    counts = rings.starts[vertices + 1] - rings.starts[vertices]
    owner = np.repeat(np.arange(len(vertices)), counts)
    offset = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, rings.faces[rings.starts[vertices][owner] + offset]


def _least_aslant(normals: Floats, ways: Floats, owner: Integers, candidates: Integers) -> Integers:
    """Of the candidates of each of the ``ways`` (k, 3) the one whose normal has the largest product with it, (k,)."""
    products = np.einsum("ij,ij->i", normals[candidates], ways[owner])
    order = np.lexsort((candidates, -products, owner))
    return candidates[order[np.searchsorted(owner[order], np.arange(len(ways)))]]
