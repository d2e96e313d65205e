"""Points that lie on the surface, within the roundings that they went through, and where on it they lie."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.distance.closest import closest_point
from renderer.distance.place_on_face import DOUBLE, anchor_all, measure_all
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.trace.hits import points_on
from renderer.trace.layout import Tree
from renderer.trace.spawn import FARTHEST_START
from renderer.trace.starts.record import BARYCENTRIC

Floats = NDArray[np.float64]

# How far a point of the surface may be from it, as a share of its largest coordinate, where all coordinates are numbers
# of float32: 64 roundings of these. Else it is DOUBLE.
_SINGLE = 2.0**-18


class SurfacePoints(NamedTuple):
    """Where points lie on the surface.

    faces    (n,) int64, the face that each lies on, -1 for a point that lies on none
    codes    (n,) int64, BARYCENTRIC of ``starts.record`` or 0: how the anchors are given
    anchors  (n, 3) float64: at edges and corners barycentrics u and v, where exactly 0 or 1, and 0; else the point
    """

    faces: NDArray[np.int64]
    codes: NDArray[np.int64]
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
    anchors, codes = np.zeros((len(points), 3)), np.zeros(len(points), np.int64)
    anchor_all(mesh.vertices, mesh.faces, points, faces, room, codes, anchors)
    return SurfacePoints(faces, codes, anchors)


def places_of(mesh: Mesh, points: Floats, places: SurfacePoints) -> Floats:
    """Points (n, 3), those at edges and corners moved to their places there."""
    found = points.copy()
    on = np.flatnonzero(places.codes == BARYCENTRIC)
    u, v = places.anchors[on, :2].T
    found[on] = points_on(mesh, places.faces[on], u, v)
    return found


def check_on(mesh: Mesh, argument: str, points: Floats, faces: NDArray[np.int64]) -> None:
    """Raise ``ValueError`` naming the row of a point that is farther from its face than points of float32 are.

    faces  (n,), -1 for a point of which no face is named
    """
    named = np.flatnonzero(faces >= 0)
    if not len(named):
        return
    largest = np.maximum(np.abs(points[named]).max(axis=1, initial=0.0), np.abs(mesh.vertices).max(initial=0.0))
    far = distances_from(mesh, points[named], faces[named]) > FARTHEST_START * largest
    if far.any():
        row = int(named[far.argmax()])
        expected = f"points on the faces that they name, within {FARTHEST_START:.1g} times the largest coordinate"
        expect(False, argument, expected, f"{points[row].tolist()} and face {faces[row]} in row {row}")


def distances_from(mesh: Mesh, points: Floats, faces: NDArray[np.int64]) -> Floats:
    """How far points (n, 3) are from faces (n,), along the axis where they are farthest."""
    distances = np.empty(len(points))
    measure_all(mesh.vertices, mesh.faces, points, faces, distances)
    return distances


def are_on(mesh: Mesh, points: Floats, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether points (n, 3) lie on faces (n,), within the roundings of float64."""
    return distances_from(mesh, points, faces) <= DOUBLE * np.abs(points).max(axis=1, initial=0.0)


def _room(points: Floats) -> Floats:
    """How far each point may be from the surface that it lies on."""
    with np.errstate(over="ignore", invalid="ignore"):
        single = (points == points.astype(np.float32)).all(axis=1)
    return np.where(single, _SINGLE, DOUBLE) * np.abs(points).max(axis=1, initial=0.0)
