"""Error against cost: the Pareto front and the log-log slope."""

import math
from collections.abc import Sequence

import numpy as np


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Rows of the Pareto front of (cost, error) points, where smaller is better for both, cheapest first.

    A point is on the front unless another is no worse in both and better in one; equal points stay together. Raises
    ``ValueError`` for NaN, which has no order.

    >>> front([(1.0, 9.0), (2.0, 3.0), (3.0, 3.0), (4.0, 1.0)])
    [0, 1, 3]
    """
    for row, point in enumerate(points):
        if math.isnan(point[0]) or math.isnan(point[1]):
            raise ValueError(f"points: expected numbers, got {point} in row {row}")
    chosen: list[int] = []
    for row in sorted(range(len(points)), key=lambda i: points[i]):
        # Sorted by cost, then error: only a strictly smaller error, or the last point again, is not dominated.
        if not chosen or points[row][1] < points[chosen[-1]][1] or points[row] == points[chosen[-1]]:
            chosen.append(row)
    return chosen


def slope(x: Sequence[float], y: Sequence[float]) -> float | None:
    """Exponent p of y = c x^p by least squares in log-log; None for fewer than two different x.

    Pairs with a number <= 0, which has no logarithm, are left out.

    >>> round(slope([1.0, 4.0, 16.0], [8.0, 4.0, 2.0]), 12)
    -0.5
    """
    pairs = [(a, b) for a, b in zip(x, y, strict=True) if a > 0.0 and b > 0.0]
    if len({a for a, _ in pairs}) < 2:
        return None
    u, v = np.log(np.array(pairs)).T
    centred = u - u.mean()
    return float(centred @ v / (centred @ centred))
