"""Closest and any hits of a range of rays: coherent sixteens as packets, others as a stream, doubts settled singly."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.simd import at, get, lowest_bit, pointer, put, smaller
from renderer.trace.layout import cache_aligned
from renderer.trace.leaf import NO_FACE, search_all_blocks, tree_pointers
from renderer.trace.packet import child_of, meet_octant, trace_packet
from renderer.trace.ray_lanes import DOUBLES, FLOATS, INTEGERS, WIDTH, Prepared, best_of, copy_ray, prepare_sixteen
from renderer.trace.rays import first_bad_ray, hit_pointers, ray_at, ray_pointers, write_hit
from renderer.trace.singly import search_singly, stack_size
from renderer.trace.stream import (
    END,
    LANE_DOUBLES,
    LANE_INTEGERS,
    Lanes,
    begin_ray,
    leave_leaf,
    list_lane,
    make_lanes,
    meet_leaves,
    meet_nodes,
    resume,
    take_hits,
    wait_octant,
)

# Sixteen rays are no packet when a slope against their dominant axis differs by more than this from the first ray's.
# The bound only spares scattered rays the attempt; a packet whose rays part later ends by its BUDGET.
_SPREAD = 0.125
# The rounds of lanes in a call, beside those of the rays under way then: some 10 ms, so that Ctrl-C need not wait for
# long. A chunk of rays takes fewer on most meshes, and is not cut.
_WORK = 1 << 15


class Scratch(NamedTuple):
    """Memory of one thread, as pointers: sixteen prepared rays and their lanes; sixteen more, ready for lanes that end;
    a packet's stack; for each of the rays whether a hit was in doubt, and its number; and the numbers of the rays that
    wait for a stream.
    """

    prepared: Prepared
    ready: Prepared
    lanes: Lanes
    packet_stack: Any
    doubtful: Any
    number: Any
    waiting: Any


class Memory(NamedTuple):
    """The arrays behind a ``Scratch``, and the number of entries of one stack."""

    floats: NDArray[np.float32]
    doubles: NDArray[np.float64]
    integers: NDArray[np.int64]
    stack_size: int


def make_memory(depth: int, rays: int) -> Memory:
    """Memory for ranges of up to ``rays`` rays against a tree of ``depth`` levels."""
    size = stack_size(depth)
    integers = 2 * INTEGERS + 2 * WIDTH + LANE_INTEGERS + (WIDTH + 1) * size + rays + WIDTH
    return Memory(
        cache_aligned(2 * FLOATS, np.float32),
        cache_aligned(2 * DOUBLES + LANE_DOUBLES, np.float64),
        cache_aligned(integers, np.int64),
        size,
    )


@inlined
def make_scratch(memory):
    """Pointers into a ``Memory``."""
    floats, doubles, integers = pointer(memory.floats), pointer(memory.doubles), pointer(memory.integers)
    prepared = Prepared(floats, doubles, integers)
    ready = Prepared(at(floats, FLOATS), at(doubles, DOUBLES), at(integers, INTEGERS))
    doubtful = at(integers, 2 * INTEGERS)
    number = at(doubtful, WIDTH)
    lane_integers = at(number, WIDTH)
    size = memory.stack_size
    lanes = make_lanes(lane_integers, at(doubles, 2 * DOUBLES), size)
    packet_stack = at(lane_integers, LANE_INTEGERS + WIDTH * size)
    waiting = at(packet_stack, size)
    return Scratch(prepared, ready, lanes, packet_stack, doubtful, number, waiting)


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
def _finish(tree, rays, found, i, scratch, r, doubtful, any_hit):
    """Write the hit of ray ``i``, in lane ``r``; if one was in doubt, after a careful search on the lane's stack.

    Returns the rounds of sixteen lanes that take as long as that search.
    """
    best, steps = best_of(scratch.prepared, r), np.int64(0)
    if doubtful:
        ray, t_max = ray_at(rays, i)
        best, steps = search_singly(tree, ray, t_max, at(scratch.lanes.stacks, r * scratch.lanes.stack_size))
    write_hit(found, i, rays.scale, best, any_hit)
    return steps // WIDTH


@kernel
def begin_lanes(rays, scratch, numbers, following, count):
    """Let the rays whose numbers stand at ``numbers`` from ``following`` to ``count`` begin, as many as there are
    lanes. Returns how many. There is room for sixteen numbers more.
    """
    for k in range(count, count + WIDTH):
        put(numbers, k, get(numbers, count - 1))
    if following % WIDTH != 0:
        prepare_sixteen(rays, scratch.ready, at(numbers, following - following % WIDTH))
    lanes = smaller(count - following, WIDTH)
    for r in range(lanes):
        load_lane(rays, scratch, r, numbers, following + r)
        put(scratch.lanes.at_node, r, r)
    return lanes


@inlined
def load_lane(rays, scratch, r, numbers, k):
    """Let the ray whose number is the k-th of ``numbers`` begin in lane ``r``. Every sixteenth makes sixteen ready."""
    if k % WIDTH == 0:
        prepare_sixteen(rays, scratch.ready, at(numbers, k))
    copy_ray(scratch.ready, k % WIDTH, scratch.prepared, r)
    begin_ray(scratch.lanes, r)
    put(scratch.number, r, get(numbers, k))
    put(scratch.doubtful, r, 0)


@kernel
def _run_lanes(tree, rays, found, scratch, lists, waiting, any_hit):
    """Run the lanes in ``lists``, see ``list_lane``, to their ends; the rays in ``scratch.waiting`` from waiting[0] to
    waiting[1] take the places of those that end, but none does after _WORK.

    Returns the first ray that still waits, and the number of rounds.
    """
    prepared, lanes, rounds = scratch.prepared, scratch.lanes, np.int64(0)
    nodes, leaves, ends = lists
    following, count = waiting
    while nodes + leaves + ends > 0:
        rounds += 1
        # Take the lanes at nodes one step on.
        meet_nodes(tree, prepared, lanes, nodes)
        entered, nodes = nodes, 0
        for k in range(entered):
            r = get(lanes.at_node, k)
            child = resume(tree, prepared, lanes, r)
            nodes, leaves, ends = list_lane(lanes, r, child, (nodes, leaves, ends))
        # Take the lanes at leaves one block on.
        meet_leaves(tree, prepared, lanes, leaves)
        entered, leaves = leaves, 0
        for k in range(entered):
            r = get(lanes.at_leaf, k)
            hit, doubtful = take_hits(tree, prepared, lanes, r)
            put(scratch.doubtful, r, get(scratch.doubtful, r) | np.int64(doubtful))
            child = END if any_hit and hit else leave_leaf(tree, prepared, lanes, r)
            nodes, leaves, ends = list_lane(lanes, r, child, (nodes, leaves, ends))
        # Load the next rays into the lanes of those that ended.
        for k in range(ends):
            r = get(lanes.at_end, k)
            i, doubtful = get(scratch.number, r), get(scratch.doubtful, r) != 0
            rounds += _finish(tree, rays, found, i, scratch, r, doubtful, any_hit)
            if following < count and rounds <= _WORK:
                load_lane(rays, scratch, r, scratch.waiting, following)
                put(lanes.at_node, nodes, r)
                following, nodes = following + 1, nodes + 1
        ends = 0
    return following, rounds


@inlined
def _trace_stream(tree, rays, found, scratch, following, count, any_hit):
    """Trace the rays in ``scratch.waiting`` from ``following`` to ``count``, sixteen at a time; returns the first that
    still waits.
    """
    nodes = begin_lanes(rays, scratch, scratch.waiting, following, count)
    return _run_lanes(tree, rays, found, scratch, (nodes, 0, 0), (following + nodes, count), any_hit)[0]


@kernel
def _hand_over(tree, rays, found, first, scratch, top, doubtful, any_hit):
    """Let the rays of a packet that gave up go on as lanes, each with those of the waiting octants that it meets.

    Returns the number of rounds.
    """
    prepared, lanes = scratch.prepared, scratch.lanes
    for r in range(WIDTH):
        begin_ray(lanes, r)
        put(scratch.doubtful, r, (doubtful >> r) & 1)
    for k in range(top):
        entry = get(scratch.packet_stack, k)
        child, at_ = child_of(tree, entry & 0xFFFFFFFF)
        meeting = meet_octant(tree, prepared, at_)
        while meeting != 0:
            wait_octant(lanes, lowest_bit(meeting), entry, child)
            meeting &= meeting - 1
    lists = 0, 0, 0
    for r in range(WIDTH):
        if any_hit and best_of(prepared, r)[1] != NO_FACE:
            _finish(tree, rays, found, first + r, scratch, r, False, any_hit)
        else:
            lists = list_lane(lanes, r, resume(tree, prepared, lanes, r), lists)
    return _run_lanes(tree, rays, found, scratch, lists, (0, 0), any_hit)[1]


@inlined
def _trace_sixteen(tree, rays, found, first, scratch, any_hit):
    """Trace the rays from ``first`` on as a packet, and as lanes from where it gave up; returns the rounds of lanes."""
    prepared, rounds = scratch.prepared, np.int64(0)
    for r in range(WIDTH):
        put(scratch.number, r, first + r)
    prepare_sixteen(rays, prepared, scratch.number)
    top, doubtful = trace_packet(tree, prepared, scratch.packet_stack, any_hit)
    if top > 0:
        return _hand_over(tree, rays, found, first, scratch, top, doubtful, any_hit)
    for r in range(WIDTH):
        rounds += _finish(tree, rays, found, first + r, scratch, r, (doubtful >> r) & 1 != 0, any_hit)
    return rounds


@kernel
def search_blocks(tree, rays, found, begin, end, any_hit):
    """``trace`` for a tree without nodes: every ray against every block."""
    for i in range(begin, end):
        ray, t_max = ray_at(rays, i)
        write_hit(found, i, rays.scale, search_all_blocks(tree, ray, t_max, any_hit), any_hit)


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
    """Hits of rays up to ``end`` into ``out``: rows t, u, v and face, or with ``any_hit`` bools.

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
def search_chunk(words, rays, out, begin, end, any_hit):
    """Hits of the rays begin:end, as ``trace_chunk`` writes them, for a tree without nodes; returns the row or -1."""
    tree = tree_pointers(words)
    source, found = ray_pointers(rays, tree.scale), hit_pointers(out, out.shape[1])
    bad = first_bad_ray(source, begin, end)
    if bad < 0:
        search_blocks(tree, source, found, begin, end, any_hit)
    return bad
