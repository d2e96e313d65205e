"""The query ``winding_number``: checks, and chunks of points on threads."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.points import check_points
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.inside.moments import moments_of
from renderer.inside.rational import winding_of
from renderer.inside.winding_search import SIDE_OF_HALF, find_windings
from renderer.mesh.mesh import Mesh
from renderer.ordering.cells import search_in_order
from renderer.trace.closest import rays_against_blocks
from renderer.trace.layout import Tree
from renderer.trace.walk import stack_size

Floats = NDArray[np.float64]
# The fewest points of a chunk: some milliseconds of search.
_LEAST = 512


def winding_number(tree: Tree, mesh: Mesh, points: ArrayLike, tolerance: ArrayLike, threads: int) -> Floats:
    """Winding numbers within a tolerance, see ``Octree.winding_number``."""
    rows, shape = check_points("points", points)
    given = real_argument("tolerance", tolerance)
    expect(given.ndim == 0, "tolerance", "one number", f"shape {given.shape}")
    limit = float(given)
    expect(0.0 <= limit < np.inf, "tolerance", "a finite number from 0", limit)
    return _numbers(tree, mesh, rows, limit, threads).reshape(shape)


def exceeds_half(tree: Tree, mesh: Mesh, rows: Floats, threads: int) -> NDArray[np.bool_]:
    """Whether the winding numbers around points (n, 3) are above 1/2, (n,)."""
    return _numbers(tree, mesh, rows, SIDE_OF_HALF, threads) > 0.5


def _numbers(tree: Tree, mesh: Mesh, points: Floats, tolerance: float, threads: int) -> Floats:
    """Winding numbers (n,) within a tolerance, see ``find_windings``; by rational arithmetic where that returns NaN."""
    moments, numbers = moments_of(tree, threads), np.empty(len(points))
    least = _LEAST if tree.has_nodes else min(_LEAST, rays_against_blocks(tree))

    def find(rows: NDArray[np.int64], some: Floats) -> Iterator[None]:
        stack, found, done = np.empty(stack_size(tree.depth), np.int64), np.empty(len(some)), 0
        while done < len(some):
            done = find_windings(tree.descriptor, moments, some, tolerance, found, stack, done, len(some))
            yield
        numbers[rows] = found

    search_in_order(find, points, mesh, None, least, threads)
    undecided = np.flatnonzero(np.isnan(numbers))
    triangles = mesh.triangles if len(undecided) else np.empty((0, 3, 3))
    for row in undecided:
        numbers[row] = winding_of(points[row], triangles)
    return numbers
