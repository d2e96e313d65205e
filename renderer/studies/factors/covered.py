"""Faces that lie on others: undersides of what stands on a floor, walls of houses that touch, both sides of a plate."""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.queryable import Built, Queries

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
# Places on a face: its middle, and points near its corners.
_PLACES = np.array([[1, 1, 1], [8, 1, 1], [1, 8, 1], [1, 1, 8]], float)
_PLACES /= _PLACES.sum(axis=1, keepdims=True)
# How far before a face another may lie, as a share of its longest side: far above rounding, far below any gap that
# people model.
_GAP = 2.0**-20


class Twins(NamedTuple):
    """The faces that lie on others, of F faces.

    twin     (F,) int64: a face that shows its back where the face shows its front, at its middle; -1 for none
    covered  (F,) bool: whether there is one at all places that are looked at, and behind the face a body's inside: an
             underside, not one side of a plate
    """

    twin: Integers
    covered: NDArray[np.bool_]


# Those of each octree, with the mesh and tree that they were found in: calls for points look for them once.
_FOUND: WeakKeyDictionary[Queries, tuple[Built, Twins]] = WeakKeyDictionary()


def twins_of(octree: Queries) -> Twins:
    """The ``Twins`` of a mesh."""
    built = octree._built
    last = _FOUND.get(octree)
    if last is None or last[0] is not built:
        last = _FOUND[octree] = built, _search(octree)
    return last[1]


def _search(octree: Queries) -> Twins:
    mesh, normals = octree.mesh, octree.mesh.face_normals()
    twin = np.full(len(mesh.faces), -1)
    sound = np.flatnonzero(normals.any(axis=1))
    twin[sound] = _backs_on(octree, sound, _PLACES[0])
    covered = twin >= 0
    for place in _PLACES[1:]:
        faces = np.flatnonzero(covered)
        covered[faces] = _backs_on(octree, faces, place) >= 0
    faces = np.flatnonzero(covered)
    starts, gaps = _places(mesh, faces, _PLACES[0])
    behind = octree.closest_hit(starts - gaps[:, None] * normals[faces], -normals[faces])
    assert behind.side is not None
    covered[faces] = behind.side < 0
    return Twins(twin, covered)


def _backs_on(octree: Queries, faces: Integers, place: Floats) -> Integers:
    """For some faces one that shows its back where they show their front, at a place by barycentrics; -1 for none."""
    normals = octree.mesh.face_normals()[faces]
    starts, gaps = _places(octree.mesh, faces, place)
    hits = octree.all_hits(starts + gaps[:, None] * normals, -normals, t_max=2.0 * gaps)
    assert hits.side is not None
    found = np.full(len(faces), -1)
    # rule: backs-on-faces
    backs = hits.side < 0
    found[hits.ray[backs]] = hits.face[backs]
    return found


def _places(mesh: Mesh, faces: Integers, place: Floats) -> tuple[Floats, Floats]:
    """Points (n, 3) of faces, and how far from each something lies on it, (n,)."""
    corners = mesh.triangles[faces]
    gaps = _GAP * np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=(1, 2), initial=0.0)
    return (corners * place[:, None]).sum(axis=1), gaps
