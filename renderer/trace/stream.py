"""Incoherent rays through the tree, sixteen at a time; the next ray takes the place of one that ends.

The processor cannot predict whether a ray goes to a node, goes to a leaf, or ends, and a mispredicted branch discards
all work begun after it. So each round first computes what every ray meets, without a branch, and then decides: the
results are there by then, and a misprediction costs little. Meanwhile the records for the next round come from memory.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.kernels.jit import inlined
from renderer.kernels.simd import (
    above,
    at,
    bits_float,
    count_bits,
    get,
    greatest_first,
    lowest_bit,
    movemask,
    prefetch,
    put,
    splat4,
    splat8,
    store,
)
from renderer.trace.intersect import box_limit, enter_boxes, meet_planes, see_triangles
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CACHE_LINE, CHILDREN, LEAF_BITS, MAX_LEAF_BLOCKS, NODE_WORDS
from renderer.trace.ray_lanes import LARGEST, LIMIT, LOWER, T_MIN, WIDTH, T, best_of, put_best, shear_of, slabs_of

_LOW_WORD = 0xFFFFFFFF
# The entry at the bottom of each ray's stack. END is the code of no leaf. The distance -inf is beyond no limit, not
# even beyond NaN, so no ray goes below its stack.
END = -(1 << 31)
_BOTTOM = (-0x800000 << 32) | (END & _LOW_WORD)
_LINE = CACHE_LINE // 4


@inlined
def _prefetch_child(tree, child):
    """Ask for the record that a ray's next step will read."""
    if child >= 0:
        for line in range(NODE_WORDS // _LINE):
            prefetch(tree.nodes, child * NODE_WORDS + line * _LINE)
    else:
        # A float64 block is twice as long: every second line is asked for, the hardware fetches the next one by itself.
        first = (~child >> LEAF_BITS) * BLOCK_WORDS
        for line in range(3):
            prefetch(tree.blocks, (first + line * _LINE) << tree.wide)


class Lanes(NamedTuple):
    """Sixteen rays under way, as pointers: for each ray its next child, the top of its stack and the stack; the lists
    of the rays at a node, at a leaf and at END; and the results of a round: the bits of the triangles met, those of the
    triangles in doubt, and their t, u, v, w.
    """

    child: Any
    top: Any
    stacks: Any
    stack_size: int
    at_node: Any
    at_leaf: Any
    at_end: Any
    bits: Any
    doubts: Any
    hits: Any


# The numbers of int64 (without the stacks) and float64 in ``Lanes``.
LANE_INTEGERS, LANE_DOUBLES = 7 * WIDTH, 4 * BLOCK_FACES * WIDTH


@inlined
def make_lanes(integers, doubles, stack_size):
    """Lanes in the given memory; the stacks, ``stack_size`` entries each, follow the LANE_INTEGERS other words."""
    return Lanes(
        integers, at(integers, WIDTH), at(integers, LANE_INTEGERS), stack_size, at(integers, 2 * WIDTH),
        at(integers, 3 * WIDTH), at(integers, 4 * WIDTH), at(integers, 5 * WIDTH), at(integers, 6 * WIDTH), doubles,
    )  # fmt: skip


@inlined
def begin_ray(lanes, r):
    """Let the prepared ray ``r`` start at the root."""
    put(lanes.child, r, 0)
    put(lanes.top, r, 1)
    put(lanes.stacks, r * lanes.stack_size, _BOTTOM)


@inlined
def wait_octant(lanes, r, entry, child):
    """Push an octant onto the stack of ray ``r``: the distance of ``entry``, and its child."""
    top = get(lanes.top, r)
    put(lanes.stacks, r * lanes.stack_size + top, ((entry >> 32) << 32) | (child & _LOW_WORD))
    put(lanes.top, r, top + 1)


@inlined
def resume(tree, rays, lanes, r):
    """Take the next child of ray ``r`` off its stack, and return it."""
    stack, top = at(lanes.stacks, r * lanes.stack_size), get(lanes.top, r) - 1
    return _go_on(tree, rays, lanes, r, stack, get(stack, top), top)


@inlined
def meet_nodes(tree, rays, lanes, count):
    """Push the octants of its node that each of ``count`` rays meets onto its stack, the nearest last.

    It takes no branch: all eight are sorted and written, and the top moves by those that are met.
    """
    for k in range(count):
        r = get(lanes.at_node, k)
        node, top = get(lanes.child, r), get(lanes.top, r)
        lower, upper = splat8(get(rays.floats, LOWER + r)), splat8(get(rays.floats, LIMIT + r))
        t0, meets = enter_boxes(tree.nodes, node, slabs_of(rays, r), lower, upper)
        octants = above(t0, tree.links, node * NODE_WORDS + CHILDREN)
        store(lanes.stacks, r * lanes.stack_size + top, greatest_first(meets, octants))
        put(lanes.top, r, top + count_bits(movemask(meets)))


@inlined
def _go_on(tree, rays, lanes, r, stack, entry, top):
    """Go on with ``entry``, or where that is beyond the best hit, with the next one below ``top`` that is not."""
    limit = get(rays.floats, LIMIT + r)
    while bits_float(entry >> 32) > limit:
        top -= 1
        entry = get(stack, top)
    child = np.int64(np.int32(entry & _LOW_WORD))
    put(lanes.child, r, child)
    put(lanes.top, r, top)
    _prefetch_child(tree, child)
    return child


@inlined
def meet_leaves(tree, rays, lanes, count):
    """Compute what each of ``count`` rays hits in the first block of its leaf."""
    for k in range(count):
        r = get(lanes.at_leaf, k)
        block, shear = ~get(lanes.child, r) >> LEAF_BITS, shear_of(rays, r)
        edges, seen = see_triangles(tree, block * BLOCK_WORDS, shear)
        t_min, t_max = get(rays.doubles, T_MIN + r), get(rays.doubles, T + r)
        t, doubt, _, due = meet_planes(edges, shear, t_min, t_max)
        put(lanes.bits, r, movemask(seen & (t >= splat4(t_min)) & (t <= splat4(t_max))) & ~movemask(doubt))
        put(lanes.doubts, r, movemask(seen & due))
        hits = 4 * BLOCK_FACES * r
        store(lanes.hits, hits, t)
        store(lanes.hits, hits + BLOCK_FACES, edges.e1)
        store(lanes.hits, hits + 2 * BLOCK_FACES, edges.e2)
        store(lanes.hits, hits + 3 * BLOCK_FACES, edges.determinant)


@inlined
def take_hits(tree, rays, lanes, r):
    """Keep the best hit of a leaf's first block. Returns whether there is one, and whether any hit was in doubt."""
    block, bits, hits = ~get(lanes.child, r) >> LEAF_BITS, get(lanes.bits, r), at(lanes.hits, 4 * BLOCK_FACES * r)
    doubtful = get(lanes.doubts, r)
    if bits != 0:
        t, face, u, v, w = best_of(rays, r)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            ti, fi = get(hits, i), get(tree.faces, block * BLOCK_FACES + i)
            if ti < t or (ti == t and fi < face):
                t, face = ti, fi
                u, v, w = get(hits, BLOCK_FACES + i), get(hits, 2 * BLOCK_FACES + i), get(hits, 3 * BLOCK_FACES + i)
        put_best(rays, r, (t, face, u, v, w))
        put(rays.floats, LIMIT + r, box_limit(t, get(rays.doubles, LARGEST + r)))
        return True, doubtful != 0
    return False, doubtful != 0


@inlined
def leave_leaf(tree, rays, lanes, r):
    """Choose the next child of ray ``r`` at a leaf: the rest of its blocks, else one off its stack. Returns it."""
    child = get(lanes.child, r)
    if ~child & (MAX_LEAF_BLOCKS - 1) != 0:
        # The first block is one further on, and the number of blocks one less.
        child -= MAX_LEAF_BLOCKS - 1
        put(lanes.child, r, child)
        return child
    return resume(tree, rays, lanes, r)


@inlined
def list_lane(lanes, r, child, lists):
    """Put lane ``r`` into the list of nodes, of leaves or of ends, as its next child is.

    ``lists`` are the lengths of the three; returns them anew. It takes no branch: the lane is written to all three.
    """
    nodes, leaves, ends = lists
    put(lanes.at_node, nodes, r)
    put(lanes.at_leaf, leaves, r)
    put(lanes.at_end, ends, r)
    at_node, at_end = np.int64(child >= 0), np.int64(child == END)
    return nodes + at_node, leaves + (1 - at_node - at_end), ends + at_end
