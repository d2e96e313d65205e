"""The queries ``all_hits`` and ``count_hits``: chunks of rays on threads, in memory that grows with the hits found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.all_hits.candidates import CANDIDATE_WORDS
from renderer.all_hits.gather import (
    DOUBLE_ROWS,
    INTEGER_ROWS,
    OUT_FACE,
    OUT_SIDE,
    OUT_T,
    OUT_U,
    OUT_V,
    Choice,
    gather_chunk,
)
from renderer.arguments.arrays import flag_argument
from renderer.arguments.counts import count_argument
from renderer.mesh.mesh import Mesh
from renderer.results.hits import AllHits
from renderer.system.threads import for_chunks
from renderer.trace.batch import CHUNK, RayBatch, reject
from renderer.trace.closest import rays_against_blocks
from renderer.trace.layout import Tree
from renderer.trace.traverse import new_scratch

# Hits that a thread gathers before it hands them over, unless one ray has more: 3.5 MB; of few rays, so many a ray.
_CAPACITY, _OF_A_RAY = 1 << 15, 64
_ANY_NUMBER = np.iinfo(np.int64).max


class _Part(NamedTuple):
    """Hits of consecutive rays: t, u and v, (3, k) float64, and face and side, (2, k) int64."""

    doubles: NDArray[np.float64]
    integers: NDArray[np.int64]


def all_hits(
    tree: Tree,
    rays: RayBatch,
    mesh: Mesh,
    contacts: bool,
    max_hits: int | None,
    shape: tuple[int, ...],
    threads: int,
) -> AllHits:
    """All hits of a batch of rays, see ``Octree.all_hits``."""
    choice = Choice(flag_argument("contacts", contacts), _most(max_hits), True)
    counts, parts = _gathered(tree, rays, choice, threads)
    offsets = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    t, u, v = np.concatenate([np.empty((3, 0)), *(part.doubles for part in parts)], axis=1)
    face, side = np.concatenate([np.empty((2, 0), np.int64), *(part.integers for part in parts)], axis=1)
    return AllHits(offsets, t, face, u, v, mesh, shape, None, side)


def count_hits(tree: Tree, rays: RayBatch, contacts: bool, threads: int) -> NDArray[np.int64]:
    """The number of hits of each ray of a batch, see ``Octree.count_hits``."""
    return _gathered(tree, rays, Choice(flag_argument("contacts", contacts), _ANY_NUMBER, False), threads)[0]


def _most(max_hits: int | None) -> int:
    if max_hits is None:
        return _ANY_NUMBER
    return min(count_argument("max_hits", max_hits, 1, alternative=" or None"), _ANY_NUMBER)


def _gathered(tree: Tree, rays: RayBatch, choice: Choice, threads: int) -> tuple[NDArray[np.int64], list[_Part]]:
    """The number of hits of each ray, and the hits in the order of the rays."""
    count = rays.number
    counts, parts, bad = np.zeros(count, np.int64), dict[int, _Part](), list[int]()

    def gather(begin: int, end: int) -> Iterator[None]:
        # Only chunks after a bad ray are left out, so the first bad ray is always found.
        if bad and bad[0] < begin:
            return
        memory, scratch = _memory(min(_CAPACITY, _OF_A_RAY * (end - begin))), new_scratch(tree.depth, CANDIDATE_WORDS)
        while begin < end:
            reached, row = gather_chunk(tree.descriptor, rays, begin, end, choice, counts, *memory, scratch)
            if row >= 0:
                bad.append(row)
                return
            if choice.keep:
                parts[begin] = _taken(*memory, int(counts[begin:reached].sum()))
            if reached == begin:
                # One ray has more hits than the memory holds.
                memory = _memory(2 * memory[0].shape[1])
            begin = reached
            yield

    for_chunks(gather, count, CHUNK if tree.has_nodes else min(CHUNK, rays_against_blocks(tree)), threads)
    if bad:
        reject(rays, min(bad), tree.scale)
    return counts, [parts[begin] for begin in sorted(parts)]


def _memory(capacity: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    return np.empty((DOUBLE_ROWS, capacity)), np.empty((INTEGER_ROWS, capacity), np.int64)


def _taken(doubles: NDArray[np.float64], integers: NDArray[np.int64], count: int) -> _Part:
    return _Part(doubles[[OUT_T, OUT_U, OUT_V], :count], integers[[OUT_FACE, OUT_SIDE], :count])
