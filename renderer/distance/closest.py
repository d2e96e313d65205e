"""Closest points on a mesh: checks at the boundary, chunks on threads, and the result."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.points import check_points, farthest_of
from renderer.distance.nearest import LISTED, UNDECIDED_FACE, find_nearest
from renderer.distance.rational import nearest_exactly
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.ordering.cells import search_in_order
from renderer.results.closest_points import ClosestPoints
from renderer.trace.closest import rays_against_blocks
from renderer.trace.layout import Tree
from renderer.trace.rays import HIT_ROWS
from renderer.trace.walk import stack_size

# The fewest points of a chunk: some milliseconds of search.
_LEAST = 1024


def closest_point(tree: Tree, mesh: Mesh, points: ArrayLike, max_distance: ArrayLike, threads: int) -> ClosestPoints:
    """The nearest point of the mesh to each point, see ``Octree.closest_point``."""
    expect(len(mesh.faces) > 0, "mesh", "faces", "none")
    given, shape = check_points("points", points, farthest_of(tree.scale))
    limits = _limits(max_distance, shape)
    out = np.empty((HIT_ROWS, len(given)))

    def find(rows: NDArray[np.int64], some: NDArray[np.float64]) -> Iterator[None]:
        size = stack_size(tree.depth) + LISTED
        integers, doubles, done = np.empty(size, np.int64), np.empty(size + 9), 0
        while done < len(some):
            done = find_nearest(tree.descriptor, some, rows, limits, out, integers, doubles, done)
            yield

    least = _LEAST if tree.has_nodes else min(_LEAST, rays_against_blocks(tree))
    search_in_order(find, given, mesh, None, least, threads)
    faces = out[3].view(np.int64)
    undecided = np.flatnonzero(faces == UNDECIDED_FACE)
    triangles = mesh.triangles if len(undecided) else np.empty((0, 3, 3))
    for row in undecided:
        distance, u, v, face = nearest_exactly(given[row], triangles, tree.scale)
        hit = distance <= limits[row if len(limits) > 1 else 0]
        out[:3, row] = (distance, u, v) if hit else (np.inf, np.nan, np.nan)
        faces[row] = face if hit else -1
    distance, u, v = (row.reshape(shape) for row in out[:3])
    return ClosestPoints(distance, faces.reshape(shape), u, v, mesh)


def _limits(max_distance: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """One largest distance for all points, or one for each."""
    given = real_argument("max_distance", max_distance)
    expect(given.ndim == 0 or given.shape == shape, "max_distance", f"a number or shape {shape}", f"{given.shape}")
    limits = np.array(given, np.float64).reshape(-1)
    good = limits >= 0.0
    if not good.all():
        row = int((~good).argmax())
        expect(False, "max_distance", "numbers from 0", f"{limits[row]} in row {row}")
    return limits
