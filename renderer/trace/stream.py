"""Incoherent rays through the tree, up to forty at a time: eight more begin where there is room.

The processor cannot predict whether a ray goes to a node, goes to a leaf, or ends, and a mispredicted branch discards
all work begun after it. So each round first computes what every ray meets, without a branch, and then decides: the
results are there by then, and a misprediction costs little. Meanwhile the records for the next round come from memory.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import (
    at,
    bits_float,
    count_bits,
    farthest_first,
    get,
    lowest_bit,
    movemask,
    prefetch,
    put,
    smaller,
    splat4,
    splat8,
    store,
)
from renderer.trace.intersect import box_limit, meet_boxes, meet_planes, see_triangles
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CACHE_LINE, CHILDREN, LEAF_BITS, MAX_LEAF_BLOCKS, NODE_WORDS
from renderer.trace.ray_lanes import (
    CHILD,
    DOUBTFUL,
    LARGEST,
    LIMIT,
    LOWER,
    NUMBER,
    SIXTEEN,
    T_MIN,
    TOP,
    WIDTH,
    T,
    best_of,
    prepare_eight,
    put_best,
    shear_of,
    slabs_of,
)

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
    """Rays under way, as pointers: their stacks; the lists of the rays at a node, at a leaf and at END; of a round, for
    each ray in the list of leaves, the bits of the triangles met, those in doubt, and t, u, v, w; and which lanes are
    free.

    The lanes of eight rays are taken together. ``left`` is the number of each eight's rays that are under way, and in
    its last word the bits of the eights that are free.
    """

    stacks: Any
    stack_size: int
    at_node: Any
    at_leaf: Any
    at_end: Any
    bits: Any
    doubts: Any
    hits: Any
    left: Any


# The lanes. Eight are free again when all their rays have ended, so there are more lanes than rays under way. Eight
# more begin where no more than ENOUGH are. With 32 instead of 16, random rays take 5 % less time on a mesh of 1e5
# faces, 10 % on one of 1e6 and 14 % on one of 5e6; with 48 or 64, within 5 % of that.
SIXTEENS = 8
_EIGHTS, _LANES = 2 * SIXTEENS, SIXTEENS * WIDTH
ENOUGH = 2 * WIDTH
# The numbers of int64 (without the stacks) and float64 in ``Lanes``.
LANE_INTEGERS, LANE_DOUBLES = 5 * _LANES + _EIGHTS + 1, 4 * BLOCK_FACES * _LANES


@inlined
def make_lanes(integers, doubles, stack_size):
    """Lanes in the given memory; the stacks, ``stack_size`` entries each, follow the LANE_INTEGERS other words."""
    return Lanes(
        at(integers, LANE_INTEGERS), stack_size, integers, at(integers, _LANES), at(integers, 2 * _LANES),
        at(integers, 3 * _LANES), at(integers, 4 * _LANES), doubles, at(integers, 5 * _LANES),
    )  # fmt: skip


@inlined
def clear_lanes(lanes):
    """Let all lanes be free."""
    put(lanes.left, _EIGHTS, (1 << _EIGHTS) - 1)


@inlined
def begin_rays(rays, prepared, lanes, waiting, lists):
    """Let rays begin, eight at a time, while few are under way and lanes are free.

    waiting  the numbers of rays that wait, with seven more to be read; the first that has not begun; and their number
    lists    the lengths of the lists of nodes and leaves

    Returns the first ray that still waits, and the length of the list of nodes.
    """
    numbers, following, count = waiting
    nodes, leaves = lists
    while following < count and nodes + leaves <= ENOUGH and get(lanes.left, _EIGHTS) != 0:
        free = get(lanes.left, _EIGHTS)
        eight = lowest_bit(free)
        put(lanes.left, _EIGHTS, free & (free - 1))
        some, r = smaller(count - following, 8), (eight >> 1) * SIXTEEN + 8 * (eight & 1)
        prepare_eight(rays, prepared, r, at(numbers, following))
        put(lanes.left, eight, some)
        for k in range(some):
            begin_ray(prepared, lanes, r + k, get(numbers, following + k))
            put(lanes.at_node, nodes + k, r + k)
        following, nodes = following + some, nodes + some
    return following, nodes


@inlined
def begin_ray(prepared, lanes, r, number):
    """Let the prepared ray in lane ``r`` start at the root."""
    integers, bottom = prepared.integers, stack_of(lanes, r)
    put(integers, CHILD + r, 0)
    put(integers, TOP + r, bottom + 1)
    put(integers, NUMBER + r, number)
    put(integers, DOUBTFUL + r, 0)
    put(lanes.stacks, bottom, _BOTTOM)


@inlined
def stack_of(lanes, r):
    """Where the stack of lane ``r`` begins in ``stacks``."""
    return ((r // SIXTEEN) * WIDTH + r % WIDTH) * lanes.stack_size


@inlined
def end_ray(lanes, r):
    """Count a ray as ended; its eight lanes are free when it is the last of them."""
    eight = 2 * (r // SIXTEEN) + r % WIDTH // 8
    left = get(lanes.left, eight) - 1
    put(lanes.left, eight, left)
    put(lanes.left, _EIGHTS, get(lanes.left, _EIGHTS) | (np.int64(left == 0) << eight))


@inlined
def wait_octant(prepared, lanes, r, entry, child):
    """Push an octant onto the stack of ray ``r``: the distance of ``entry``, and its child."""
    top = get(prepared.integers, TOP + r)
    put(lanes.stacks, top, ((entry >> 32) << 32) | (child & _LOW_WORD))
    put(prepared.integers, TOP + r, top + 1)


@inlined
def meet_nodes(tree, rays, lanes, count):
    """Push the octants of its node that each of ``count`` rays meets onto its stack, the nearest last.

    It takes no branch: all eight are sorted and written, and the top moves by those that are met.
    """
    for k in range(count):
        r = get(lanes.at_node, k)
        node, top = get(rays.integers, CHILD + r), get(rays.integers, TOP + r)
        lower, upper = splat8(get(rays.floats, LOWER + r)), splat8(get(rays.floats, LIMIT + r))
        t0, meets = meet_boxes(tree.nodes, node, slabs_of(rays, r), lower, upper)
        store(lanes.stacks, top, farthest_first(meets, t0, tree.links, node * NODE_WORDS + CHILDREN))
        put(rays.integers, TOP + r, top + count_bits(movemask(meets)))


@inlined
def resume(tree, rays, lanes, r):
    """Take the next child of ray ``r`` that is not beyond its best hit off its stack, and return it."""
    # rule: resume-limit
    limit, top = get(rays.floats, LIMIT + r), get(rays.integers, TOP + r) - 1
    entry = get(lanes.stacks, top)
    while bits_float(entry >> 32) > limit:
        top -= 1
        entry = get(lanes.stacks, top)
    child = np.int64(np.int32(entry & _LOW_WORD))
    put(rays.integers, CHILD + r, child)
    put(rays.integers, TOP + r, top)
    _prefetch_child(tree, child)
    return child


@inlined
def meet_leaves(tree, rays, lanes, count):
    """Compute what each of ``count`` rays hits in the first block of its leaf."""
    for k in range(count):
        r = get(lanes.at_leaf, k)
        block, shear = ~get(rays.integers, CHILD + r) >> LEAF_BITS, shear_of(rays, r)
        edges, seen = see_triangles(tree, block * BLOCK_WORDS, shear)
        t_min, t_max = get(rays.doubles, T_MIN + r), get(rays.doubles, T + r)
        t, doubts, _, dues = meet_planes(tree, block * BLOCK_WORDS, edges, seen, shear, t_min, t_max)
        put(lanes.bits, k, seen & ~doubts & movemask((t >= splat4(t_min)) & (t <= splat4(t_max))))
        put(lanes.doubts, k, dues)
        hits = 4 * BLOCK_FACES * k
        store(lanes.hits, hits, t)
        store(lanes.hits, hits + BLOCK_FACES, edges.e1)
        store(lanes.hits, hits + 2 * BLOCK_FACES, edges.e2)
        store(lanes.hits, hits + 3 * BLOCK_FACES, edges.determinant)


@inlined
def take_hits(tree, rays, lanes, k):
    """Keep the best hit of the first block that the ``k``-th ray at a leaf met, and whether one was in doubt.

    Returns whether there is a hit.
    """
    r, bits, hits = get(lanes.at_leaf, k), get(lanes.bits, k), at(lanes.hits, 4 * BLOCK_FACES * k)
    put(rays.integers, DOUBTFUL + r, get(rays.integers, DOUBTFUL + r) | get(lanes.doubts, k))
    if bits == 0:
        return False
    block = ~get(rays.integers, CHILD + r) >> LEAF_BITS
    t, face, u, v, w = best_of(rays, r)
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        ti, fi = get(hits, i), get(tree.faces, block * BLOCK_FACES + i)
        # rule: tie-in-streams
        if ti < t or (ti == t and fi < face):
            t, face = ti, fi
            u, v, w = get(hits, BLOCK_FACES + i), get(hits, 2 * BLOCK_FACES + i), get(hits, 3 * BLOCK_FACES + i)
    put_best(rays, r, (t, face, u, v, w))
    put(rays.floats, LIMIT + r, box_limit(t, get(rays.doubles, LARGEST + r)))
    return True


@inlined
def leave_leaf(tree, rays, lanes, r):
    """Choose the next child of ray ``r`` at a leaf: the rest of its blocks, else one off its stack. Returns it."""
    child = get(rays.integers, CHILD + r)
    # rule: rest-of-leaf
    if ~child & (MAX_LEAF_BLOCKS - 1) != 0:
        # The first block is one further on, and the number of blocks one less.
        child -= MAX_LEAF_BLOCKS - 1
        put(rays.integers, CHILD + r, child)
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
