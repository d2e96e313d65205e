"""Faces that lie on others: the underside of what stands on a floor, and the walls of houses that touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.queryable import Queries

# Places on a face: its middle, and points near its corners.
_PLACES = np.array([[1, 1, 1], [8, 1, 1], [1, 8, 1], [1, 1, 8]], float)
_PLACES /= _PLACES.sum(axis=1, keepdims=True)
# How far before a face another may lie, as a share of its longest side: far above rounding, far below any gap that
# people model.
_GAP = 2.0**-20


def covered_faces(octree: Queries) -> NDArray[np.bool_]:
    """Whether backs of other faces lie on the front of each face, (F,) bool: at its middle and near its corners."""
    mesh, normals = octree.mesh, octree.mesh.face_normals()
    covered: NDArray[np.bool_] = np.asarray(normals.any(axis=1))
    for place in _PLACES:
        faces = np.flatnonzero(covered)
        covered[faces] = _are_covered(octree, mesh, faces, normals[faces], place)
    return covered


def _are_covered(
    octree: Queries, mesh: Mesh, faces: NDArray[np.int64], normals: NDArray[np.float64], place: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the back of another face lies on each of some faces, at a place by barycentrics."""
    corners = mesh.triangles[faces]
    gaps = _GAP * np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=(1, 2))
    starts = (corners * place[:, None]).sum(axis=1) + gaps[:, None] * normals
    hits = octree.all_hits(starts, -normals, t_max=2.0 * gaps)
    assert hits.side is not None
    # rule: backs-on-faces
    rows = hits.ray[hits.side < 0]
    found = np.zeros(len(faces), np.bool_)
    found[rows] = True
    return found
