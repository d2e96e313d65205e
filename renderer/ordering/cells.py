"""The order of points in a search: near points together, because they read the same nodes.

A grid of cells over the mesh, and a counting sort by cell. Results do not depend on the order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel
from renderer.mesh.mesh import Mesh
from renderer.system.threads import for_chunks

Search = Callable[[NDArray[np.int64], NDArray[np.float64]], Iterator[None]]

# Cells of the grid: some dozens of points in each, for as many points as are ordered together.
_CELLS = 4096
# So that Ctrl-C and other threads need not wait for long.
_MOST = 1 << 17
# Points that are searched at once, on the caller's thread: ordering them takes longer than it saves.
_FEW = 32


def search_in_order(
    search: Search, points: NDArray[np.float64], mesh: Mesh, along: int | None, least: int, threads: int
) -> None:
    """Call ``search(rows, some)`` on threads until all points (n, 3) are done: ``some`` are the points in these rows.

    Ctrl-C is handled each time it yields. Points come in the order of a grid's cells, of a grid across the axis
    ``along`` if that is given, at least ``least`` at a time. A few points keep their order.
    """
    if len(points) <= _FEW:
        for _ in search(np.arange(len(points)), points):
            pass
        return
    lower, upper = mesh.bounds
    grid = _make_grid(lower, upper, along)

    def search_some(begin: int, end: int) -> Iterator[None]:
        rows, some, starts = np.empty(end - begin, np.int64), np.empty((end - begin, 3)), np.empty(_CELLS + 1, np.int64)
        _order_points(points, grid, rows, some, starts, begin, end)
        yield from search(rows, some)

    # The more are ordered together the better, but each thread gets some chunks.
    for_chunks(search_some, len(points), max(least, min(_MOST, len(points) // (4 * threads))), threads)


def _make_grid(lower: NDArray[np.float64], upper: NDArray[np.float64], along: int | None) -> NDArray[np.float64]:
    """A grid (3, 3) over a box: for each axis its start, its cells for each unit of length, and their number.

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


@kernel
def _order_points(points, grid, rows, some, starts, begin, end):
    """Write the rows begin:end of ``points`` (n, 3), in the order of their cells, to ``rows``; the points to ``some``.

    Points are copied, so that no search waits for memory. ``starts`` is memory for _CELLS + 1 int64.
    """
    for k in range(_CELLS + 1):
        starts[k] = 0
    for i in range(begin, end):
        starts[_cell(points, grid, i) + 1] += 1
    for k in range(_CELLS):
        starts[k + 1] += starts[k]
    for i in range(begin, end):
        cell = _cell(points, grid, i)
        place = starts[cell]
        starts[cell] += 1
        rows[place] = i
        for axis in range(3):
            some[place, axis] = points[i, axis]


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
