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
# A point on a face is 2^-53 of its coordinates off the face's plane, and another such error comes with the direction.
# A ray at a slope of 2^-12, 0.014 degrees, meets the plane 2^12 as far away.
_BESIDE = 2.0**-40
_ZERO, _INFINITY = np.zeros(1), np.full(1, np.inf)


class _End(NamedTuple):
    """One end of n segments: its points (n, 3), and the faces (n,) they lie on or None."""

    points: Floats
    faces: NDArray[np.int64] | None

    def room(self) -> Floats:
        """How near a hit may be to the end without hiding it, (n,)."""
        return np.zeros(len(self.points)) if self.faces is not None else _BESIDE * np.abs(self.points).max(axis=1)


def visible(
    tree: Tree,
    mesh: Mesh,
    ends: tuple[ArrayLike, ArrayLike],
    faces: tuple[ArrayLike | None, ArrayLike | None],
    threads: int,
) -> NDArray[np.bool_]:
    """Whether segments meet nothing between their ends, which lie on ``faces``; see ``Octree.visible``."""
    farthest = farthest_of(tree.scale)
    (a, shape_a), (b, shape_b) = check_points("points", ends[0], farthest), check_points("targets", ends[1], farthest)
    a, b = a.reshape(*shape_a, 3), b.reshape(*shape_b, 3)
    shape = broadcast_shape("targets", b, "points", a)
    a, b = np.broadcast_to(a, (*shape, 3)).reshape(-1, 3), np.broadcast_to(b, (*shape, 3)).reshape(-1, 3)
    apart, most = (a != b).any(axis=1), len(mesh.faces)
    start = _End(a[apart], _faces("leaving", faces[0], shape, most, apart))
    stop = _End(b[apart], _faces("reaching", faces[1], shape, most, apart))
    seen = np.ones(len(a), np.bool_)
    seen[apart] = ~any_hits(tree, _between(tree, mesh, start, stop, threads), threads)
    return seen.reshape(shape)


def _faces(
    argument: str, faces: ArrayLike | None, shape: tuple[int, ...], most: int, chosen: NDArray[np.bool_]
) -> NDArray[np.int64] | None:
    """The faces of the chosen segments."""
    return None if faces is None else check_faces(argument, faces, shape, most)[chosen]


def _between(tree: Tree, mesh: Mesh, start: _End, stop: _End, threads: int) -> RayBatch:
    """Rays from the one end to the other, both left out."""
    moved_start, moved_stop = (
        end.points if end.faces is None else _moved(tree, mesh, end, other, threads)
        for end, other in ((start, stop), (stop, start))
    )
    directions, reach = _way(moved_start, moved_stop)
    size = np.abs(directions).max(axis=1)
    t_max = np.maximum(reach - stop.room() / size, 0.0)
    # Where the ends leave no room between them, t_min is above t_max, and nothing hides.
    return RayBatch(moved_start, directions, start.room() / size, np.where(t_max > 0.0, t_max, 0.0))


def _moved(tree: Tree, mesh: Mesh, end: _End, other: _End, threads: int) -> Floats:
    """The points of one end, moved off their faces towards the other."""
    assert end.faces is not None
    rays = RayBatch(end.points, _way(end.points, other.points)[0], _ZERO, _INFINITY)
    return moved_off(rays, end.faces, mesh, tree.scale, threads).origins


def _way(start: Floats, stop: Floats) -> tuple[Floats, Floats]:
    """Directions whose largest components are from 1/2 to 1, and the t at which they reach ``stop``."""
    # Of halves, whose difference does not overflow.
    half = stop * 0.5 - start * 0.5
    exponent = np.frexp(np.abs(half).max(axis=1))[1]
    with np.errstate(over="ignore"):
        return np.ldexp(half, -exponent[:, None]), np.ldexp(1.0, exponent + 1)
