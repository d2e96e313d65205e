"""Exchanges that are balanced: symmetric, and with the sums that the areas of the surfaces demand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.studies.factors.result import csr_array
from renderer.studies.factors.sparse import scipy_sparse

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Steps of Newton's method, which doubles the digits in each once it is near; the sums that are taken for exact, some
# roundings; and those that rounding alone may make worse again.
_STEPS, _EXACT, _ROUNDED = 40, 1e-14, 1e-9
# A step is found so well: more would not help the next one.
_STEP_ERROR, _STEP_ITERATIONS = 1e-4, 400
# The largest change of the logarithm of an entry in a step: beyond, Newton's method may overshoot.
_MOST = 1.0


class Exchanges(NamedTuple):
    """Symmetric exchanges of n surfaces: the entries on and above the diagonal, and those with what is no surface.

    upper            (n, n) csr_array of k entries >= 0
    freedom          (k,) float64, >= 0: by what share each may change beside others; 0 for one that is exact
    outside          (n,) float64, >= 0: the exchange of each row with the sky and with backs
    outside_freedom  (n,) float64
    """

    upper: csr_array
    freedom: Floats
    outside: Floats
    outside_freedom: Floats


def balanced(exchanges: Exchanges, areas: Floats) -> Exchanges:
    """Exchanges changed so that the sum of each row is its area.

    An entry is multiplied by exp(freedom * (m_i + m_j)), with a number m for each row, so it stays symmetric, and not
    negative. Where no numbers give these sums, they are as near as the steps come.
    """
    upper, freedom, outside, outside_freedom = exchanges
    rows, columns, levels = rows_of(upper), upper.indices, np.zeros(len(areas))
    on_diagonal = rows == columns

    def sums(entries: Floats, others: Floats) -> Floats:
        part = _with(upper, entries)
        ends = part.sum(axis=1) + part.sum(axis=0) - part.diagonal()
        return np.asarray(ends + others)

    found, least = (upper.data, outside), np.inf
    for _ in range(_STEPS):
        now = upper.data * np.exp(freedom * (levels[rows] + levels[columns]))
        open_now = outside * np.exp(outside_freedom * levels)
        slopes = now * freedom
        diagonal = sums(np.where(on_diagonal, 2.0, 1.0) * slopes, open_now * outside_freedom)
        missing = np.where(diagonal > 0.0, areas - sums(now, open_now), 0.0)
        worst = (np.abs(missing) / areas).max(initial=0.0)
        if worst < least:
            found, least = (now, open_now), worst
        if worst <= _EXACT or (least < worst and least <= _ROUNDED):
            break
        step = _step(_with(upper, np.where(on_diagonal, 0.0, slopes)), diagonal, missing)
        change = np.abs(freedom * (step[rows] + step[columns])).max(initial=_MOST)
        levels += step * (_MOST / max(change, np.abs(outside_freedom * step).max(initial=0.0)))
    return exchanges._replace(upper=_with(upper, found[0]), outside=found[1])


def rows_of(matrix: csr_array) -> Integers:
    """The row of each entry."""
    return np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))


def _with(matrix: csr_array, entries: Floats) -> csr_array:
    """A matrix with other entries at the same places."""
    return type(matrix)((entries, matrix.indices, matrix.indptr), shape=matrix.shape)


def _step(slopes: csr_array, diagonal: Floats, missing: Floats) -> Floats:
    """The step of Newton's method; a row of which nothing may change has none."""
    linalg, count, lower = scipy_sparse().linalg, len(missing), slopes.T
    inverse = np.divide(1.0, diagonal, out=np.zeros(count), where=diagonal > 0.0)
    operator = linalg.LinearOperator((count, count), lambda x: slopes @ x + lower @ x + diagonal * x)
    guess = linalg.LinearOperator((count, count), lambda x: inverse * x)
    found, _ = linalg.cg(operator, missing, rtol=_STEP_ERROR, maxiter=_STEP_ITERATIONS, M=guess)
    return np.asarray(found)
