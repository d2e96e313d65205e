"""Winding numbers of any mesh around points: checks at the boundary, chunks on threads."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arrays import real_argument
from renderer.errors import expect
from renderer.inside.moments import moments_of
from renderer.inside.winding_search import exceed_half, sum_windings
from renderer.mesh.mesh import Mesh
from renderer.points.argument import check_points
from renderer.points.order import CELLS, chunk_size, make_grid, order_points
from renderer.process.parallel import for_chunks
from renderer.trace.layout import Tree
from renderer.trace.query import rays_against_blocks
from renderer.trace.singly import stack_size

# Points between two looks at Ctrl-C: some milliseconds of search.
_STEP = 512


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

    def search(order: NDArray[np.int64], stack: NDArray[np.int64]) -> int:
        return sum_windings(tree.words, moments, rows, order, limit, numbers, stack)

    _search_in_order(search, tree, mesh, rows, threads)
    return numbers.reshape(shape)


def exceeds_half(tree: Tree, mesh: Mesh, rows: NDArray[np.float64], threads: int) -> NDArray[np.bool_]:
    """Whether the winding numbers around points (n, 3) are above 1/2, (n,)."""
    moments, above = moments_of(tree, threads), np.empty(len(rows), np.bool_)

    def search(order: NDArray[np.int64], stack: NDArray[np.int64]) -> int:
        return exceed_half(tree.words, moments, rows, order, above, stack)

    _search_in_order(search, tree, mesh, rows, threads)
    return above


def _search_in_order(
    search: Callable[[NDArray[np.int64], NDArray[np.int64]], int],
    tree: Tree,
    mesh: Mesh,
    rows: NDArray[np.float64],
    threads: int,
) -> None:
    """Call ``search(order, stack)`` for all points; it returns how many of ``order`` it has done."""
    lower, upper = mesh.bounds
    grid = make_grid(lower, upper, along=None)

    def find(begin: int, end: int) -> Iterator[None]:
        stack = np.empty(stack_size(tree.depth), np.int64)
        order, starts, done = np.empty(end - begin, np.int64), np.empty(CELLS + 1, np.int64), 0
        order_points(rows, grid, order, starts, begin, end)
        while done < len(order):
            done += search(order[done : done + step], stack)
            yield

    step = _STEP if tree.has_nodes else min(_STEP, rays_against_blocks(tree))
    for_chunks(find, len(rows), chunk_size(len(rows), step, threads), threads)
