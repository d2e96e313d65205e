"""The blocks that rays may hit, found as a stream.

A block is listed if the ray passes all edges of one of its faces on the same side; ``gather`` computes the hit.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load, minimum, offset, store
from renderer.trace.intersect import see_triangles
from renderer.trace.layout import BLOCK_WORDS
from renderer.trace.ray_lanes import CHILD, NUMBER, WIDTH, Prepared, shear_of
from renderer.trace.stream import MIN_ACTIVE, LaneCounts, Lanes, Queue, clear_lanes, run_lanes
from renderer.trace.walk import first_block

# Rays that are searched for together, and the most blocks listed for each: twice as many as most rays through closed
# meshes meet. A ray that meets more is searched for alone.
TOGETHER, LISTED = 256, 32
CANDIDATE_WORDS = TOGETHER * (LISTED + 2)
# The rounds of lanes after which no further ray begins: some milliseconds, several times what most meshes take.
_ROUNDS = 1 << 12


class Candidates(NamedTuple):
    """Pointers to int64: LISTED blocks for each ray; the number found, which may be larger; and the rays' numbers, with
    room for WIDTH more.
    """

    blocks: Any
    counts: Any
    numbers: Any


@inlined
def make_candidates(words):
    """``Candidates`` in memory for CANDIDATE_WORDS + WIDTH int64."""
    return Candidates(words, offset(words, TOGETHER * LISTED), offset(words, TOGETHER * (LISTED + 1)))


class _Query(NamedTuple):
    """Rays in lanes, the number of the first, and the lists of the blocks that they enter."""

    prepared: Prepared
    lanes: Lanes
    begin: int
    found: Candidates


@kernel
def find_blocks(tree, rays, begin, end, scratch, found):
    """List the blocks that the rays from ``begin`` on may hit, at most TOGETHER rays.

    Returns the ray before which it ended, ``end`` unless there was much work, and roughly the number of rounds of
    sixteen rays.
    """
    count, query = end - begin, _Query(scratch.prepared, scratch.lanes, begin, found)
    clear_lanes(scratch.lanes, count)
    for k in range(count + WIDTH):
        store(found.numbers, k, begin + minimum(k, count - 1))
    for k in range(count):
        store(found.counts, k, 0)
    none, queue = LaneCounts(np.int64(0), np.int64(0), np.int64(0)), Queue(found.numbers, np.int64(0), count)
    following, rounds = run_lanes(
        tree, rays, scratch.prepared, scratch.lanes, none, queue, _ROUNDS, query, True,
        _see_leaves, _list_seen, _finish,
    )  # fmt: skip
    return begin + following, rounds * (MIN_ACTIVE // WIDTH)


@inlined
def _see_leaves(tree, query, lanes, count):
    """For each of ``count`` rays, find the faces whose edges it passes within, in the first block of its leaf."""
    for k in range(count):
        r = load(lanes.at_leaf, k)
        block = first_block(load(query.prepared.integers, CHILD + r))
        _, seen = see_triangles(tree, block * BLOCK_WORDS, shear_of(query.prepared, r))
        store(lanes.bits, k, seen)


@inlined
def _list_seen(tree, query, k):
    """List the block of the k-th ray at a leaf, if it passes within a face."""
    r, integers = load(query.lanes.at_leaf, k), query.prepared.integers
    # rule: seen-blocks
    if load(query.lanes.bits, k) != 0:
        _list_block(query.found, load(integers, NUMBER + r) - query.begin, first_block(load(integers, CHILD + r)))
    return False


@inlined
def _finish(tree, query, r):
    return np.int64(0)


@inlined
def _list_block(found, k, block):
    count = load(found.counts, k)
    store(found.counts, k, count + 1)
    if count < LISTED:
        store(found.blocks, k * LISTED + count, block)
