"""Points that lie on the surface, within the roundings that they went through, and where on it they lie."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.distance.closest import closest_point
from renderer.mesh.mesh import Mesh
from renderer.trace.hits import points_on
from renderer.trace.layout import Tree

Floats = NDArray[np.float64]

# How far a point of the surface may be from it, as a share of its largest coordinate: 64 roundings of float32 where all
# coordinates are numbers of float32, else 32 of float64.
_SINGLE, _DOUBLE = 2.0**-18, 2.0**-48


class SurfacePoints(NamedTuple):
    """Where points lie on the surface.

    faces    (n,) int64, the face that each lies on, -1 for a point that lies on none
    anchors  (n, 3) float64, its barycentrics u and v there and 0; exactly 0 or 1 at edges and corners
    """

    faces: NDArray[np.int64]
    anchors: Floats


def on_surface(tree: Tree, mesh: Mesh, points: Floats, faces: NDArray[np.int64], threads: int) -> SurfacePoints:
    """The places of points (n, 3) on the surface: on ``faces`` (n,), or where these are -1 on the nearest face, if it
    is as near as a rounding.

    A point as near to an edge or corner is taken for one on it.
    """
    room = _room(points)
    faces = faces.copy()
    unknown = np.flatnonzero(faces < 0)
    if len(unknown) and len(mesh.faces):
        faces[unknown] = closest_point(tree, mesh, points[unknown], room[unknown], threads).face
    anchors = np.zeros((len(points), 3))
    known = np.flatnonzero(faces >= 0)
    anchors[known, :2] = _barycentrics(mesh.vertices[mesh.faces[faces[known]]], points[known], room[known])
    return SurfacePoints(faces, anchors)


def places_of(mesh: Mesh, points: Floats, places: SurfacePoints) -> Floats:
    """Points (n, 3), those on the surface moved to their places on it."""
    found = points.copy()
    on = np.flatnonzero(places.faces >= 0)
    u, v = places.anchors[on, :2].T
    found[on] = points_on(mesh, places.faces[on], u, v)
    return found


def distances_from(mesh: Mesh, points: Floats, faces: NDArray[np.int64]) -> Floats:
    """How far points (n, 3) are from faces (n,), along the axis where they are farthest."""
    corners = mesh.vertices[mesh.faces[faces]]
    u, v = _barycentrics(corners, points, np.zeros(len(points))).T
    with np.errstate(over="ignore"):
        return np.abs(points - points_on(mesh, faces, u, v)).max(axis=1, initial=0.0)


def are_on(mesh: Mesh, points: Floats, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether points (n, 3) lie on faces (n,), within the roundings of float64."""
    return distances_from(mesh, points, faces) <= _DOUBLE * np.abs(points).max(axis=1, initial=0.0)


def _room(points: Floats) -> Floats:
    """How far each point may be from the surface that it lies on."""
    with np.errstate(over="ignore", invalid="ignore"):
        single = (points == points.astype(np.float32)).all(axis=1)
    return np.where(single, _SINGLE, _DOUBLE) * np.abs(points).max(axis=1, initial=0.0)


def _barycentrics(corners: Floats, points: Floats, room: Floats) -> Floats:
    """u and v (n, 2) of the nearest points of faces; nearer to an edge than ``room`` its weight is 0."""
    sides = np.stack(
        [corners[:, 2] - corners[:, 1], corners[:, 0] - corners[:, 2], corners[:, 1] - corners[:, 0]], axis=1
    )
    ways = points[:, None] - corners
    with np.errstate(all="ignore"):
        # In units of the face, so that no product overflows or vanishes.
        size = np.abs(sides).max(axis=(1, 2), initial=0.0)[:, None, None]
        sides, ways, room = sides / size, ways / size, room / size[:, 0, 0]
        normals = np.cross(sides[:, 2], -sides[:, 1])
        areas = np.linalg.norm(normals, axis=1)
        # The double areas of the point with each side, by the two corners of that side.
        parts = [np.cross(sides[:, k], ways[:, (k + 1) % 3]) for k in range(3)]
        parts = np.stack([np.einsum("nx,nx->n", part, normals) for part in parts], axis=1) / areas[:, None]
        near = parts <= room[:, None] * np.linalg.norm(sides, axis=2)
    weights = np.where(near | ~(parts > 0.0), 0.0, parts)
    lost = ~(weights.sum(axis=1) > 0.0)
    # A face without area is its longest side.
    weights[lost] = _along_longest(sides[lost], ways[lost], room[lost])
    weights /= weights.sum(axis=1, keepdims=True)
    single = np.count_nonzero(weights, axis=1) == 1
    weights[single] = np.where(weights[single] > 0.0, 1.0, 0.0)
    # On the side opposite to the first corner 1 in all: what is left of one is exact if that is at least a half.
    u, v = weights[:, 1], weights[:, 2]
    opposite = weights[:, 0] == 0.0
    v = np.where(opposite & (u >= 0.5), 1.0 - u, v)
    u = np.where(opposite & (u < 0.5), 1.0 - v, u)
    return np.stack([u, v], axis=1)


def _along_longest(sides: Floats, ways: Floats, room: Floats) -> Floats:
    """Weights (n, 3) of the nearest points of the longest sides; within ``room`` of a corner those of the corner."""
    lengths = np.linalg.norm(sides, axis=2)
    rows, longest = np.arange(len(sides)), lengths.argmax(axis=1)
    first, length = (longest + 1) % 3, lengths[rows, longest]
    with np.errstate(all="ignore"):
        along = np.einsum("nx,nx->n", sides[rows, longest], ways[rows, first]) / length
        share = np.where(along > 0.0, np.minimum(along / length, 1.0), 0.0)
        apart = np.linalg.norm(ways, axis=2)
    weights = np.zeros((len(sides), 3))
    weights[rows, first], weights[rows, (longest + 2) % 3] = 1.0 - share, share
    at = ~(apart.min(axis=1) > room)
    weights[at] = np.eye(3)[apart[at].argmin(axis=1)]
    return weights
