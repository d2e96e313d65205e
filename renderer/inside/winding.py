"""Winding numbers of any mesh around points: checks at the boundary, chunks on threads."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.points import check_points
from renderer.errors import expect
from renderer.inside.moments import moments_of
from renderer.inside.rational_angle import number_of
from renderer.inside.winding_search import exceed_half, sum_windings
from renderer.mesh.mesh import Mesh
from renderer.ordering.cells import ask_in_order
from renderer.trace.closest import rays_against_blocks
from renderer.trace.layout import Tree
from renderer.trace.walk import stack_size

Floats = NDArray[np.float64]
# The fewest points of a chunk: some milliseconds of search.
_LEAST = 512


def winding_number(
    tree: Tree, mesh: Mesh, points: ArrayLike, tolerance: ArrayLike, threads: int
) -> NDArray[np.float64]:
    """Winding numbers within a tolerance, see ``Octree.winding_number``."""
    rows, shape = check_points("points", points)
    given = real_argument("tolerance", tolerance)
    expect(given.ndim == 0, "tolerance", "one number", f"shape {given.shape}")
    limit = float(given)
    expect(0.0 <= limit < np.inf, "tolerance", "a finite number from 0", limit)
    moments, numbers = moments_of(tree, threads), np.empty(len(rows))

    def search(some: Floats, out: Floats, stack: NDArray[np.int64], begin: int, end: int) -> int:
        return int(sum_windings(tree.descriptor, moments, some, limit, out, stack, begin, end))

    _search_in_order(search, tree, mesh, rows, numbers, threads)
    return numbers.reshape(shape)


def exceeds_half(tree: Tree, mesh: Mesh, rows: NDArray[np.float64], threads: int) -> NDArray[np.bool_]:
    """Whether the winding numbers around points (n, 3) are above 1/2, (n,)."""
    moments, numbers = moments_of(tree, threads), np.empty(len(rows))

    def search(some: Floats, out: Floats, stack: NDArray[np.int64], begin: int, end: int) -> int:
        return int(exceed_half(tree.descriptor, moments, some, out, stack, begin, end))

    _search_in_order(search, tree, mesh, rows, numbers, threads)
    return numbers > 0.5


def _search_in_order(
    search: Callable[[Floats, Floats, NDArray[np.int64], int, int], int],
    tree: Tree,
    mesh: Mesh,
    points: Floats,
    numbers: Floats,
    threads: int,
) -> None:
    """Fill ``numbers`` by ``search(some, out, stack, begin, end)``, which returns the row before which it ended.

    Where it leaves NaN, rational arithmetic tells the faces that float64 cannot.
    """
    least = _LEAST if tree.has_nodes else min(_LEAST, rays_against_blocks(tree))

    def find(rows: NDArray[np.int64], some: Floats) -> Iterator[None]:
        stack, found, done = np.empty(stack_size(tree.depth), np.int64), np.empty(len(some)), 0
        while done < len(some):
            done = search(some, found, stack, done, len(some))
            yield
        numbers[rows] = found

    ask_in_order(find, points, mesh, None, least, threads)
    untold = np.flatnonzero(np.isnan(numbers))
    triangles = mesh.triangles if len(untold) else np.empty((0, 3, 3))
    for row in untold:
        numbers[row] = number_of(points[row], triangles)
