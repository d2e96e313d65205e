"""Rays of many rows, traced until the errors of each row are small enough."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.numerics.compressed import firsts_of
from renderer.numerics.mixing import mixed, share_of
from renderer.ordering.morton import order_along_curve
from renderer.queryable import Built
from renderer.results.hits import Hits
from renderer.studies.factors.aim import WEYL, Senders, aim_rows, rays_from, turns_of
from renderer.studies.factors.surfaces import Surfaces
from renderer.studies.factors.tally import tally_rows, write_keys
from renderer.system.threads import for_chunks
from renderer.trace.batch import CHUNK, Leaving, RayBatch, make_starts, offset_origins, reject
from renderer.trace.closest import find_range
from renderer.trace.leaving import check_leaving
from renderer.trace.rays import HitArrays
from renderer.trace.spawn import offset_from_faces
from renderer.trace.starts.record import HEAD, ROW

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
# Is called with the rows done, or pairs, since the last call.
Update = Callable[[int], object] | None

# The rays of a row at first: the least that tells a share of a hundredth from one of a fiftieth.
FIRST_RAYS = 256
ROWS = CHUNK // FIRST_RAYS
# Rays of rows that are counted together: 16 MB, and some copies of them.
_KEYS = 1 << 21
_EVERYWHERE = (np.zeros(1), np.full(1, np.inf))


class Known(NamedTuple):
    """The entries of rows that need no rays, as compressed rows.

    first    (n + 1,) int64
    targets  (k,) int64, sorted in each row
    """

    first: Integers
    targets: Integers


class RowHits(NamedTuple):
    """The hits of the rays of n rows, as compressed rows; of the targets SKY and BACK follow the surfaces.

    first    (n + 1,) int64
    targets  (k,) int64, sorted in each row
    counts   (k,) int64: the rays that ended there
    errors   (k,) float64: the standard error of counts / rays
    rays     (n,) int64
    """

    first: Integers
    targets: Integers
    counts: Integers
    errors: Floats
    rays: Integers

    @property
    def rows(self) -> Integers:
        """The row of each target, (k,)."""
        return np.repeat(np.arange(len(self.rays)), np.diff(self.first))

    def share(self, target: int) -> Floats:
        """The share of each row's rays that ended at a target, (n,)."""
        chosen, count = self.targets == target, len(self.rays)
        hits = np.bincount(self.rows[chosen], self.counts[chosen], count)
        return np.divide(hits, self.rays, out=np.zeros(count), where=self.rays > 0)


class Tracing(NamedTuple):
    """The scene of the rays, and their aim; see ``view_factors``."""

    built: Built
    surfaces: Surfaces
    senders: Senders
    rtol: float
    max_rays: int
    threads: int
    progress: bool


def nothing_known(rows: int) -> Known:
    """``Known`` of no entries."""
    return Known(np.zeros(rows + 1, np.int64), np.empty(0, np.int64))


def trace_rows(tracing: Tracing, rows: Integers, known: Known, update: Update = None) -> RowHits:
    """Trace the rays of some rows; ``known`` has all rows. What a row hits does not depend on the others."""
    parts: list[tuple[Integers, RowHits]] = []
    order = order_of(tracing.senders, rows)

    def trace(begin: int, end: int) -> Iterator[None]:
        none = np.empty((end - begin, 0), np.int64)
        yield from _trace_until(tracing, order[begin:end], rows, known, parts, none)

    for_chunks(trace, len(rows), ROWS, tracing.threads, update)
    return in_order(parts)


def order_of(senders: Senders, rows: Integers) -> Integers:
    """The places of rows along a curve: rows beside each other send rays that travel together."""
    return order_along_curve(senders.corners[senders.first[rows], :3])[0]


def _trace_until(
    tracing: Tracing,
    places: Integers,
    rows: Integers,
    known: Known,
    parts: list[tuple[Integers, RowHits]],
    keys: Integers,
) -> Iterator[None]:
    """Trace the rows at some places until each has small errors or its most rays; add what they hit to ``parts``.

    ``keys`` (places, n) are those of the rays that are traced.
    """
    while len(places):
        rays = keys.shape[1]
        more = min(max(rays, FIRST_RAYS), tracing.max_rays - rays)
        if len(places) > 1 and len(places) * (rays + more) > _KEYS:
            half = len(places) // 2
            for part in (slice(0, half), slice(half, None)):
                yield from _trace_until(tracing, places[part], rows, known, parts, keys[part])
            return
        new = yield from keys_of(tracing, rows[places], rays, more)
        keys = np.sort(np.concatenate([keys, new], axis=1), axis=1)
        hits, unfinished = _tally(keys, rows[places], known, tracing.rtol, rays + more == tracing.max_rays)
        parts.append((places[~unfinished], hits))
        places, keys = places[unfinished], keys[unfinished]


def _tally(keys: Integers, rows: Integers, known: Known, rtol: float, last: bool) -> tuple[RowHits, NDArray[np.bool_]]:
    """The hits of rows by their sorted keys, of those that need no more rays; and which of them do."""
    count, rays = keys.shape
    targets, counts = np.empty((2, count * rays), np.int64)
    errors, lengths = np.empty(count * rays), np.empty(count, np.int64)
    unfinished = np.empty(count, np.bool_)
    spans = [known.targets[known.first[row] : known.first[row + 1]] for row in rows]
    first = firsts_of([len(span) for span in spans])
    written = tally_rows(keys, first, np.concatenate(spans), rtol, last, targets, counts, errors, lengths, unfinished)
    ends = firsts_of(lengths[~unfinished])
    targets, counts, errors = (column[:written].copy() for column in (targets, counts, errors))
    return RowHits(ends, targets, counts, errors, np.full(len(ends) - 1, rays)), unfinished


