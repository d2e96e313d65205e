"""Pairs of surfaces whose exchange is exact: which are worth the time, and what they are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.numerics.compressed import firsts_of
from renderer.studies.factors.rows import Known, RowHits, Tracing
from renderer.studies.factors.work import Work

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# So many rays take as long as one exact pair of faces: 9 us, beside a quarter of one.
_PAIR = 40
# Of so many pairs of faces, half a second of work, all are tried.
_ALL = 50_000


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
        ends = np.bincount(self.rows, self.values, number) + np.bincount(self.columns, beside, number)
        return np.asarray(ends, np.float64)

    def known(self, number: int) -> Known:
        """The same as rows of targets that need no rays."""
        beside = self.rows != self.columns
        rows = np.concatenate([self.rows, self.columns[beside]])
        targets = np.concatenate([self.columns, self.rows[beside]])
        order = np.argsort(rows * number + targets, kind="stable")
        first = firsts_of(np.bincount(rows, minlength=number))
        return Known(first, targets[order])


def pairs_worth(tracing: Tracing, hits: RowHits | None) -> Worth | None:
    """The pairs that are worth the time: all of few faces, and then ``hits`` is not read; None if they are needed.

    A row takes 1 / rtol^2 random rays, but at most ``max_rays``, of which each entry that needs none saves its share.
    """
    surfaces = tracing.surfaces
    number, faces = surfaces.number, len(surfaces.of_face)
    if faces * (faces - 1) // 2 <= _ALL:
        return Worth(*np.triu_indices(number))
    if hits is None:
        return None
    inner = hits.targets < number
    rows, targets = hits.rows[inner], hits.targets[inner]
    pairs, of_pair = np.unique(np.minimum(rows, targets) * number + np.maximum(rows, targets), return_inverse=True)
    rays = min(1.0 / tracing.rtol**2, float(tracing.max_rays))
    saved = np.bincount(of_pair, hits.counts[inner] / hits.rays[rows]) * rays
    members = np.bincount(surfaces.of_face, minlength=number)
    low, high = pairs // number, pairs % number
    # In floats, as groups of a million faces have more pairs than int64 holds.
    worth = saved > _PAIR * members[low].astype(np.float64) * members[high]
    return Worth(low[worth], high[worth])


def known_of(tracing: Tracing, worth: Worth, work: Work) -> KnownPairs:
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
    sound = ((surfaces.transmittance == 0.0) & (surfaces.both == surfaces.two_sided))[faces].all(axis=1)
    # A face that is covered exchanges nothing.
    known = surfaces.covered[faces].any(axis=1)
    tried, exchange = np.flatnonzero(sound & ~known), np.zeros(len(faces))
    exchange[tried], known[tried] = work.pairs(tracing, faces[tried])
    unknown = np.bincount(pair, ~known, len(sizes)) > 0
    values: Floats = np.where(own, 2.0, 1.0) * np.bincount(pair, exchange, len(sizes))
    kept = ~unknown
    return KnownPairs(worth.rows[kept], worth.columns[kept], values[kept])
