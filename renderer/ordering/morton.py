"""The order of points along a space-filling curve: points that follow each other are near each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel

# Bits of each coordinate in a key of 63.
_BITS = 21


def order_along_curve(points: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The rows of finite points (n, 3) in the order of Morton's curve over their bounds, and the steps between them.

    Both are (n,) int64. A step is the exclusive or of two keys, 0 for the first row. The larger it is, the larger the
    cell that the curve leaves there.

    Points of one cell, of 2^63 in the bounds, stay in the order of their rows.
    """
    if not len(points):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    lower, upper = points.min(axis=0), points.max(axis=0)
    with np.errstate(divide="ignore", over="ignore"):
        # One rate for all axes, so that a cell is a cube.
        rate = 2.0**_BITS / (upper - lower).max()
    grid = np.append(lower, rate if np.isfinite(rate) else 0.0)
    keys = np.empty(len(points), np.int64)
    _write_keys(points, grid, keys)
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    return order, keys ^ np.append(keys[:1], keys[:-1])


@kernel
def _write_keys(points, grid, keys):
    """Write the key of each point: the bits of its cell's coordinates interleaved, z highest."""
    last = 2.0**_BITS - 1.0
    for i in range(len(keys)):
        key = np.int64(0)
        for axis in range(3):
            place = (points[i, axis] - grid[axis]) * grid[3]
            place = place if place > 0.0 else 0.0
            key |= _spread(np.int64(place if place < last else last)) << axis
        keys[i] = key


@inlined
def _spread(bits):
    """The 21 bits of a number, with two zeros before each."""
    bits = (bits | bits << 32) & 0x001F00000000FFFF
    bits = (bits | bits << 16) & 0x001F0000FF0000FF
    bits = (bits | bits << 8) & 0x100F00F00F00F00F
    bits = (bits | bits << 4) & 0x10C30C30C30C30C3
    return (bits | bits << 2) & 0x1249249249249249
