"""Among the faces that meet at a nearest point, the one that faces the query most, as trimesh chooses."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Faces looked at together: some 100 MB.
_TOGETHER = 1 << 20
# Weights that rounding leaves of 0: 1 - u - v of an edge.
_NO_WEIGHT = 2.0**-50


class _Rings(NamedTuple):
    """The faces around each vertex i, ``faces[starts[i] : starts[i + 1]]``, and the corners (f, 3) of all faces."""

    starts: Integers
    faces: Integers
    corners: Integers


def facing_faces(mesh: Any, points: Floats, nearest: Floats, faces: Integers, weights: Floats) -> Integers:
    """For each of ``points`` (n, 3) a face (n,) that has its ``nearest`` point, the one least aslant to the query.

    mesh     a ``trimesh.Trimesh``
    faces    (n,) of each nearest point, one face
    weights  (n, 3) of that face's corners. Where two are 0 the point is the third corner, where one is 0 it lies on an
             edge; the faces with those corners, told apart by index, have it too

    Of equally aslant ones it is the first.
    """
    chosen, has = faces.copy(), weights > _NO_WEIGHT
    shared = np.flatnonzero(~has.all(axis=1))
    rings = _rings(mesh)
    # The faces around one corner of the edge or corner; those that have the other corner too will count.
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
        chosen[rows] = _least_aslant(mesh, points[rows] - nearest[rows], owner[there], candidates[there])
        begin = end
    return chosen


def _rings(mesh: Any) -> _Rings:
    corners = np.asarray(mesh.faces)
    starts = np.zeros(len(mesh.vertices) + 1, np.int64)
    np.cumsum(np.bincount(corners.ravel(), minlength=len(mesh.vertices)), out=starts[1:])
    return _Rings(starts, np.argsort(corners.ravel(), kind="stable") // 3, corners)


def _around(rings: _Rings, vertices: Integers) -> tuple[Integers, Integers]:
    """The faces around each of some vertices, (m,), after the vertex's place among them, (m,)."""
    counts = rings.starts[vertices + 1] - rings.starts[vertices]
    owner = np.repeat(np.arange(len(vertices)), counts)
    offset = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, rings.faces[rings.starts[vertices][owner] + offset]


def _least_aslant(mesh: Any, ways: Floats, owner: Integers, candidates: Integers) -> Integers:
    """Of the candidates of each of the ``ways`` (k, 3) the one whose normal has the largest product with it, (k,)."""
    products = np.einsum("ij,ij->i", np.asarray(mesh.face_normals)[candidates], ways[owner])
    order = np.lexsort((candidates, -products, owner))
    return candidates[order[np.searchsorted(owner[order], np.arange(len(ways)))]]
