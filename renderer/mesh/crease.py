"""Smooth normals that stop at sharp edges: vertices are split where an edge is sharper than an angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.mesh.edges import sides

if TYPE_CHECKING:
    from renderer.mesh.mesh import Mesh

Indices = NDArray[np.int64]


class Split:
    """The vertices of a mesh, split at its sharp edges.

    faces    (F, 3), the new vertex of each corner
    vertices (n,), the old vertex of each new one
    group    (3 F,), for each corner the number of those around its place that share a normal
    """

    def __init__(self, mesh: Mesh, angle: float) -> None:
        joined = _joined_corners(mesh, angle)
        _, self.group = np.unique(_components(3 * len(mesh.faces), *joined), return_inverse=True)
        # Vertices at one place may differ in colour or texture, so that one group may have several.
        keys = self.group.astype(np.int64) * max(len(mesh.vertices), 1) + mesh.faces.ravel()
        _, first, corner = np.unique(keys, return_index=True, return_inverse=True)
        self.faces = corner.reshape(-1, 3)
        self.vertices = mesh.faces.ravel()[first]
        self.group_of_vertex = self.group[first]


class SmoothEdges(NamedTuple):
    """Pairs of faces that share an edge which is not sharp; of three faces at one edge there are two pairs.

    one, other  (k,), the sides of the two faces there: 3 f + k for that from corner k of face f to the next
    back        (k,), whether one runs the other way than the other, as with faces that are turned alike
    """

    one: Indices
    other: Indices
    back: NDArray[np.bool_]


def smooth_edges(mesh: Mesh, angle: float) -> SmoothEdges:
    """The edges of ``mesh`` where the normals of the faces differ by at most ``angle``.

    Faces without area have no normal, and no edge of theirs is sharp.
    """
    expect(0.0 <= angle <= 180.0, "crease", "an angle from 0 to 180 degrees", repr(angle))
    start, _, edge = sides(mesh.vertices, mesh.faces)
    order = np.argsort(edge.ravel(), kind="stable")
    same = np.flatnonzero(np.diff(edge.ravel()[order]) == 0)
    one, other = order[same], order[same + 1]
    normals, least = mesh.face_normals(), float(np.cos(np.radians(angle)))
    flat = np.equal(np.abs(normals).max(axis=1, initial=0.0), 0.0)
    cosine = np.einsum("nk,nk->n", normals[one // 3], normals[other // 3])
    # rule: sharp-edge
    smooth = (cosine >= least) | flat[one // 3] | flat[other // 3]
    one, other = one[smooth], other[smooth]
    return SmoothEdges(one, other, start.ravel()[one] != start.ravel()[other])


def _joined_corners(mesh: Mesh, angle: float) -> tuple[Indices, Indices]:
    """Pairs of corners of faces that share an edge which is not sharp, at either end of it."""
    one, other, back = smooth_edges(mesh, angle)
    near, far = np.where(back, _next(other), other), np.where(back, other, _next(other))
    return np.concatenate([one, _next(one)]), np.concatenate([near, far])


def _next(corner: Indices) -> Indices:
    """The corner after each in its face."""
    return corner - corner % 3 + (corner + 1) % 3


def _components(count: int, one: Indices, other: Indices) -> Indices:
    """The least number of the component of each of ``count`` nodes in the graph of these edges."""
    label = np.arange(count)
    while True:
        least = np.minimum(label[one], label[other])
        further = label.copy()
        np.minimum.at(further, label[one], least)
        np.minimum.at(further, label[other], least)
        further = further[further]
        if np.array_equal(further, label):
            return label
        label = further
