"""Exchanges that are balanced: symmetric, and with the sums that the areas of the surfaces demand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.studies.factors.sparse import scipy_sparse

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Steps of Newton's method, which doubles the digits in each; and the sums that are taken for exact: some roundings of a
# row of many entries.
_STEPS, _EXACT = 24, 1e-14
# A step is found so well: more would not help the next one.
_STEP_ERROR, _STEP_ITERATIONS = 1e-4, 400
# The largest change of the logarithm of an entry in a step: beyond, Newton's method may overshoot.
_MOST = 1.0


class Exchanges(NamedTuple):
    """Symmetric exchanges of n surfaces: the entries on and above the diagonal, and those with what is no surface.

    rows, columns    (k,) int64: rows <= columns
    values           (k,) float64, >= 0
    freedom          (k,) float64, >= 0: by what share each may change beside others; 0 for one that is exact
    outside          (n,) float64, >= 0: the exchange of each row with the sky and with backs
    outside_freedom  (n,) float64
    """

    rows: Integers
    columns: Integers
    values: Floats
    freedom: Floats
    outside: Floats
    outside_freedom: Floats


def balanced(exchanges: Exchanges, areas: Floats) -> Exchanges:
    """Exchanges changed so that the sum of each row is its area.

    An entry is multiplied by exp(freedom * (m_i + m_j)), with a number m for each row, so it stays symmetric, and not
    negative. Where no numbers give these sums, they are as near as the steps come.
    """
    rows, columns, _, freedom, _, outside_freedom = exchanges
    count, levels, on_diagonal = len(areas), np.zeros(len(areas)), rows == columns

    def sums(entries: Floats, others: Floats) -> Floats:
        ends = np.bincount(rows, entries, count) + np.bincount(columns, np.where(on_diagonal, 0.0, entries), count)
        return ends + others

    found, least = (exchanges.values, exchanges.outside), np.inf
    for _ in range(_STEPS):
        now, open_now = _at(exchanges, levels)
        slopes = now * freedom
        diagonal = sums(np.where(on_diagonal, 2.0, 1.0) * slopes, open_now * outside_freedom)
        missing = np.where(diagonal > 0.0, areas - sums(now, open_now), 0.0)
        worst = (np.abs(missing) / areas).max(initial=0.0)
        if worst >= least:
            break
        found, least = (now, open_now), worst
        if worst <= _EXACT:
            break
        step = _step(rows, columns, np.where(on_diagonal, 0.0, slopes), diagonal, missing)
        change = max(np.abs(freedom * (step[rows] + step[columns])).max(initial=0.0), _MOST)
        levels += step * (_MOST / change)
    return exchanges._replace(values=found[0], outside=found[1])


def _at(exchanges: Exchanges, levels: Floats) -> tuple[Floats, Floats]:
    """Values and outside at some numbers of the rows."""
    changes = exchanges.freedom * (levels[exchanges.rows] + levels[exchanges.columns])
    return exchanges.values * np.exp(changes), exchanges.outside * np.exp(exchanges.outside_freedom * levels)


def _step(rows: Integers, columns: Integers, slopes: Floats, diagonal: Floats, missing: Floats) -> Floats:
    """The step of Newton's method; a row of which nothing may change has none."""
    sparse, count = scipy_sparse(), len(missing)
    upper = sparse.csr_array((slopes, (rows, columns)), shape=(count, count))
    inverse = np.divide(1.0, diagonal, out=np.zeros(count), where=diagonal > 0.0)

    def times(x: Floats) -> Floats:
        return np.asarray(upper @ x + upper.T @ x + diagonal * x)

    operator = sparse.linalg.LinearOperator((count, count), times)
    guess = sparse.linalg.LinearOperator((count, count), lambda x: inverse * x)
    found, _ = sparse.linalg.cg(operator, missing, rtol=_STEP_ERROR, maxiter=_STEP_ITERATIONS, M=guess)
    return np.asarray(found)
