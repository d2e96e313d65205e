"""Closest and any hits of a range of rays: coherent sixteens as packets, others as a stream, doubts settled singly."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import at, get, lowest_bit, pointer, put, smaller
from renderer.trace.intersect import largest_of, make_shear
from renderer.trace.layout import cache_aligned
from renderer.trace.leaf import NO_FACE, search_all_blocks, tree_pointers
from renderer.trace.packet import child_of, meet_octant, trace_packet
from renderer.trace.ray_lanes import (
    DIRECTION_Z,
    DOUBTFUL,
    LARGEST,
    NUMBER,
    SIXTEEN,
    SLACK,
    WIDTH,
    Prepared,
    best_of,
    prepare_eight,
)
from renderer.trace.rays import first_bad_ray, hit_pointers, ray_at, ray_pointers
from renderer.trace.single import search_carefully, stack_size, write_best
from renderer.trace.starts.cone import HOLDERS_WORDS
from renderer.trace.starts.record import EDGE
from renderer.trace.stream import (
    END,
    ENOUGH,
    LANE_DOUBLES,
    LANE_INTEGERS,
    SIXTEENS,
    Lanes,
    begin_ray,
    begin_rays,
    clear_lanes,
    end_ray,
    leave_leaf,
    list_lane,
    make_lanes,
    meet_leaves,
    meet_nodes,
    resume,
    stack_of,
    take_hits,
    wait_octant,
)

# Sixteen rays are no packet when a slope against their dominant axis differs by more than this from the first ray's.
# The bound only spares scattered rays the attempt; a packet whose rays part later ends by its BUDGET.
_SPREAD = 0.125
# The rounds of lanes in a call, beside those of the rays under way then: some 10 ms, so that Ctrl-C need not wait for
# long. A chunk of rays takes fewer on most meshes, and is not cut.
_WORK = 1 << 14


class Scratch(NamedTuple):
    """Memory of one thread, as pointers: prepared rays, of which a packet takes the first sixteen; a stream's lanes; a
    packet's stack; the numbers of the rays that wait for a stream; and room for the faces that hold a start.
    """

    prepared: Prepared
    lanes: Lanes
    packet_stack: Any
    waiting: Any
    holders: Any


class Memory(NamedTuple):
    """The arrays behind a ``Scratch``, and the number of entries of one stack."""

    floats: NDArray[np.float32]
    doubles: NDArray[np.float64]
    integers: NDArray[np.int64]
    holders: NDArray[np.int64]
    stack_size: int


def make_memory(depth: int, rays: int) -> Memory:
    """Memory for ranges of up to ``rays`` rays against a tree of ``depth`` levels."""
    size, prepared = stack_size(depth), SIXTEENS * SIXTEEN
    integers = prepared + LANE_INTEGERS + (SIXTEENS * WIDTH + 1) * size + rays + WIDTH
    return Memory(
        cache_aligned(prepared, np.float32),
        cache_aligned(prepared + LANE_DOUBLES, np.float64),
        cache_aligned(integers, np.int64),
        np.empty(HOLDERS_WORDS, np.int64),
        size,
    )


@inlined
def make_scratch(memory):
    """Pointers into a ``Memory``."""
    floats, doubles, integers = pointer(memory.floats), pointer(memory.doubles), pointer(memory.integers)
    size, lane_integers = memory.stack_size, at(integers, SIXTEENS * SIXTEEN)
    lanes = make_lanes(lane_integers, at(doubles, SIXTEENS * SIXTEEN), size)
    packet_stack = at(lane_integers, LANE_INTEGERS + SIXTEENS * WIDTH * size)
    return Scratch(
        Prepared(floats, doubles, integers), lanes, packet_stack, at(packet_stack, size), pointer(memory.holders)
    )


@kernel
def are_coherent(rays, begin):
    """Whether the sixteen rays from ``begin`` on share their dominant axis, its sign and nearly their slopes."""
    d, step = at(rays.directions, begin * rays.direction_step), rays.direction_step
    ax, ay, az = abs(get(d, 0)), abs(get(d, 1)), abs(get(d, 2))
    w = 2 if az >= ax and az >= ay else (1 if ay >= ax else 0)
    u, v = (w + 1) % 3, (w + 2) % 3
    first = get(d, w)
    slope_u, slope_v = get(d, u) / first, get(d, v) / first
    for r in range(1, WIDTH):
        dw, du, dv = get(d, step * r + w), get(d, step * r + u), get(d, step * r + v)
        size = abs(dw)
        # Strictly larger: between equal components the choice of ``make_shear`` depends on which they are.
        dominant = size > abs(du) and size > abs(dv) and dw * first > 0.0
        if not (dominant and abs(du - slope_u * dw) <= _SPREAD * size and abs(dv - slope_v * dw) <= _SPREAD * size):
            return False
    size = abs(first)
    return size > abs(get(d, u)) and size > abs(get(d, v))


@inlined
def _finish(tree, rays, found, scratch, r, any_hit):
    """Write the hit of the ray in lane ``r``; if one was in doubt, after a careful search on the ray's stack.

    Returns the rounds of lanes that take as long as that search.
    """
    best, (_, doubles, integers), steps = best_of(scratch.prepared, r), scratch.prepared, np.int64(0)
    i, slack = get(integers, NUMBER + r), get(doubles, SLACK + r)
    # rule: resolve-uncertain
    if get(integers, DOUBTFUL + r) != 0 or slack == EDGE:
        best, steps = search_carefully(
            tree, rays, i, at(scratch.lanes.stacks, stack_of(scratch.lanes, r)), scratch.holders, any_hit
        )
    start = slack, get(doubles, LARGEST + r)
    write_best(tree, rays, found, i, best, start, get(doubles, DIRECTION_Z + r), any_hit)
    return steps // ENOUGH


@kernel
def _run_lanes(tree, rays, found, scratch, lists, waiting, any_hit):
    """Run the rays in ``lists``, see ``list_lane``, to their ends, and those of ``waiting``, see ``begin_rays``; but
    none of these begins after _WORK.

    Returns the first ray that still waits, and the number of rounds.
    """
    prepared, lanes, rounds = scratch.prepared, scratch.lanes, np.int64(0)
    nodes, leaves, ends = lists
    numbers, following, count = waiting
    while True:
        if following < count and rounds <= _WORK:
            following, nodes = begin_rays(rays, prepared, lanes, (numbers, following, count), (nodes, leaves))
        if nodes + leaves + ends == 0:
            return following, rounds
        rounds += 1
        # Take the rays at nodes one step on.
        meet_nodes(tree, prepared, lanes, nodes)
        entered, nodes = nodes, 0
        for k in range(entered):
            r = get(lanes.at_node, k)
            nodes, leaves, ends = list_lane(lanes, r, resume(tree, prepared, lanes, r), (nodes, leaves, ends))
        # Take the rays at leaves one block on.
        meet_leaves(tree, prepared, lanes, leaves)
        entered, leaves = leaves, 0
        for k in range(entered):
            r, hit = get(lanes.at_leaf, k), take_hits(tree, prepared, lanes, k)
            child = END if any_hit and hit else leave_leaf(tree, prepared, lanes, r)
            nodes, leaves, ends = list_lane(lanes, r, child, (nodes, leaves, ends))
        for k in range(ends):
            r = get(lanes.at_end, k)
            rounds += _finish(tree, rays, found, scratch, r, any_hit)
            end_ray(lanes, r)
        ends = 0


@inlined
def _trace_stream(tree, rays, found, scratch, following, count, any_hit):
    """Trace the rays in ``scratch.waiting`` from ``following`` to ``count``; returns the first that still waits."""
    clear_lanes(scratch.lanes)
    for k in range(count, count + WIDTH):
        put(scratch.waiting, k, get(scratch.waiting, count - 1))
    return _run_lanes(tree, rays, found, scratch, (0, 0, 0), (scratch.waiting, following, count), any_hit)[0]


@kernel
def _hand_over(tree, rays, found, scratch, top, doubtful, any_hit):
    """Let the rays of a packet that gave up go on as lanes, each with those of the waiting octants that it meets.

    Returns the number of rounds.
    """
    prepared, lanes = scratch.prepared, scratch.lanes
    for r in range(WIDTH):
        begin_ray(prepared, lanes, r, get(prepared.integers, NUMBER + r))
        put(prepared.integers, DOUBTFUL + r, (doubtful >> r) & 1)
    for k in range(top):
        entry = get(scratch.packet_stack, k)
        child, at_ = child_of(tree, entry & 0xFFFFFFFF)
        meeting = meet_octant(tree, prepared, at_)
        while meeting != 0:
            wait_octant(prepared, lanes, lowest_bit(meeting), entry, child)
            meeting &= meeting - 1
    lists = 0, 0, 0
    for r in range(WIDTH):
        if any_hit and best_of(prepared, r)[1] != NO_FACE:
            put(prepared.integers, DOUBTFUL + r, 0)
            _finish(tree, rays, found, scratch, r, any_hit)
        else:
            lists = list_lane(lanes, r, resume(tree, prepared, lanes, r), lists)
    return _run_lanes(tree, rays, found, scratch, lists, (scratch.waiting, 0, 0), any_hit)[1]


@inlined
def _trace_sixteen(tree, rays, found, first, scratch, any_hit):
    """Trace the rays from ``first`` on as a packet, and as lanes from where it gave up; returns the rounds of lanes."""
    prepared, rounds, numbers = scratch.prepared, np.int64(0), at(scratch.prepared.integers, NUMBER)
    for r in range(WIDTH):
        put(numbers, r, first + r)
    for half in range(0, WIDTH, 8):
        prepare_eight(rays, prepared, half, at(numbers, half))
    top, doubtful = trace_packet(tree, prepared, scratch.packet_stack, any_hit)
    if top > 0:
        return _hand_over(tree, rays, found, scratch, top, doubtful, any_hit)
    for r in range(WIDTH):
        put(prepared.integers, DOUBTFUL + r, (doubtful >> r) & 1)
        rounds += _finish(tree, rays, found, scratch, r, any_hit)
    return rounds


@kernel
def search_blocks(tree, rays, found, begin, end, holders, any_hit):
    """``trace`` for a tree without nodes: every ray against every block; ``holders`` is ``Scratch.holders``."""
    for i in range(begin, end):
        ray, t_max = ray_at(rays, i)
        best, doubtful = (t_max, np.int32(NO_FACE), 0.0, 0.0, 1.0), True
        if ray.slack != EDGE:
            best, doubtful = search_all_blocks(tree, ray, t_max, any_hit)
        if doubtful:
            best, _ = search_carefully(tree, rays, i, holders, holders, any_hit)
        start = ray.slack, largest_of(ray)
        write_best(tree, rays, found, i, best, start, make_shear(ray).direction_z, any_hit)


@kernel
def trace(tree, rays, found, begin, end, scratch, any_hit):
    """Closest hits, or with ``any_hit`` whether there is one, of the rays from ``begin`` to ``end``.

    The interval [t_min, t_max] is closed; t counts in units of |direction|; no face is culled. Among equal t the lowest
    face wins: a node is left behind only when its entry is beyond the best t, never at it, so the answer depends
    neither on the order of the visits nor on the rays that travel together. Watertight and deterministic (Woop et al.
    2013); see ``intersect`` for the bounds.
    """
    state = begin, np.int64(0), np.int64(0)
    while state[0] < end or state[1] < state[2]:
        state = _trace_on(tree, rays, found, state, end, scratch, any_hit)


@kernel
def _trace_on(tree, rays, found, state, end, scratch, any_hit):
    """``trace`` of some rays more. ``state`` is the first ray that no packet was asked for, and of the rays in
    ``scratch.waiting`` the first that no stream took, and their number. Returns the state after it.
    """
    begin, following, count = state
    rounds = np.int64(0)
    for first in range(begin, end, WIDTH):
        if first + WIDTH <= end and are_coherent(rays, first):
            rounds += _trace_sixteen(tree, rays, found, first, scratch, any_hit)
            if rounds > _WORK:
                return first + WIDTH, following, count
            continue
        for i in range(first, smaller(first + WIDTH, end)):
            put(scratch.waiting, count, i)
            count += 1
    if following < count:
        following = _trace_stream(tree, rays, found, scratch, following, count, any_hit)
    return end, following, count


@kernel
def trace_chunk(words, rays, out, state, end, any_hit, memory):
    """Hits of rays up to ``end`` into ``out``: rows t, u, v, face and side, or with ``any_hit`` bools.

    ``words`` are the tree's, which must have nodes. ``state`` is (begin, 0, 0) in the first call for a chunk, and later
    what the last one returned first, with the same memory: it ends early where much was to do, and all is done at
    (end, n, n). Also returns the row of the first ray out of range, for which nothing is traced, or -1.
    """
    tree = tree_pointers(words)
    source, found = ray_pointers(rays, tree.scale), hit_pointers(out, out.shape[1])
    bad = first_bad_ray(source, state[0], end)
    if bad < 0:
        state = _trace_on(tree, source, found, state, end, make_scratch(memory), any_hit)
    return state, bad


@kernel
def search_chunk(words, rays, out, begin, end, any_hit, holders):
    """Hits of the rays begin:end, as ``trace_chunk`` writes them, for a tree without nodes; returns the row or -1."""
    tree = tree_pointers(words)
    source, found = ray_pointers(rays, tree.scale), hit_pointers(out, out.shape[1])
    bad = first_bad_ray(source, begin, end)
    if bad < 0:
        search_blocks(tree, source, found, begin, end, pointer(holders), any_hit)
    return bad
