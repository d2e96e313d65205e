"""Points of queries: shape, type and finiteness are checked."""

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.limits import FARTHEST
from renderer.arguments.types import ArrayLike
from renderer.errors import expect


def check_points(
    argument: str, points: ArrayLike, farthest: float = np.inf
) -> tuple[NDArray[np.float64], tuple[int, ...]]:
    """Points (..., 3) as rows (n, 3) of float64, and their leading dimensions.

    Raises ``ValueError`` that names the argument and, for a coordinate that is not finite or beyond ``farthest``, its
    row.
    """
    given = real_argument(argument, points)
    expect(given.ndim >= 1 and given.shape[-1] == 3, argument, "shape (..., 3)", f"shape {given.shape}")
    with np.errstate(over="ignore", invalid="ignore"):  # infinities and NaN are refused with their row
        rows = np.require(given, np.float64, ("C_CONTIGUOUS", "WRITEABLE")).reshape(-1, 3)
        # Two passes and no array beside; of NaN both are NaN, which no comparison holds for.
        least, most = (rows.min(), rows.max()) if rows.size else (0.0, 0.0)
        near = -farthest <= least and most <= farthest and isfinite(least) and isfinite(most)
    if not near:
        row = int((~((np.abs(rows) <= farthest) & np.isfinite(rows)).all(axis=1)).argmax())
        expected = "finite numbers" if np.isinf(farthest) else f"finite numbers within {farthest:.3g}"
        expect(False, argument, expected, f"{rows[row].tolist()} in row {row}")
    return rows, given.shape[:-1]


def farthest_of(scale: float) -> float:
    """The largest coordinate of a point in a distance query; ``scale`` is the tree's."""
    with np.errstate(over="ignore"):
        return float(np.float64(FARTHEST) / scale)
