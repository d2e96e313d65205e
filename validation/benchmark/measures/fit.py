"""Fit of the expected cost law of an octree: a log2 N + b."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Fit(NamedTuple):
    """``a`` and ``b`` of cost = a log2 N + b, and the root mean square of the residuals, all in the cost's unit."""

    a: float
    b: float
    residual: float

    def at(self, faces: float) -> float:
        """The fitted cost for a number of faces."""
        return float(self.a * np.log2(faces) + self.b)


def log_fit(faces: Sequence[int], cost: Sequence[float]) -> Fit | None:
    """Least-squares fit; None for fewer than three sizes, through which some line passes exactly.

    >>> fit = log_fit([1024, 2048, 4096], [30.0, 33.0, 36.0])
    >>> round(fit.a, 9), round(fit.b, 9)
    (3.0, 0.0)
    """
    if len(set(faces)) < 3:
        return None
    matrix = np.stack([np.log2(faces), np.ones(len(faces))], axis=1)
    solution, *_ = np.linalg.lstsq(matrix, np.asarray(cost, np.float64), rcond=None)
    left = matrix @ solution - cost
    return Fit(float(solution[0]), float(solution[1]), float(np.sqrt(np.mean(left**2))))
