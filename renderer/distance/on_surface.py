"""Points that lie on the surface, within the roundings that they went through, and where on it they lie."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.distance.closest import closest_point
from renderer.kernels.jit import inlined, kernel
from renderer.kernels.simd import pointer, smaller
from renderer.kernels.vec3 import (
    barycentric,
    cross,
    dot,
    largest_component,
    largest_of_three,
    length,
    row3,
    scale,
    sub,
)
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
    _weigh_all(mesh.vertices, mesh.faces, points, faces, room, anchors)
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
    distances = np.empty(len(points))
    _measure_all(mesh.vertices, mesh.faces, points, faces, distances)
    return distances


def are_on(mesh: Mesh, points: Floats, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether points (n, 3) lie on faces (n,), within the roundings of float64."""
    return distances_from(mesh, points, faces) <= _DOUBLE * np.abs(points).max(axis=1, initial=0.0)


def _room(points: Floats) -> Floats:
    """How far each point may be from the surface that it lies on."""
    with np.errstate(over="ignore", invalid="ignore"):
        single = (points == points.astype(np.float32)).all(axis=1)
    return np.where(single, _SINGLE, _DOUBLE) * np.abs(points).max(axis=1, initial=0.0)


@kernel
def _weigh_all(vertices, faces, points, chosen, room, anchors):
    """Write u and v (n, 2) of the points of faces ``chosen`` (n,) that are nearest to ``points``; of face -1 nothing.

    Nearer to an edge than its ``room`` (n,), a point has no weight beside that.
    """
    for i in range(len(points)):
        if chosen[i] >= 0:
            corners = _corners(pointer(vertices), pointer(faces), chosen[i])
            anchors[i, 0], anchors[i, 1] = _weights_of(corners, row3(pointer(points), i), room[i])


@kernel
def _measure_all(vertices, faces, points, chosen, distances):
    """Write how far points are from faces, along the axis where they are farthest."""
    for i in range(len(points)):
        o, (p0, p1, p2) = row3(pointer(points), i), _corners(pointer(vertices), pointer(faces), chosen[i])
        u, v = _weights_of((p0, p1, p2), o, 0.0)
        distances[i] = largest_component(sub(o, barycentric(p0, p1, p2, u, v)))


@inlined
def _corners(vertices, faces, face):
    a, b, c = row3(faces, face)
    return row3(vertices, a), row3(vertices, b), row3(vertices, c)


@inlined
def _over(a, size):
    return a[0] / size, a[1] / size, a[2] / size


@kernel
def _weights_of(corners, o, room):
    """u and v of the point of a face that is nearest to o, as ``_weigh_all`` says."""
    p0, p1, p2 = corners
    sides = sub(p2, p1), sub(p0, p2), sub(p1, p0)
    size = largest_of_three(sides[0], sides[1], sides[2])
    if size == 0.0:
        return 0.0, 0.0
    # In units of the face, so that no product overflows or vanishes.
    s0, s1, s2 = _over(sides[0], size), _over(sides[1], size), _over(sides[2], size)
    w0, w1, w2, room = _over(sub(o, p0), size), _over(sub(o, p1), size), _over(sub(o, p2), size), room / size
    n = cross(s2, scale(s1, -1.0))
    area = length(n)
    # The double areas of the point with each side.
    a = _beyond(dot(cross(s0, w1), n) / area, room * length(s0))
    b = _beyond(dot(cross(s1, w2), n) / area, room * length(s1))
    c = _beyond(dot(cross(s2, w0), n) / area, room * length(s2))
    if not a + b + c > 0.0:
        # A face without area is its longest side.
        a, b, c = _along_longest((s0, s1, s2), (w0, w1, w2), room)
    return _exact_shares(a, b, c)


@inlined
def _beyond(part, room):
    """A number where it is more than some room, else 0; also of NaN."""
    return part if part > room else 0.0


@inlined
def _exact_shares(a, b, c):
    """u and v of three weights >= 0, whose sum is not 0: at corners 0 or 1, on the side opposite to the first corner 1
    in all.
    """
    whole = a + b + c
    if b == whole or c == whole:
        return (1.0 if b == whole else 0.0), (1.0 if c == whole else 0.0)
    u, v = b / whole, c / whole
    # What is left of 1 is exact if that is at least a half.
    if a == 0.0:
        return (u, 1.0 - u) if u >= 0.5 else (1.0 - v, v)
    return u, v


@kernel
def _along_longest(sides, ways, room):
    """Weights of the nearest point of the longest side; within ``room`` of a corner those of the corner."""
    (s0, s1, s2), (w0, w1, w2) = sides, ways
    l0, l1, l2 = length(s0), length(s1), length(s2)
    d0, d1, d2 = length(w0), length(w1), length(w2)
    least = smaller(d0, smaller(d1, d2))
    if not least > room:
        return (1.0, 0.0, 0.0) if d0 == least else ((0.0, 1.0, 0.0) if d1 == least else (0.0, 0.0, 1.0))
    if l0 >= l1 and l0 >= l2:
        share = _share_along(s0, w1, l0)
        return 0.0, 1.0 - share, share
    if l1 >= l2:
        share = _share_along(s1, w2, l1)
        return share, 0.0, 1.0 - share
    share = _share_along(s2, w0, l2)
    return 1.0 - share, share, 0.0


@inlined
def _share_along(side, way, size):
    """How far along a side of some length its point lies that is nearest to the end of a way from its first corner."""
    along = dot(side, way) / size
    return smaller(along / size, 1.0) if along > 0.0 else 0.0
