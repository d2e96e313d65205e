"""The exchanges of surfaces from exact pairs and counted rays, balanced."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.numerics.compressed import firsts_of
from renderer.studies.factors.balance import Exchanges, balanced, rows_of
from renderer.studies.factors.known import KnownPairs
from renderer.studies.factors.result import ViewFactors, csr_array
from renderer.studies.factors.rows import RowHits
from renderer.studies.factors.sparse import scipy_sparse
from renderer.studies.factors.tally import BACK, SKY

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class _Counted(NamedTuple):
    """The entries that rays counted, on and above the diagonal: values, freedom and variance of each."""

    values: csr_array
    freedom: Floats
    variance: Floats


def assembled(areas: Floats, pairs: KnownPairs, hits: RowHits) -> ViewFactors:
    """The view factors of surfaces: exact and counted entries, balanced."""
    number, counted = len(areas), _counted(hits, areas)
    sky, backs = areas * hits.share(number + SKY), areas * hits.share(number + BACK)
    outside_freedom = np.divide(areas, hits.rays, out=np.zeros(number), where=hits.rays > 0)
    upper, freedom, variance = _together(pairs, counted)
    found = balanced(Exchanges(upper, freedom, sky + backs, outside_freedom), areas)
    # What no ray fills, less than a ray's share of a row: all entries change, exact ones too, by as much.
    found = balanced(found._replace(freedom=np.ones(len(freedom)), outside_freedom=np.ones(number)), areas)
    share = np.divide(found.outside, sky + backs, out=np.zeros(number), where=sky + backs > 0.0)
    errors = type(upper)((np.sqrt(variance), upper.indices, upper.indptr), shape=upper.shape)
    exchange, errors = _symmetric(found.upper), _symmetric(errors)
    errors.data /= areas[rows_of(errors)]
    return ViewFactors(areas, exchange, sky * share / areas, backs * share / areas, errors, hits.rays)


def _counted(hits: RowHits, areas: Floats) -> _Counted:
    """The exchanges of pairs by the rays of both: their hits over the rays by area of both."""
    number, density = len(areas), hits.rays / areas
    inner = hits.targets < number
    rows, targets = hits.rows[inner], hits.targets[inner]

    def both_of(entries: Floats) -> csr_array:
        one = scipy_sparse().csr_array((entries, (rows, targets)), shape=(number, number))
        return scipy_sparse().triu(one + one.T, format="csr")

    # rule: reciprocal-exchange
    values = both_of(hits.counts[inner].astype(np.float64))
    both = density[rows_of(values)] + density[values.indices]
    # The error of a row's own estimate, weighed as its rays are. On the diagonal, both rows are one.
    variance = both_of((hits.errors[inner] * hits.rays[rows]) ** 2).data / both**2
    once = np.where(rows_of(values) == values.indices, 2.0, 1.0)
    values.data /= both
    return _Counted(values, once / both, once * variance)


def _together(pairs: KnownPairs, counted: _Counted) -> tuple[csr_array, Floats, Floats]:
    """Exact and counted entries as one matrix, with freedom and variance: no entry is both."""
    values, exact = counted.values, np.zeros(len(pairs.rows))
    rows = np.concatenate([pairs.rows, rows_of(values)])
    columns = np.concatenate([pairs.columns, values.indices])
    order = np.lexsort((columns, rows)) if len(pairs.rows) else slice(None)
    entries = np.concatenate([pairs.values, values.data])[order]
    first = firsts_of(np.bincount(rows, minlength=values.shape[0]))
    upper = type(values)((entries, columns[order], first), shape=values.shape)
    freedom, variance = np.concatenate([exact, counted.freedom]), np.concatenate([exact, counted.variance])
    return upper, freedom[order], variance[order]


def _symmetric(upper: csr_array) -> csr_array:
    """The whole matrix, and only entries that are not 0 or have an error."""
    return upper + scipy_sparse().triu(upper, k=1, format="csr").T


def warn_of_backs(backs: Floats) -> None:
    """Warn the caller of the function that calls this one of rows that see backs."""
    message = backs_message(backs, range(len(backs)), "pass sides='both'")
    if message:
        warnings.warn(f"octree: {message}", stacklevel=3)


def backs_message(backs: Floats, names: Sequence[object], remedy: str) -> str:
    """A warning of rows that see backs, by their names; empty if there are none."""
    seen = np.count_nonzero(backs)
    if not seen:
        return ""
    worst = int(backs.argmax())
    return (
        f"{seen} of {len(backs)} surfaces see backs of faces, surface {names[worst]} most: "
        f"{100.0 * backs[worst]:.3g} % of what it sends, which does not count; something stands on it, or the faces "
        f"that it sees are turned the wrong way: turn them, or {remedy}"
    )
