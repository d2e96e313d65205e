"""The order in which points are asked: those that are near each other together, as they read the same nodes.

A grid of cells over the mesh, and a counting sort by cell. Answers do not depend on the order.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.kernels.jit import kernel

# Cells of the grid: some dozens of points in each, for as many points as are ordered together.
CELLS = 4096
# So that Ctrl-C and other threads need not wait for long.
_MOST = 1 << 17


def make_grid(lower: NDArray[np.float64], upper: NDArray[np.float64], along: int | None) -> NDArray[np.float64]:
    """A grid (3, 3) over a box: for each axis its start, its cells a unit, and the number of its cells.

    It has 16 cells along each axis, or 64 along two and one along the axis ``along``.
    """
    cells = np.full(3, 16.0)
    if along is not None:
        cells[:] = 64.0
        cells[along] = 1.0
    size = upper - lower
    with np.errstate(divide="ignore", over="ignore"):
        rate = np.where(size > 0.0, cells / size, 0.0)
    return np.stack([lower, np.where(np.isfinite(rate), rate, 0.0), cells])


def chunk_size(count: int, least: int, threads: int) -> int:
    """Points that a thread orders together: the more the better, but each thread gets some chunks."""
    return max(least, min(_MOST, count // (4 * threads)))


@kernel
def order_points(points, grid, order, starts, begin, end):
    """Write the rows begin:end of ``points`` (n, 3) in the order of their cells to ``order``, (end - begin,) int64.

    ``starts`` is memory for CELLS + 1 int64.
    """
    for k in range(CELLS + 1):
        starts[k] = 0
    for i in range(begin, end):
        starts[_cell(points, grid, i) + 1] += 1
    for k in range(CELLS):
        starts[k + 1] += starts[k]
    for i in range(begin, end):
        cell = _cell(points, grid, i)
        order[starts[cell]] = i
        starts[cell] += 1


@kernel
def _cell(points, grid, i):
    cell = np.int64(0)
    for axis in range(3):
        last = grid[2, axis] - 1.0
        place = (points[i, axis] - grid[0, axis]) * grid[1, axis]
        # Of NaN, as of 0 * inf, the first cell.
        place = place if place > 0.0 else 0.0
        cell = cell * np.int64(grid[2, axis]) + np.int64(place if place < last else last)
    return cell
