"""Incoherent rays traverse the tree, up to forty at a time; eight more begin where there is room.

The processor cannot predict whether a ray goes to a node, goes to a leaf, or ends, and a mispredicted branch discards
all work begun after it. So each round first computes the boxes or triangles that every ray hits, without a branch, and
then decides. By then the results are there, so a misprediction costs little. Meanwhile memory loads the records of the
next round.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.kinds import of_none
from renderer.numerics.simd import (
    count_bits,
    counting8,
    load,
    load4,
    load8,
    lowest_bit,
    minimum,
    movemask,
    offset,
    permuted,
    prefetch,
    set_first,
    splat8,
    store,
)
from renderer.trace.best import NO_FACE, Best
from renderer.trace.intersect import bits_within, box_limit, face_in, meet_boxes, meet_planes, order_for, see_triangles
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CACHE_LINE, CHILDREN, MAX_LEAF_BLOCKS, NODE_WORDS
from renderer.trace.leaf import is_any_admitted
from renderer.trace.ray_lanes import (
    CHILD,
    DIRECTION_Z,
    LARGEST,
    LIMIT,
    LOWER,
    NUMBER,
    T_MIN,
    TOP,
    UNRESOLVED,
    WIDTH,
    T,
    best_of,
    lane_index,
    lane_of,
    prepare_eight,
    put_any,
    put_best,
    shear_of,
    slabs_of,
)
from renderer.trace.root import enter_root, root_box
from renderer.trace.walk import entered_in_order, first_block

# The child at the bottom of each ray's stack, the code of no leaf. Its distance is that of no octant: beyond no limit,
# not even beyond NaN, so no ray goes below its stack.
END = -(1 << 31)
NO_DISTANCE = np.float32(-np.inf)
_LINE = CACHE_LINE // 4


@inlined
def prefetch_node(nodes, node):
    """Prefetch the record of a node."""
    for line in range(NODE_WORDS // _LINE):
        prefetch(nodes, node * NODE_WORDS + line * _LINE)


@inlined
def prefetch_block(blocks, block, wide):
    """Prefetch a block, of float64 where ``wide`` is 1."""
    # A float64 block is twice as long: prefetch every second line; the hardware fetches the next.
    for line in range(3):
        prefetch(blocks, (block * BLOCK_WORDS + line * _LINE) << wide)


class Lanes(NamedTuple):
    """Rays under way, as pointers.

    distances, children       the stacks of all lanes: children, and where searches for closest hits enter their boxes
    stack_size                the entries of one stack
    at_node, at_leaf, at_end  lists of the lanes of rays at a node, at a leaf and at END
    bits, must_resolve, hits  of a round, for each ray in the list of leaves: the bits of the triangles hit, of those
                              uncertain that must be resolved, and t, u, v and w
    left                      of each eight lanes the number of rays under way; in the last word the bits of the eights
                              that are free: eight lanes are taken together
    """

    distances: Any
    children: Any
    stack_size: int
    at_node: Any
    at_leaf: Any
    at_end: Any
    bits: Any
    must_resolve: Any
    hits: Any
    left: Any


class LaneCounts(NamedTuple):
    """The lengths of the lists of lanes at a node, at a leaf and at END."""

    nodes: int
    leaves: int
    ends: int


class Queue(NamedTuple):
    """Rays that wait for lanes: their numbers, with seven more that may be read; the first that has not begun; their
    count.
    """

    numbers: Any
    following: int
    count: int  # type: ignore[assignment]  # tuples have a method of that name


# The lanes. Eight are free again when all their rays have ended, so there are more lanes than rays under way. Eight
# more begin where no more than MIN_ACTIVE are. With 32 instead of 16, random rays take 5 % less time on a mesh of 1e5
# faces, 10 % on one of 1e6 and 14 % on one of 5e6; with 48 or 64, within 5 % of that.
GROUPS = 8
HALF_GROUPS, _LANES = 2 * GROUPS, GROUPS * WIDTH
MIN_ACTIVE = 2 * WIDTH
# The numbers of int64 (without the stacks) and float64 in ``Lanes``.
LANE_INTEGERS, LANE_DOUBLES = 5 * _LANES + HALF_GROUPS + 1, 4 * BLOCK_FACES * _LANES


@inlined
def make_lanes(integers, doubles, distances, children, stack_size):
    """Lanes in the given memory."""
    return Lanes(
        distances, children, stack_size, integers, offset(integers, _LANES), offset(integers, 2 * _LANES),
        offset(integers, 3 * _LANES), offset(integers, 4 * _LANES), doubles, offset(integers, 5 * _LANES),
    )  # fmt: skip


@inlined
def clear_lanes(lanes, rays):
    """Free all lanes, of which so many rays will take some."""
    store(lanes.left, HALF_GROUPS, (1 << HALF_GROUPS) - 1)
    end_stacks(lanes, minimum(rays + 7, _LANES))


@inlined
def end_stacks(lanes, count):
    """Write the bottoms of the stacks of the first lanes, ``count`` of them."""
    for bottom in range(0, count * lanes.stack_size, lanes.stack_size):
        store(lanes.distances, bottom, NO_DISTANCE)
        store(lanes.children, bottom, np.int32(END))


@inlined
def begin_rays(tree, rays, prepared, lanes, queue, counts, box):
    """Begin rays of a queue, eight at a time, while few are under way and lanes are free.

    A ray that enters no octant of the root, whose box is ``box``, does not begin: it hits nothing, and has no start
    that ``finish`` would have to examine.

    Returns the first ray that still waits, and the ``LaneCounts``.
    """
    following, nodes = queue.following, counts.nodes
    while following < queue.count and nodes + counts.leaves <= MIN_ACTIVE and load(lanes.left, HALF_GROUPS) != 0:
        free = load(lanes.left, HALF_GROUPS)
        half = lowest_bit(free)
        some, r = minimum(queue.count - following, 8), lane_of(half >> 1, 8 * (half & 1))
        numbers = offset(queue.numbers, following)
        prepare_eight(rays, prepared, r, numbers)
        following += some
        entering = of_none(prepared.starts, enter_root, _all_enter)(tree, box, prepared, r) & (1 << some) - 1
        if entering == 0:
            continue
        begin_eight(tree, rays, prepared, lanes, r, numbers, some)
        store(lanes.left, HALF_GROUPS, free & (free - 1))
        store(lanes.left, half, count_bits(entering))
        nodes = _list_entering(lanes, r, entering, nodes)
    return following, LaneCounts(nodes, counts.leaves, counts.ends)


@inlined
def _all_enter(tree, box, prepared, r):
    """The bits of eight rays that start on the surface: most are in the root, and one may start on an edge."""
    return np.int64(0xFF)


@inlined
def _list_entering(lanes, r, entering, nodes):
    """Append those of the eight lanes from ``r`` on to the list of nodes that enter the root. Returns its length."""
    if entering == 0xFF:
        store(lanes.at_node, nodes, counting8(r, 1))
        return nodes + 8
    for k in range(8):
        # No branch: each lane is written, and the length grows with those that enter.
        store(lanes.at_node, nodes, r + k)
        nodes += entering >> k & 1
    return nodes


@inlined
def begin_eight(tree, rays, prepared, lanes, r, numbers, count):
    """Start the first ``count`` of eight prepared rays, numbered at ``numbers``, in the lanes from ``r`` on at the
    root.
    """
    integers, none = prepared.integers, counting8(0, 0)
    store(integers, CHILD + r, none)
    store(integers, TOP + r, counting8(lane_index(r) * lanes.stack_size + 1, lanes.stack_size))
    store(integers, NUMBER + r, load8(numbers, 0))
    store(integers, UNRESOLVED + r, none)
    for k in range(count):
        tree.ways.begin(tree, rays, prepared, r + k, load(numbers, k))


@inlined
def end_ray(lanes, r):
    """Count a ray as ended; the last of eight frees their lanes."""
    half = lane_index(r) // 8
    left = load(lanes.left, half) - 1
    store(lanes.left, half, left)
    store(lanes.left, HALF_GROUPS, load(lanes.left, HALF_GROUPS) | (np.int64(left == 0) << half))


@inlined
def wait_octant(prepared, lanes, r, distance, child):
    """Push an octant onto the stack of ray ``r``."""
    top = load(prepared.integers, TOP + r)
    store(lanes.distances, top, distance)
    store(lanes.children, top, np.int32(child))
    store(prepared.integers, TOP + r, top + 1)


@inlined
def _push_in_order(lanes, top, meets, distances, links, base, slabs):
    """Push the octants that a ray enters, the nearest last. Returns how many."""
    octants, bits = entered_in_order(meets, order_for(links, base, slabs))
    store(lanes.distances, top, permuted(distances, octants))
    store(lanes.children, top, permuted(load8(links, base + CHILDREN), octants))
    return count_bits(bits)


@inlined
def _push_children(lanes, top, meets, distances, links, base, slabs):
    """``_push_in_order`` for queries that need not come to near octants first: in any order, without distances."""
    bits = movemask(meets)
    store(lanes.children, top, permuted(load8(links, base + CHILDREN), set_first(bits)))
    return count_bits(bits)


@inlined
def meet_nodes(tree, rays, lanes, count, any_hit):
    """For each of ``count`` rays, push the octants of its node that it enters; in any order unless ``any_hit`` is None.

    No branch: all eight are written, and the top moves by the number entered.
    """
    push = of_none(any_hit, _push_in_order, _push_children)
    for k in range(count):
        r = load(lanes.at_node, k)
        top, (nodes, links, base) = load(rays.integers, TOP + r), tree.ways.node_of(tree, rays, r)
        lower, upper = splat8(load(rays.floats, LOWER + r)), splat8(load(rays.floats, LIMIT + r))
        slabs = slabs_of(rays, r)
        t0, meets = meet_boxes(nodes, base, slabs, lower, upper)
        store(rays.integers, TOP + r, top + push(lanes, top, meets, t0, links, base, slabs))


@inlined
def begin_in_tree(tree, rays, prepared, r, number):
    """``Ways.begin`` of a mesh."""


@inlined
def node_in_tree(tree, prepared, r):
    """``Ways.node_of`` a mesh."""
    return tree.nodes, tree.links, load(prepared.integers, CHILD + r) * NODE_WORDS


@inlined
def resume(tree, rays, prepared, lanes, r, any_hit):
    """Pop the next child of ray ``r`` that is not beyond its best hit, and return it; the topmost unless ``any_hit`` is
    None.
    """
    return tree.ways.resume(tree, rays, prepared, lanes, r, any_hit)


@inlined
def topmost_within(lanes, top, limit, any_hit):
    """The place of the topmost entry below ``top`` that is not beyond a limit; the topmost unless ``any_hit`` is None,
    as entries have no distances then.
    """
    top -= 1
    if any_hit is None:
        while load(lanes.distances, top) > limit:
            top -= 1
    return top


@inlined
def resume_in_tree(tree, sources, rays, lanes, r, any_hit):
    """``resume`` in a mesh."""
    # rule: resume-limit
    limit, top = load(rays.floats, LIMIT + r), load(rays.integers, TOP + r)
    top = topmost_within(lanes, top, limit, any_hit)
    child = np.int64(load(lanes.children, top))
    store(rays.integers, CHILD + r, child)
    store(rays.integers, TOP + r, top)
    if child >= 0:
        prefetch_node(tree.nodes, child)
    else:
        prefetch_block(tree.blocks, first_block(child), tree.wide)
        if any_hit is None:
            prefetch(tree.faces, first_block(child) * BLOCK_FACES)
    return child


@inlined
def meet_leaves(tree, rays, lanes, count, any_hit):
    """Compute the hits of each of ``count`` rays in the first block of its leaf; unless ``any_hit`` is None, only what
    ``take_any`` reads.
    """
    for k in range(count):
        r = load(lanes.at_leaf, k)
        base, shear = first_block(load(rays.integers, CHILD + r)) * BLOCK_WORDS, shear_of(rays, r)
        edges, seen = see_triangles(tree, base, shear)
        t_min, t_max = load(rays.doubles, T_MIN + r), load(rays.doubles, T + r)
        planes = meet_planes(tree, base, edges, seen, shear, t_min, t_max)
        store(lanes.bits, k, seen & ~planes.uncertain & bits_within(planes.t, t_min, t_max))
        store(lanes.must_resolve, k, planes.must_resolve)
        hits = offset(lanes.hits, 4 * BLOCK_FACES * k)
        if any_hit is None:
            store(hits, 0, planes.t)
            store(hits, BLOCK_FACES, edges.e1)
            store(hits, 2 * BLOCK_FACES, edges.e2)
        store(hits, 3 * BLOCK_FACES, edges.determinant)


@inlined
def take_hits(tree, rays, lanes, k):
    """Keep the best hit of the ``k``-th ray at a leaf in its first block, and whether one must be resolved.

    Returns whether there is a hit.
    """
    r, bits, hits = load(lanes.at_leaf, k), load(lanes.bits, k), offset(lanes.hits, 4 * BLOCK_FACES * k)
    store(rays.integers, UNRESOLVED + r, load(rays.integers, UNRESOLVED + r) | load(lanes.must_resolve, k))
    if bits == 0:
        return False
    block, best = first_block(load(rays.integers, CHILD + r)), best_of(rays, r)
    t, face, u, v, w = best.t, best.face, best.u, best.v, best.w
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        ti, fi, wi = load(hits, i), face_in(tree, block * BLOCK_FACES + i), load(hits, 3 * BLOCK_FACES + i)
        # rule: tie-in-streams
        if (ti < t or (ti == t and fi < face)) and tree.ways.admits(tree, wi, load(rays.doubles, DIRECTION_Z + r)):
            t, face = ti, fi
            u, v, w = load(hits, BLOCK_FACES + i), load(hits, 2 * BLOCK_FACES + i), wi
    put_best(rays, r, Best(t, face, u, v, w))
    store(rays.floats, LIMIT + r, box_limit(t, load(rays.doubles, LARGEST + r)))
    return face != NO_FACE


@inlined
def take_any(tree, rays, lanes, k):
    """``take_hits`` for any hit, of which only that there is one is kept."""
    r, bits = load(lanes.at_leaf, k), load(lanes.bits, k)
    store(rays.integers, UNRESOLVED + r, load(rays.integers, UNRESOLVED + r) | load(lanes.must_resolve, k))
    w = load4(lanes.hits, 4 * BLOCK_FACES * k + 3 * BLOCK_FACES)
    hit = is_any_admitted(tree, bits, w, load(rays.doubles, DIRECTION_Z + r))
    if hit:
        put_any(rays, r)
    return hit


@inlined
def leave_leaf(tree, sources, rays, lanes, r, any_hit):
    """Choose the next child of ray ``r`` at a leaf: the rest of its blocks, else one from its stack. Returns it."""
    child = load(rays.integers, CHILD + r)
    # rule: rest-of-leaf
    if ~child & (MAX_LEAF_BLOCKS - 1) != 0:
        # The first block is one further on, and the number of blocks one less.
        child -= MAX_LEAF_BLOCKS - 1
        store(rays.integers, CHILD + r, child)
        return child
    return resume(tree, sources, rays, lanes, r, any_hit)


@inlined
def list_lane(lanes, r, child, counts):
    """Append lane ``r`` to the list of nodes, leaves or ends, by its next child. Returns the ``LaneCounts``."""
    nodes, leaves, ends = counts.nodes, counts.leaves, counts.ends
    # ``resume`` has branched here too, and LLVM makes one branch of both.
    if child >= 0:
        store(lanes.at_node, nodes, r)
        return LaneCounts(nodes + 1, leaves, ends)
    # No branch: the lane is written to both.
    store(lanes.at_leaf, leaves, r)
    store(lanes.at_end, ends, r)
    at_end = np.int64(child == END)
    return LaneCounts(nodes, leaves + (1 - at_end), ends + at_end)


@inlined
def run_lanes(tree, rays, prepared, lanes, counts, queue, most_rounds, query, any_hit, meet, take, finish):
    """Trace the rays in lanes and those of a queue to their ends; none of the queue begins after ``most_rounds``
    rounds.

    query   what the three kernels read
    any_hit as of ``meet_nodes``
    meet    meet(tree, query, lanes, count): compute the hits of each ray at a leaf in the first block of its leaf
    take    take(tree, query, k): take the hits of the k-th of them; returns whether the ray ends
    finish  finish(tree, query, r): finish the ray in lane r; returns the rounds that it took

    Returns the first ray that still waits, and the number of rounds.
    """
    rounds, following, box = np.int64(0), queue.following, root_box(tree)
    while True:
        if following < queue.count and rounds <= most_rounds:
            waiting = Queue(queue.numbers, following, queue.count)
            following, counts = begin_rays(tree, rays, prepared, lanes, waiting, counts, box)
        if counts.nodes + counts.leaves + counts.ends == 0:
            return following, rounds
        rounds += 1
        # Take the rays at nodes one step on.
        entered, counts = counts.nodes, LaneCounts(np.int64(0), counts.leaves, counts.ends)
        meet_nodes(tree, prepared, lanes, entered, any_hit)
        for k in range(entered):
            r = load(lanes.at_node, k)
            counts = list_lane(lanes, r, resume(tree, rays, prepared, lanes, r, any_hit), counts)
        # Take the rays at leaves one block on.
        entered, counts = counts.leaves, LaneCounts(counts.nodes, np.int64(0), counts.ends)
        meet(tree, query, lanes, entered)
        for k in range(entered):
            r, ends = load(lanes.at_leaf, k), take(tree, query, k)
            counts = list_lane(lanes, r, END if ends else leave_leaf(tree, rays, prepared, lanes, r, any_hit), counts)
        for k in range(counts.ends):
            r = load(lanes.at_end, k)
            rounds += finish(tree, query, r)
            end_ray(lanes, r)
        counts = LaneCounts(counts.nodes, counts.leaves, np.int64(0))
