"""Visibility between points: whether segments, without their ends, hit anything."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.points import check_points, farthest_of
from renderer.arguments.types import ArrayLike
from renderer.distance.on_surface import SurfacePoints, are_on, check_on, on_surface, places_of
from renderer.mesh.mesh import Mesh
from renderer.trace.batch import Leaving, RayBatch, broadcast_shape, check_faces, joint_shape, offset_origins
from renderer.trace.closest import any_hits, closest_hits
from renderer.trace.layout import Tree

Floats = NDArray[np.float64]
# Hits within this share of the largest coordinate of both ends are ignored, unless the end's face is given: ends may
# have gone through more roundings than ``on_surface`` takes.
_BESIDE = 2.0**-40
# The least room: an end at 0 is left out, too.
_LEAST = float(np.finfo(np.float64).smallest_subnormal)


class _Ends(NamedTuple):
    """One end of n segments: its points (n, 3), and their places on the surface."""

    points: Floats
    places: SurfacePoints


def visible(
    tree: Tree,
    mesh: Mesh,
    ends: tuple[ArrayLike, ArrayLike],
    faces: tuple[ArrayLike | None, ArrayLike | None],
    threads: int,
) -> NDArray[np.bool_]:
    """Whether segments hit nothing between their ends, which lie on ``faces``; see ``Octree.visible``."""
    farthest, most = farthest_of(tree.scale), len(mesh.faces)
    (a, shape_a), (b, shape_b) = check_points("points", ends[0], farthest), check_points("targets", ends[1], farthest)
    a, b = a.reshape(*shape_a, 3), b.reshape(*shape_b, 3)
    shape = broadcast_shape("targets", b, "points", a)
    for argument, given in zip(("leaving", "reaching"), faces, strict=True):
        if given is not None:
            shape = joint_shape(argument, real_argument(argument, given).shape, shape, "that of points and targets")
    a, b = np.broadcast_to(a, (*shape, 3)).reshape(-1, 3), np.broadcast_to(b, (*shape, 3)).reshape(-1, 3)
    on_a = check_faces("leaving", -1 if faces[0] is None else faces[0], shape, most)
    on_b = check_faces("reaching", -1 if faces[1] is None else faces[1], shape, most)
    check_on(mesh, "points", a, on_a)
    check_on(mesh, "targets", b, on_b)
    apart = np.flatnonzero((a != b).any(axis=1))
    start, stop = (_end(tree, mesh, points[apart], on[apart], threads) for points, on in ((a, on_a), (b, on_b)))
    # Ends that are as near to each other as rounding may lie at one place of the surface.
    some = np.flatnonzero((start.points != stop.points).any(axis=1))
    seen = np.ones(len(a), np.bool_)
    seen[apart[some]] = _are_open(tree, mesh, _picked(start, some), _picked(stop, some), threads)
    return seen.reshape(shape)


def _end(tree: Tree, mesh: Mesh, points: Floats, faces: NDArray[np.int64], threads: int) -> _Ends:
    """One end of segments, moved exactly onto the surface if it lies on it."""
    places = on_surface(tree, mesh, points, faces, threads)
    return _Ends(places_of(mesh, points, places), places)


def _are_open(tree: Tree, mesh: Mesh, start: _Ends, stop: _Ends, threads: int) -> NDArray[np.bool_]:
    """Whether nothing lies between the ends of segments."""
    seen = ~any_hits(tree, threads, *_between(tree, mesh, start, stop, threads))
    # If the first face hit is one that contains the end, nothing lies before the end.
    doubtful = np.flatnonzero(~seen & (stop.places.faces >= 0))
    if len(doubtful):
        start, stop = _picked(start, doubtful), _picked(stop, doubtful)
        first = closest_hits(tree, mesh, threads, *_between(tree, mesh, start, stop, threads)).face
        met = np.flatnonzero(first >= 0)
        seen[doubtful[met]] = are_on(mesh, stop.points[met], first[met])
    return seen


def _picked(end: _Ends, rows: NDArray[np.int64]) -> _Ends:
    return _Ends(
        end.points[rows], SurfacePoints(end.places.faces[rows], end.places.codes[rows], end.places.anchors[rows])
    )


def _between(tree: Tree, mesh: Mesh, start: _Ends, stop: _Ends, threads: int) -> RayBatch:
    """Rays from one end to the other, both excluded."""
    # rule: room-at-ends
    room = _BESIDE * np.maximum(np.abs(start.points), np.abs(stop.points)).max(axis=1, initial=0.0)
    directions, reach = _way(start.points, stop.points)
    room = np.maximum(room / np.abs(directions).max(axis=1, initial=0.0), _LEAST)
    # Where the ends leave no room between them, t_min is above t_max, and nothing hides.
    t_min = np.where(start.places.faces < 0, room, 0.0)
    # rule: room-before-end
    rays = RayBatch(
        start.points, directions, t_min, np.where(stop.places.faces < 0, np.maximum(reach - room, 0.0), reach)
    )
    leaving = Leaving(*start.places)
    return offset_origins(rays, leaving, mesh, tree.scale, threads) if (leaving.faces >= 0).any() else rays


def _way(start: Floats, stop: Floats) -> tuple[Floats, Floats]:
    """Directions whose largest components are from 1/2 to 1, and the t at which they reach ``stop``."""
    # Of halves where they are large, so that the difference does not overflow; half of the least denormal is 0.
    large = np.maximum(np.abs(start), np.abs(stop)).max(axis=1, initial=0.0) > 1.0
    share = np.where(large, 0.5, 1.0)[:, None]
    way = stop * share - start * share
    exponent = np.frexp(np.abs(way).max(axis=1, initial=0.0))[1]
    with np.errstate(over="ignore"):
        return np.ldexp(way, -exponent[:, None]), np.ldexp(1.0, exponent + large)
