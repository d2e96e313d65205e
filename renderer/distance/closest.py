"""The query ``closest_point``: checks, chunks of points on threads, and the result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.points import check_points, farthest_of
from renderer.arguments.types import ArrayLike
from renderer.distance.nearest import LISTED, UNDECIDED_FACE, find_nearest
from renderer.distance.rational import nearest_exactly
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.ordering.cells import search_in_order
from renderer.results.closest_points import ClosestPoints
from renderer.trace.batch import joint_shape
from renderer.trace.closest import rays_against_blocks
from renderer.trace.layout import Tree
from renderer.trace.rays import HIT_ROWS
from renderer.trace.walk import stack_size

# The fewest points of a chunk: some milliseconds of search.
_LEAST = 1024


class Counted(NamedTuple):
    """The part of a scene that counts: the ``mask`` of ``find_nearest``, and the numbers and corners of the faces."""

    mask: int
    faces: Callable[[], tuple[NDArray[np.int64], NDArray[np.float64]]]


def closest_point(
    tree: Tree, mesh: Mesh, points: ArrayLike, max_distance: ArrayLike, threads: int, counted: Counted | None = None
) -> ClosestPoints:
    """The nearest point of the mesh to each point, see ``Octree.closest_point``; in a scene of what is ``counted``."""
    expect(len(mesh.faces) > 0, "mesh", "faces", "none")
    given, shape = check_points("points", points, farthest_of(tree.scale))
    limits = _limits(max_distance)
    if limits.shape not in ((), shape):
        given = given.reshape(*shape, 3)
        shape = joint_shape("max_distance", limits.shape, shape, "that of the points")
        # Copies, as Numba would compile the search again for arrays that are not writable.
        given = np.array(np.broadcast_to(given, (*shape, 3))).reshape(-1, 3)
        limits = np.array(np.broadcast_to(limits, shape))
    limits = limits.reshape(-1)
    out, mask = np.empty((HIT_ROWS, len(given))), -1 if counted is None else counted.mask

    def find(rows: NDArray[np.int64], some: NDArray[np.float64]) -> Iterator[None]:
        size = stack_size(tree.depth) + LISTED
        integers, doubles, done = np.empty(size, np.int64), np.empty(size + 9), 0
        while done < len(some):
            done = find_nearest(tree.descriptor, some, rows, limits, mask, out, integers, doubles, done)
            yield

    least = _LEAST if tree.has_nodes else min(_LEAST, rays_against_blocks(tree))
    search_in_order(find, given, mesh, None, least, threads)
    faces = out[3].view(np.int64)
    undecided = np.flatnonzero(faces == UNDECIDED_FACE)
    if len(undecided):
        numbers, triangles = (np.arange(len(mesh.faces)), mesh.triangles) if counted is None else counted.faces()
    for row in undecided:
        distance, u, v, face = nearest_exactly(given[row], triangles, tree.scale)
        hit = distance <= limits[row if len(limits) > 1 else 0]
        out[:3, row] = (distance, u, v) if hit else (np.inf, np.nan, np.nan)
        faces[row] = numbers[face] if hit else -1
    distance, u, v = (row.reshape(shape) for row in out[:3])
    return ClosestPoints(distance, faces.reshape(shape), u, v, mesh)


def _limits(max_distance: ArrayLike) -> NDArray[np.float64]:
    """Largest distances as an array of any shape, from 0."""
    limits = np.array(real_argument("max_distance", max_distance), np.float64)
    good = limits.reshape(-1) >= 0.0
    if not good.all():
        row = int((~good).argmax())
        expect(False, "max_distance", "numbers from 0", f"{limits.reshape(-1)[row]} in row {row}")
    return limits