def in_order(parts: list[tuple[Integers, RowHits]]) -> RowHits:
    """The hits of rows in the order of their places, from records of some rows each."""
    none = np.empty(0, np.int64)
    parts = [(none, RowHits(np.zeros(1, np.int64), none, none, np.empty(0), none)), *parts]
    order = np.argsort(np.concatenate([own for own, _ in parts]), kind="stable")
    begins = np.concatenate([part.first[:-1] for _, part in parts])
    sizes = np.array([len(part.targets) for _, part in parts], np.int64)
    begins = begins + np.repeat(np.cumsum(sizes) - sizes, [len(own) for own, _ in parts])
    lengths = np.concatenate([np.diff(part.first) for _, part in parts])
    begins, lengths = begins[order], lengths[order]
    first = firsts_of(lengths)
    entries = np.arange(first[-1]) + np.repeat(begins - first[:-1], lengths)
    targets, counts, errors = (np.concatenate([part[k] for _, part in parts])[entries] for k in (1, 2, 3))
    return RowHits(first, targets, counts, errors, np.concatenate([part.rays for _, part in parts])[order])


def keys_of(tracing: Tracing, rows: Integers, begin: int, count: int) -> Generator[None, None, Integers]:
    """The hits of the rays from ``begin`` on, ``count`` of each row: keys as of ``tally_rows``, (rows, count)."""
    keys, surfaces = np.empty((len(rows), count), np.int64), tracing.surfaces
    width = min(count, CHUNK)
    height = max(1, CHUNK // width)
    for top in range(0, len(rows), height):
        for left in range(0, count, width):
            own, some = slice(top, top + height), min(width, count - left)
            found = yield from _hits_of(tracing, rows[own], begin + left, some)
            write_keys(found.left, found.hits.face, found.hits.side, surfaces.of_face, surfaces.both, surfaces.twin,
                       surfaces.covered, surfaces.number, begin + left, keys[own, left : left + some])  # fmt: skip
    return keys


class _Found(NamedTuple):
    """The face that each ray left, -1 for none, and what it hit."""

    left: Integers
    hits: Hits


def _hits_of(tracing: Tracing, rows: Integers, begin: int, count: int) -> Generator[None, None, _Found]:
    """The hits of the rays from ``begin`` on: the first of each row, then the second of each, and so on."""
    total, (mesh, tree) = len(rows) * count, tracing.built
    origins, moved, directions = np.empty((3, total, 3))
    faces, codes = np.empty((2, total), np.int64)
    aim_rows(*tracing.senders, rays_from(begin, count), turns_of(rows), rows, origins, directions, faces, codes)
    starts = make_starts(total, mesh)
    leaving, own = Leaving(faces, codes, np.empty((0, 3))), starts[HEAD:].view(np.float64).reshape(total, ROW)
    # None is too far from its face: it was placed there.
    offset_from_faces(mesh.vertices, mesh.faces, origins, directions, leaving, moved, own, 0, total, tree.scale)
    hits = yield from _closest(tracing, RayBatch(moved, directions, *_EVERYWHERE, starts))
    if tracing.surfaces.transmittance.any():
        yield from _pass_through(tracing, hits, directions, rows, begin)
    return _Found(faces, hits)


def _closest(tracing: Tracing, rays: RayBatch) -> Generator[None, None, Hits]:
    mesh, tree = tracing.built
    t, u, v = np.empty((3, rays.number))
    face, side, pile = np.empty((3, rays.number), np.int64)
    found = HitArrays(t, face, u, v, side, pile, np.empty(0, np.bool_))
    bad: list[int] = []
    yield from find_range(tree, rays, found, None, 0, rays.number, bad)
    if bad:
        reject(rays, bad[0], tree.scale)
    return Hits(t, face, u, v, mesh, None, side, pile)


def _pass_through(tracing: Tracing, hits: Hits, directions: Floats, rows: Integers, begin: int) -> Iterator[None]:
    """Let rays go on through the faces that they hit, as often as these let a share through; ``hits`` is changed.

    A ray goes on whole or not at all, by a number of its own, so that rows are counts.
    """
    mesh, tree = tracing.built
    numbered = np.arange(begin, begin + len(directions) // len(rows), dtype=np.uint64)
    numbers = ((numbered << np.uint64(32))[:, None] + rows.astype(np.uint64)).reshape(-1)
    rays = np.flatnonzero(hits.face >= 0)
    while len(rays):
        numbers[rays] = mixed(numbers[rays] + WEYL)
        # rule: transmitted-share
        rays = rays[share_of(numbers[rays]) < tracing.surfaces.transmittance[hits.face[rays]]]
        if len(rays) == 0:
            return
        here = hits[rays]
        leaving = check_leaving(here.through(), None, here.face.shape, len(mesh.faces))
        start = RayBatch(np.ascontiguousarray(here.points), directions[rays], *_EVERYWHERE)
        yield from _go_on(tracing, hits, rays, offset_origins(start, leaving, mesh, tree.scale, 1))
        rays = rays[hits.face[rays] >= 0]


def _go_on(tracing: Tracing, hits: Hits, rays: Integers, batch: RayBatch) -> Iterator[None]:
    """Replace the hits of some rays by those of a batch."""
    further = yield from _closest(tracing, batch)
    for old, new in zip(_columns(hits), _columns(further), strict=True):
        old[rays] = new


def _columns(hits: Hits) -> tuple[NDArray[np.generic], ...]:
    side, pile = hits.side, hits._pile
    assert side is not None and pile is not None
    return hits.t, hits.face, hits.u, hits.v, side, pile
