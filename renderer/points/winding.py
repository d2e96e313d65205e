"""Winding numbers of any mesh around points: checks at the boundary, chunks on threads."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arrays import real_argument
from renderer.errors import expect
from renderer.points.argument import check_points
from renderer.points.moments import moments_of
from renderer.points.winding_search import exceed_half, sum_windings
from renderer.process.parallel import for_chunks
from renderer.trace.layout import Tree
from renderer.trace.singly import stack_size

# Some milliseconds of search.
_CHUNK = 256


def winding_number(tree: Tree, points: ArrayLike, tolerance: ArrayLike, threads: int) -> NDArray[np.float64]:
    """Winding numbers within a tolerance, see ``Octree.winding_number``."""
    rows, shape = check_points("points", points)
    given = real_argument("tolerance", tolerance)
    expect(given.ndim == 0, "tolerance", "one number", f"shape {given.shape}")
    limit = float(given)
    expect(0.0 <= limit < np.inf, "tolerance", "a finite number from 0", limit)
    moments, numbers = moments_of(tree, threads), np.empty(len(rows))

    def find(begin: int, end: int) -> Iterator[None]:
        stack = np.empty(stack_size(tree.depth), np.int64)
        while begin < end:
            begin = sum_windings(tree.words, moments, rows, limit, numbers, stack, begin, end)
            yield

    for_chunks(find, len(rows), _CHUNK, threads)
    return numbers.reshape(shape)


def exceeds_half(tree: Tree, rows: NDArray[np.float64], threads: int) -> NDArray[np.bool_]:
    """Whether the winding numbers around points (n, 3) are above 1/2, (n,)."""
    moments, above = moments_of(tree, threads), np.empty(len(rows), np.bool_)

    def find(begin: int, end: int) -> Iterator[None]:
        stack = np.empty(stack_size(tree.depth), np.int64)
        while begin < end:
            begin = exceed_half(tree.words, moments, rows, above, stack, begin, end)
            yield

    for_chunks(find, len(rows), _CHUNK, threads)
    return above
