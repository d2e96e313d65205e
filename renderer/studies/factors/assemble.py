"""The exchanges of surfaces from exact pairs and counted rays, balanced."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.studies.factors.balance import Exchanges, balanced
from renderer.studies.factors.known import KnownPairs
from renderer.studies.factors.result import ViewFactors, csr_array
from renderer.studies.factors.rows import RowHits
from renderer.studies.factors.sparse import scipy_sparse
from renderer.studies.factors.tally import BACK, SKY

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# What may change of an exact entry beside others, where rays alone do not fill the rows.
_LITTLE = 1e-9


class _Counted(NamedTuple):
    """The entries that rays counted, each surface pair once: rows <= columns."""

    rows: Integers
    columns: Integers
    values: Floats
    freedom: Floats
    variance: Floats


def _counted(hits: RowHits, areas: Floats) -> _Counted:
    """The exchanges of pairs by the rays of both: their hits over the rays by area of both."""
    number = len(areas)
    inner = hits.targets < number
    rows, columns, counts = hits.rows[inner], hits.targets[inner], hits.counts[inner]
    density = hits.rays / areas
    # The error of a row's own estimate, weighed as its rays are.
    spread = (hits.errors[inner] * hits.rays[rows]) ** 2
    low, high = np.minimum(rows, columns), np.maximum(rows, columns)
    order = np.argsort(low * number + high, kind="stable")
    low, high = low[order], high[order]
    begins = np.flatnonzero(np.diff(low * number + high, prepend=-1))
    low, high = low[begins], high[begins]
    both = np.where(low == high, density[low], density[low] + density[high])
    # rule: reciprocal-exchange
    values = np.add.reduceat(counts[order].astype(np.float64), begins) / both if len(begins) else np.empty(0)
    variance = np.add.reduceat(spread[order], begins) / both**2 if len(begins) else np.empty(0)
    return _Counted(low, high, values, 1.0 / both, variance)


def assembled(areas: Floats, pairs: KnownPairs, hits: RowHits) -> ViewFactors:
    """The result: exact and counted entries, balanced."""
    number, counted = len(areas), _counted(hits, areas)
    sky, backs = areas * hits.share(number + SKY), areas * hits.share(number + BACK)
    outside_freedom = np.divide(areas, hits.rays, out=np.zeros(number), where=hits.rays > 0)
    rows, columns = np.concatenate([pairs.rows, counted.rows]), np.concatenate([pairs.columns, counted.columns])
    values = np.concatenate([pairs.values, counted.values])
    freedom = np.concatenate([np.zeros(len(pairs.rows)), counted.freedom])
    variance = np.concatenate([np.zeros(len(pairs.rows)), counted.variance])
    given = Exchanges(rows, columns, values, freedom, sky + backs, outside_freedom)
    found = balanced(given, areas)
    # What rays alone cannot fill: exact entries change as little as that leaves open.
    found = balanced(found._replace(freedom=np.maximum(freedom, _LITTLE * areas.mean())), areas)
    share = np.divide(found.outside, sky + backs, out=np.zeros(number), where=sky + backs > 0.0)
    warn_of_backs(backs * share / areas)
    used = found.values > 0.0
    rows, columns, values, variance = rows[used], columns[used], found.values[used], variance[used]
    exchange = _symmetric(rows, columns, values, number)
    errors = _symmetric(rows, columns, np.sqrt(variance), number)
    errors.data /= np.repeat(areas, np.diff(errors.indptr))
    return ViewFactors(areas, exchange, sky * share / areas, backs * share / areas, errors, hits.rays)


def _symmetric(rows: Integers, columns: Integers, values: Floats, number: int) -> csr_array:
    """The symmetric matrix of entries with rows <= columns."""
    beside = rows != columns
    places = np.concatenate([rows, columns[beside]]), np.concatenate([columns, rows[beside]])
    return scipy_sparse().csr_array((np.concatenate([values, values[beside]]), places), shape=(number, number))


def warn_of_backs(backs: Floats) -> None:
    seen = np.flatnonzero(backs)
    if len(seen):
        worst = int(backs.argmax())
        warnings.warn(
            f"octree: {len(seen)} of {len(backs)} surfaces see backs of faces, surface {worst} most: "
            f"{100.0 * backs[worst]:.3g} % of what it sends; turn these faces, or pass sides='both'",
            stacklevel=4,
        )
