"""Pairs of surfaces whose exchange is exact: which are worth the time, and what they are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.studies.factors.pairs import exact_pairs
from renderer.studies.factors.rows import Known, RowHits, Tracing
from renderer.studies.factors.surfaces import Surfaces
from renderer.system.terminal import progress_bar

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# So many rays take as long as one exact pair of faces.
_PAIR = 150
# Of so many pairs of faces, a second of work, all are tried.
_ALL = 50_000
# The rays that an entry takes, beside as many random ones.
_EVEN = 0.25


class Worth(NamedTuple):
    """Pairs of surfaces, each once: rows <= columns, (k,) int64 both."""

    rows: Integers
    columns: Integers


class KnownPairs(NamedTuple):
    """Pairs of surfaces whose exchange is exact: rows <= columns, (k,) int64 both, and values (k,) float64."""

    rows: Integers
    columns: Integers
    values: Floats

    def sums(self, number: int) -> Floats:
        """The sum of each of the rows."""
        beside = np.where(self.rows == self.columns, 0.0, self.values)
        return np.bincount(self.rows, self.values, number) + np.bincount(self.columns, beside, number)

    def known(self, areas: Floats) -> Known:
        """The same as rows of targets that need no rays."""
        number, beside = len(areas), self.rows != self.columns
        rows = np.concatenate([self.rows, self.columns[beside]])
        targets = np.concatenate([self.columns, self.rows[beside]])
        largest = np.zeros(number)
        np.maximum.at(largest, rows, np.concatenate([self.values, self.values[beside]]) / areas[rows])
        order = np.argsort(rows * number + targets, kind="stable")
        first = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=number))])
        return Known(first, targets[order], largest)


def pairs_worth(tracing: Tracing, hits: RowHits | None) -> Worth | None:
    """The pairs that are worth the time: all of few faces, and then ``hits`` is not read; None if they are needed.

    Of each row so many of the largest entries are made exact that these and the rays which the next one needs take the
    least time.
    """
    surfaces = tracing.surfaces
    number, faces = surfaces.number, len(surfaces.of_face)
    if faces * (faces - 1) // 2 <= _ALL:
        return Worth(*np.triu_indices(number))
    if hits is None:
        return None
    rows = hits.rows
    factors = hits.counts / hits.rays[rows]
    inner = hits.targets < number
    # Entries of each row by size; those outside, which rays alone find, do not end up among them.
    order = np.lexsort((-factors, ~inner, rows))
    rows, targets, factors, inner = rows[order], hits.targets[order], factors[order], inner[order]
    largest = np.zeros(number)
    np.maximum.at(largest, rows, factors)
    rays = _EVEN * factors / (tracing.rtol * largest[rows]) ** 2
    chosen = _cheapest(hits.first, rows, np.where(inner, _cost_of(surfaces, rows, targets, inner), np.inf), rays)
    low, high = np.minimum(rows[chosen], targets[chosen]), np.maximum(rows[chosen], targets[chosen])
    kept = np.unique(low * number + high)
    return Worth(kept // number, kept % number)


def _cost_of(surfaces: Surfaces, rows: Integers, targets: Integers, inner: NDArray[np.bool_]) -> Floats:
    """The time of each pair, in rays."""
    members = np.bincount(surfaces.of_face, minlength=surfaces.number)
    return _PAIR * members[rows].astype(np.float64) * np.where(inner, members[np.where(inner, targets, 0)], 0)


def _cheapest(first: Integers, rows: Integers, cost: Floats, rays: Floats) -> NDArray[np.bool_]:
    """Which entries are made exact, of rows that are sorted by size."""
    outside = np.zeros(len(first) - 1)
    np.maximum.at(outside, rows[np.isinf(cost)], rays[np.isinf(cost)])
    place = np.arange(len(rows)) - first[rows]
    ends = np.where(np.isinf(cost), 0.0, cost)
    before = np.cumsum(ends) - ends
    before -= before[first[rows]]
    total = before + np.maximum(rays, outside[rows])
    best = np.full(len(first) - 1, np.inf)
    np.minimum.at(best, rows, total)
    stop = np.full(len(first) - 1, len(rows))
    at_best = total == best[rows]
    np.minimum.at(stop, rows[at_best], place[at_best])
    return (place < stop[rows]) & np.isfinite(cost)


def known_of(tracing: Tracing, worth: Worth) -> KnownPairs:
    """The pairs among those worth it that are proven for all their faces, with their exchange."""
    surfaces = tracing.surfaces
    order = np.argsort(surfaces.of_face, kind="stable")
    counts = np.bincount(surfaces.of_face, minlength=surfaces.number)
    begins = np.cumsum(counts) - counts
    sizes = counts[worth.rows] * counts[worth.columns]
    pair = np.repeat(np.arange(len(sizes)), sizes)
    within = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    across = counts[worth.columns][pair]
    first = order[begins[worth.rows][pair] + within // np.maximum(across, 1)]
    second = order[begins[worth.columns][pair] + within % np.maximum(across, 1)]
    # Within one surface each pair comes twice, and each face with itself.
    own = worth.rows == worth.columns
    once = ~own[pair] | (first < second)
    pair, first, second = pair[once], first[once], second[once]
    faces = np.stack([np.minimum(first, second), np.maximum(first, second)], axis=1)
    sound = ~surfaces.both[faces].any(axis=1)
    with progress_bar(len(faces), "pair", tracing.progress) as update:
        exchange, known = exact_pairs(tracing.built, faces, tracing.threads, update)
    unknown = np.bincount(pair, ~(known & sound), len(sizes)) > 0
    values = np.bincount(pair, exchange, len(sizes)) * np.where(own, 2.0, 1.0)
    kept = ~unknown
    return KnownPairs(worth.rows[kept], worth.columns[kept], values[kept])
