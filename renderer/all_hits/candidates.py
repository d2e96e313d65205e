"""The blocks that rays may hit, found as a stream.

A block is listed where the ray passes some face's edges on the same side; where the hit lies is left to ``gather``.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import at, get, put, smaller
from renderer.trace.intersect import see_triangles
from renderer.trace.layout import BLOCK_WORDS, LEAF_BITS
from renderer.trace.ray_lanes import CHILD, NUMBER, WIDTH, shear_of
from renderer.trace.stream import begin_rays, clear_lanes, end_ray, leave_leaf, list_lane, meet_nodes, resume

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
    prepared, lanes, steps = scratch.prepared, scratch.lanes, np.int64(0)
    count, following = end - begin, np.int64(0)
    nodes, leaves, ends = 0, 0, 0
    clear_lanes(lanes)
    for k in range(count + WIDTH):
        put(found.numbers, k, begin + smaller(k, count - 1))
    for k in range(count):
        put(found.counts, k, 0)
    while True:
        if following < count and steps <= _ROUNDS * WIDTH:
            following, nodes = begin_rays(rays, prepared, lanes, (found.numbers, following, count), (nodes, leaves))
        if nodes + leaves + ends == 0:
            return begin + following, steps // WIDTH
        steps += nodes + leaves
        meet_nodes(tree, prepared, lanes, nodes)
        entered, nodes = nodes, 0
        for k in range(entered):
            r = get(lanes.at_node, k)
            nodes, leaves, ends = list_lane(lanes, r, resume(tree, prepared, lanes, r), (nodes, leaves, ends))
        _see_leaves(tree, prepared, lanes, leaves)
        entered, leaves = leaves, 0
        for k in range(entered):
            r = get(lanes.at_leaf, k)
            # rule: seen-blocks
            if get(lanes.bits, k) != 0:
                block = ~get(prepared.integers, CHILD + r) >> LEAF_BITS
                _list_block(found, get(prepared.integers, NUMBER + r) - begin, block)
            nodes, leaves, ends = list_lane(lanes, r, leave_leaf(tree, prepared, lanes, r), (nodes, leaves, ends))
        for k in range(ends):
            end_ray(lanes, get(lanes.at_end, k))
        ends = 0


@inlined
def _see_leaves(tree, rays, lanes, count):
    """Compute of each of ``count`` rays which faces it passes within, in the first block of its leaf."""
    for k in range(count):
        r = get(lanes.at_leaf, k)
        block = ~get(rays.integers, CHILD + r) >> LEAF_BITS
        _, seen = see_triangles(tree, block * BLOCK_WORDS, shear_of(rays, r))
        put(lanes.bits, k, seen)


@inlined
def _list_block(found, k, block):
    count = get(found.counts, k)
    put(found.counts, k, count + 1)
    if count < LISTED:
        put(found.blocks, k * LISTED + count, block)
