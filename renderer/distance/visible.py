"""Whether points see each other: segments without their ends, asked by the query for any hit."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.mesh.mesh import Mesh
from renderer.points.argument import check_points, farthest_of
from renderer.trace.batch import RayBatch, broadcast_shape, check_faces, moved_off
from renderer.trace.layout import Tree
from renderer.trace.query import any_hits

Floats = NDArray[np.float64]
Faces = NDArray[np.int64]
# A point on a face is 2^-53 of its coordinates off the face's plane, and a ray is as much beside the point, by the
# rounding of its direction and of t. At a slope of 2^-11, 0.03 degrees, it meets the plane 2^11 as far away.
_BESIDE = 2.0**-40
# The least room: an end at 0 is left out, too.
_LEAST = float(np.finfo(np.float64).smallest_subnormal)
_ZERO, _INFINITY = np.zeros(1), np.full(1, np.inf)


class _Ends(NamedTuple):
    """One end of n segments: its points (n, 3), and the faces (n,) that they lie on, -1 for none."""

    points: Floats
    faces: Faces


def visible(
    tree: Tree,
    mesh: Mesh,
    ends: tuple[ArrayLike, ArrayLike],
    faces: tuple[ArrayLike | None, ArrayLike | None],
    threads: int,
) -> NDArray[np.bool_]:
    """Whether segments meet nothing between their ends, which lie on ``faces``; see ``Octree.visible``."""
    farthest, most = farthest_of(tree.scale), len(mesh.faces)
    (a, shape_a), (b, shape_b) = check_points("points", ends[0], farthest), check_points("targets", ends[1], farthest)
    a, b = a.reshape(*shape_a, 3), b.reshape(*shape_b, 3)
    shape = broadcast_shape("targets", b, "points", a)
    a, b = np.broadcast_to(a, (*shape, 3)).reshape(-1, 3), np.broadcast_to(b, (*shape, 3)).reshape(-1, 3)
    on_a = check_faces("leaving", -1 if faces[0] is None else faces[0], shape, most)
    on_b = check_faces("reaching", -1 if faces[1] is None else faces[1], shape, most)
    apart = (a != b).any(axis=1)
    start, stop = _turned(_Ends(a[apart], on_a[apart]), _Ends(b[apart], on_b[apart]))
    seen = np.ones(len(a), np.bool_)
    seen[apart] = ~any_hits(tree, _between(tree, mesh, start, stop, threads), threads)
    return seen.reshape(shape)


def _turned(start: _Ends, stop: _Ends) -> tuple[_Ends, _Ends]:
    """The ends, where only ``stop`` lies on a face the other way round: a ray is exact where it starts."""
    turn = (start.faces < 0) & (stop.faces >= 0)
    first = _Ends(np.where(turn[:, None], stop.points, start.points), np.where(turn, stop.faces, start.faces))
    last = _Ends(np.where(turn[:, None], start.points, stop.points), np.where(turn, start.faces, stop.faces))
    return first, last


def _between(tree: Tree, mesh: Mesh, start: _Ends, stop: _Ends, threads: int) -> RayBatch:
    """Rays from the one end to the other, both left out."""
    room = _BESIDE * np.maximum(np.abs(start.points), np.abs(stop.points)).max(axis=1, initial=0.0)
    first, last = (_moved(tree, mesh, *both, threads) for both in ((start, stop), (stop, start)))
    directions, reach = _way(first, last)
    room = np.maximum(room / np.abs(directions).max(axis=1, initial=0.0), _LEAST)
    # Where the ends leave no room between them, t_min is above t_max, and nothing hides.
    return RayBatch(first, directions, np.where(start.faces < 0, room, 0.0), np.maximum(reach - room, 0.0))


def _moved(tree: Tree, mesh: Mesh, ends: _Ends, others: _Ends, threads: int) -> Floats:
    """The points of one end, moved off their faces towards the other."""
    if (ends.faces < 0).all():
        return ends.points
    rays = RayBatch(ends.points, _way(ends.points, others.points)[0], _ZERO, _INFINITY)
    return moved_off(rays, ends.faces, mesh, tree.scale, threads).origins


def _way(start: Floats, stop: Floats) -> tuple[Floats, Floats]:
    """Directions whose largest components are from 1/2 to 1, and the t at which they reach ``stop``."""
    # Of halves where they are large, so that the difference does not overflow; half of the least denormal is 0.
    large = np.maximum(np.abs(start), np.abs(stop)).max(axis=1, initial=0.0) > 1.0
    share = np.where(large, 0.5, 1.0)[:, None]
    way = stop * share - start * share
    exponent = np.frexp(np.abs(way).max(axis=1, initial=0.0))[1]
    with np.errstate(over="ignore"):
        return np.ldexp(way, -exponent[:, None]), np.ldexp(1.0, exponent + large)
