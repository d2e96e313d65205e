"""Finds the points that lie on the surface, up to roundings, and their places there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.distance.closest import closest_point
from renderer.distance.place_on_face import DOUBLE, SINGLE, anchor_all, measure_all
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.results.hits import points_on
from renderer.trace.layout import Tree
from renderer.trace.spawn import FARTHEST_START
from renderer.trace.starts.record import BARYCENTRIC

Floats = NDArray[np.float64]


class SurfacePoints(NamedTuple):
    """The places of points on the surface.

    faces    (n,) int64, the face of each point, -1 for a point on none
    codes    (n,) int64, BARYCENTRIC of ``starts.record`` or 0: the kind of anchor
    anchors  (n, 3) float64: the place if float64 represents it, else its barycentrics u and v, and 0
    """

    faces: NDArray[np.int64]
    codes: NDArray[np.int64]
    anchors: Floats


def on_surface(tree: Tree, mesh: Mesh, points: Floats, faces: NDArray[np.int64], threads: int) -> SurfacePoints:
    """The places of points (n, 3) on the surface.

    A point lies on its face in ``faces`` (n,). If that is -1, it lies on the nearest face if its distance is at most
    DOUBLE of its largest coordinate; or, for a point of float32 numbers, if each coordinate is off by at most SINGLE of
    itself. A point as near to an edge or corner is taken to be on it.
    """
    faces, rough, unknown = faces.copy(), _are_single(points), np.flatnonzero(faces < 0)
    if len(unknown) and len(mesh.faces):
        room = DOUBLE * np.abs(points[unknown]).max(axis=1, initial=0.0)
        faces[unknown] = closest_point(tree, mesh, points[unknown], room, threads).face
        unknown = unknown[rough[unknown] & (faces[unknown] < 0)]
        faces[unknown] = _near_faces(tree, mesh, points[unknown], threads)
    anchors, codes = np.zeros((len(points), 3)), np.zeros(len(points), np.int64)
    anchor_all(mesh.vertices, mesh.faces, points, faces, rough, codes, anchors)
    return SurfacePoints(faces, codes, anchors)


def _are_single(points: Floats) -> NDArray[np.bool_]:
    """Whether all coordinates of each point are float32 numbers."""
    with np.errstate(over="ignore", invalid="ignore"):
        return (points == points.astype(np.float32)).all(axis=1)


def _near_faces(tree: Tree, mesh: Mesh, points: Floats, threads: int) -> NDArray[np.int64]:
    """The faces on which points lie up to SINGLE of each coordinate, -1 for none."""
    room = SINGLE * np.abs(points)
    near = closest_point(tree, mesh, points, 2.0 * room.max(axis=1, initial=0.0), threads)
    # The length of the vector to the nearest point, along itself, against the room of the roundings along it.
    way = np.abs(points - near.points)
    return np.where((way * way).sum(axis=1) <= (way * room).sum(axis=1), near.face, -1)


def places_of(mesh: Mesh, points: Floats, places: SurfacePoints) -> Floats:
    """Points (n, 3), with those on the surface moved to their places there."""
    found, on = points.copy(), places.faces >= 0
    found[on] = places.anchors[on]
    rounded = np.flatnonzero(on & (places.codes == BARYCENTRIC))
    u, v = places.anchors[rounded, :2].T
    found[rounded] = points_on(mesh, places.faces[rounded], u, v)
    return found


def check_on(mesh: Mesh, argument: str, points: Floats, faces: NDArray[np.int64]) -> None:
    """Raise ``ValueError`` naming the row of a point farther from its face than float32 rounding explains.

    faces  (n,), -1 for a point without a named face
    """
    named = np.flatnonzero(faces >= 0)
    if not len(named):
        return
    largest = np.maximum(np.abs(points[named]).max(axis=1, initial=0.0), np.abs(mesh.vertices).max(initial=0.0))
    far = _are_farther(mesh, points[named], faces[named], FARTHEST_START * largest)
    if far.any():
        row = int(named[far.argmax()])
        expected = f"points on the faces that they name, within {FARTHEST_START:.1g} times the largest coordinate"
        expect(False, argument, expected, f"{points[row].tolist()} and face {faces[row]} in row {row}")


def are_on(mesh: Mesh, points: Floats, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether points (n, 3) lie on faces (n,), within the roundings of float64."""
    return ~_are_farther(mesh, points, faces, DOUBLE * np.abs(points).max(axis=1, initial=0.0))


def _are_farther(mesh: Mesh, points: Floats, faces: NDArray[np.int64], most: Floats) -> NDArray[np.bool_]:
    """Whether points (n, 3) are farther from faces (n,) than ``most`` (n,) along some axis."""
    distances = np.empty(len(points))
    measure_all(mesh.vertices, mesh.faces, points, faces, most, distances)
    return distances > most
