"""The blocks that rays may hit, found sixteen rays at a time.

A block is listed where the ray passes some face's edges on the same side; where the hit lies is left to ``gather``.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.simd import at, get, movemask, put
from renderer.trace.intersect import see_triangles
from renderer.trace.layout import BLOCK_WORDS, LEAF_BITS
from renderer.trace.ray_lanes import shear_of
from renderer.trace.stream import leave_leaf, list_lane, meet_nodes, resume
from renderer.trace.traverse import begin_lanes, load_lane

# Rays that are searched for together, and the most blocks listed for each: twice as many as most rays through closed
# meshes meet. A ray that meets more is searched for alone.
TOGETHER, LISTED = 256, 32
CANDIDATE_WORDS = TOGETHER * (LISTED + 2)
# The rounds of sixteen rays after which no further ray begins: some milliseconds, several times what most meshes take.
_ROUNDS = 1 << 13


class Candidates(NamedTuple):
    """Pointers to int64: LISTED blocks for each ray; how many were met, which may be more; and the rays' numbers, with
    room for WIDTH more.
    """

    blocks: Any
    counts: Any
    numbers: Any


@inlined
def make_candidates(words):
    """``Candidates`` in memory for CANDIDATE_WORDS + WIDTH int64."""
    return Candidates(words, at(words, TOGETHER * LISTED), at(words, TOGETHER * (LISTED + 1)))


@kernel
def find_blocks(tree, rays, begin, end, scratch, found):
    """List the blocks that the rays from ``begin`` on may hit, at most TOGETHER rays.

    Returns the ray before which it ended, ``end`` unless there was much to do, and the number of rounds.
    """
    prepared, lanes, rounds = scratch.prepared, scratch.lanes, np.int64(0)
    count = end - begin
    for k in range(count):
        put(found.counts, k, 0)
        put(found.numbers, k, begin + k)
    nodes, leaves, ends = begin_lanes(rays, scratch, found.numbers, 0, count), 0, 0
    following = nodes
    while nodes + leaves + ends > 0:
        rounds += 1
        meet_nodes(tree, prepared, lanes, nodes)
        entered, nodes = nodes, 0
        for k in range(entered):
            r = get(lanes.at_node, k)
            child = resume(tree, prepared, lanes, r)
            nodes, leaves, ends = list_lane(lanes, r, child, (nodes, leaves, ends))
        _see_leaves(tree, prepared, lanes, leaves)
        entered, leaves = leaves, 0
        for k in range(entered):
            r = get(lanes.at_leaf, k)
            if get(lanes.bits, r) != 0:
                _list_block(found, get(scratch.number, r) - begin, ~get(lanes.child, r) >> LEAF_BITS)
            child = leave_leaf(tree, prepared, lanes, r)
            nodes, leaves, ends = list_lane(lanes, r, child, (nodes, leaves, ends))
        for k in range(ends):
            if following < count and rounds <= _ROUNDS:
                r = get(lanes.at_end, k)
                load_lane(rays, scratch, r, found.numbers, following)
                put(lanes.at_node, nodes, r)
                following, nodes = following + 1, nodes + 1
        ends = 0
    return begin + following, rounds


@inlined
def _see_leaves(tree, rays, lanes, count):
    """Compute of each of ``count`` rays which faces it passes within, in the first block of its leaf."""
    for k in range(count):
        r = get(lanes.at_leaf, k)
        block = ~get(lanes.child, r) >> LEAF_BITS
        _, seen = see_triangles(tree, block * BLOCK_WORDS, shear_of(rays, r))
        put(lanes.bits, r, movemask(seen))


@inlined
def _list_block(found, k, block):
    count = get(found.counts, k)
    put(found.counts, k, count + 1)
    if count < LISTED:
        put(found.blocks, k * LISTED + count, block)
