"""Closest and any hits of a range of rays: coherent sixteens as packets, others as a stream, doubts settled singly."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.simd import at, get, larger, lowest_bit, pointer, put, smaller, splat8
from renderer.trace.intersect import Ray, box_limit, enter_boxes, largest_of, make_shear, make_slabs, round_down
from renderer.trace.layout import CHILDREN, LEAF_BITS, MAX_LEAF_BLOCKS, NODE_WORDS, cache_aligned
from renderer.trace.leaf import NO_FACE, nearest_carefully, search_all_blocks
from renderer.trace.packet import child_of, meet_octant, trace_packet
from renderer.trace.ray_lanes import DOUBLES, FLOATS, INTEGERS, WIDTH, Prepared, best_of, prepare
from renderer.trace.stream import (
    END,
    LANE_DOUBLES,
    LANE_FLOATS,
    LANE_INTEGERS,
    Lanes,
    begin_ray,
    leave_leaf,
    leave_node,
    make_lanes,
    meet_leaves,
    meet_nodes,
    resume,
    take_hits,
    wait_octant,
)

# Rays whose slopes against their dominant axis differ by more than this from the first one's are no packet. It only
# spares rays that point anywhere the attempt: how far a packet goes, its budget tells.
_SPREAD = 0.125
_MOST, _TINIEST = np.finfo(np.float64).max, 2.0**-1074


class RayPointers(NamedTuple):
    """Pointers to rows of origins and directions, and to t_min and t_max. All but the directions have a step from one
    ray to the next, 0 where all share one. ``scale`` is the tree's, a power of two, so t goes in and out of its units
    exactly.
    """

    origins: Any
    directions: Any
    t_min: Any
    t_max: Any
    origin_step: int
    min_step: int
    max_step: int
    scale: float


class HitPointers(NamedTuple):
    """Pointers to what is written: t, face, u, v as ``Hits`` has them, and for any hits only ``hit``, a bool."""

    t: Any
    face: Any
    u: Any
    v: Any
    hit: Any


class Scratch(NamedTuple):
    """Memory of one thread, as pointers: sixteen prepared rays and their lanes; of each whether it met a doubt and its
    number; a packet's stack; and the numbers of the rays that wait for a stream.
    """

    prepared: Prepared
    lanes: Lanes
    packet_stack: Any
    doubtful: Any
    number: Any
    waiting: Any


class Memory(NamedTuple):
    """The arrays behind a ``Scratch``, and the entries of one stack."""

    floats: NDArray[np.float32]
    doubles: NDArray[np.float64]
    integers: NDArray[np.int64]
    stack_size: int


def stack_size(depth: int) -> int:
    """Entries of one stack: each level leaves at most seven octants waiting, and some are written above the top."""
    return 7 * depth + 24


def depth_of_stack(size: int) -> int:
    """The levels of a tree for which a stack of ``size`` entries is enough."""
    return (size - 24) // 7


def make_memory(depth: int, rays: int) -> Memory:
    """Memory for ranges of up to ``rays`` rays against a tree of ``depth`` levels."""
    size = stack_size(depth)
    integers = INTEGERS + 2 * WIDTH + LANE_INTEGERS + (WIDTH + 1) * size + rays
    return Memory(
        cache_aligned(FLOATS + LANE_FLOATS, np.float32),
        cache_aligned(DOUBLES + LANE_DOUBLES, np.float64),
        cache_aligned(integers, np.int64),
        size,
    )


@inlined
def make_scratch(memory):
    """Pointers into a ``Memory``."""
    floats, doubles, integers = pointer(memory.floats), pointer(memory.doubles), pointer(memory.integers)
    doubtful = at(integers, INTEGERS)
    number = at(doubtful, WIDTH)
    lane_integers = at(number, WIDTH)
    size = memory.stack_size
    lanes = make_lanes(lane_integers, at(floats, FLOATS), at(doubles, DOUBLES), size)
    packet_stack = at(lane_integers, LANE_INTEGERS + WIDTH * size)
    waiting = at(packet_stack, size)
    return Scratch(Prepared(floats, doubles, integers), lanes, packet_stack, doubtful, number, waiting)


@inlined
def ray_at(rays, i):
    """Ray ``i`` in the tree's units, and its t_max."""
    o, d, s = at(rays.origins, i * rays.origin_step), at(rays.directions, 3 * i), rays.scale
    least = get(rays.t_min, i * rays.min_step)
    # Above 0 it stays so, that a hit at the start is still too near.
    t_min = larger(s * least, _TINIEST) if least > 0.0 else least
    ray = Ray(s * get(o, 0), s * get(o, 1), s * get(o, 2), get(d, 0), get(d, 1), get(d, 2), t_min)
    # A hit beyond the largest number, in either unit, is none.
    return ray, smaller(s * smaller(get(rays.t_max, i * rays.max_step), _MOST), _MOST)


@kernel
def are_coherent(rays, begin):
    """Whether the sixteen rays from ``begin`` on share their dominant axis, its sign and nearly their slopes."""
    d = at(rays.directions, 3 * begin)
    ax, ay, az = abs(get(d, 0)), abs(get(d, 1)), abs(get(d, 2))
    w = 2 if az >= ax and az >= ay else (1 if ay >= ax else 0)
    u, v = (w + 1) % 3, (w + 2) % 3
    first = get(d, w)
    slope_u, slope_v = get(d, u) / first, get(d, v) / first
    for r in range(1, WIDTH):
        dw, du, dv = get(d, 3 * r + w), get(d, 3 * r + u), get(d, 3 * r + v)
        size = abs(dw)
        # Of two equal components the axis that ``make_shear`` takes depends on which they are.
        dominant = size > abs(du) and size > abs(dv) and dw * first > 0.0
        if not (dominant and abs(du - slope_u * dw) <= _SPREAD * size and abs(dv - slope_v * dw) <= _SPREAD * size):
            return False
    size = abs(first)
    return size > abs(get(d, u)) and size > abs(get(d, v))


@kernel
def search_singly(tree, ray, t_max, stack):
    """The closest hit (t, face, u, v, w) of one ray, with every doubt settled; face = NO_FACE for none.

    Octants are opened in the order in which they stand in their node, the last of them first. That suits few rays and
    compiles in a fraction of the time that packets and streams take.
    """
    largest = largest_of(ray)
    slabs, shear = make_slabs(ray, largest), make_shear(ray)
    lower = splat8(round_down(ray.t_min * largest))
    best = (t_max, np.int32(NO_FACE), 0.0, 0.0, 1.0)
    top = 1
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            code = ~child
            best = nearest_carefully(tree, code >> LEAF_BITS, (code & (MAX_LEAF_BLOCKS - 1)) + 1, ray, shear, best)
            continue
        _, bits = enter_boxes(tree.nodes, child, slabs, lower, splat8(box_limit(best[0], largest)))
        while bits != 0:
            put(stack, top, np.int64(get(tree.links, child * NODE_WORDS + CHILDREN + lowest_bit(bits))))
            bits &= bits - 1
            top += 1
    return best


@inlined
def _write(found, i, scale, best, any_hit):
    t, face, u, v, w = best
    hit = face != NO_FACE
    if any_hit:
        put(found.hit, i, hit)
        return
    # No t, u or v is -0.0.
    put(found.t, i, t / scale + 0.0 if hit else np.inf)
    put(found.face, i, np.int64(face if hit else -1))
    put(found.u, i, u / w + 0.0 if hit else np.nan)
    put(found.v, i, v / w + 0.0 if hit else np.nan)


@inlined
def _finish(tree, rays, found, i, scratch, r, doubtful, any_hit):
    """Write the hit of ray ``i``, in place ``r``, after a careful search on its stack if there was a doubt."""
    best = best_of(scratch.prepared, r)
    if doubtful:
        ray, t_max = ray_at(rays, i)
        best = search_singly(tree, ray, t_max, at(scratch.lanes.stacks, r * scratch.lanes.stack_size))
    _write(found, i, rays.scale, best, any_hit)


@inlined
def _load(rays, scratch, r, i):
    """Let ray ``i`` begin in lane ``r``."""
    ray, t_max = ray_at(rays, i)
    prepare(scratch.prepared, r, ray, t_max)
    begin_ray(scratch.lanes, r)
    put(scratch.number, r, i)
    put(scratch.doubtful, r, 0)


@inlined
def _list_lane(lanes, r, child, nodes, leaves):
    """Put lane ``r`` into the list that its next child asks for; returns the lengths of both."""
    put(lanes.at_node, nodes, r)
    put(lanes.at_leaf, leaves, r)
    return nodes + np.int64(child >= 0), leaves + np.int64(child < 0)


@kernel
def _run_lanes(tree, rays, found, scratch, nodes, leaves, following, count, any_hit):
    """Run the lanes that are listed to their ends; meanwhile the rays in ``scratch.waiting`` from ``following`` to
    ``count`` take the places of those that end.
    """
    prepared, lanes, waiting = scratch.prepared, scratch.lanes, scratch.waiting
    while nodes + leaves > 0:
        meet_nodes(tree, prepared, lanes, nodes)
        entered, nodes = nodes, 0
        for k in range(entered):
            r = get(lanes.at_node, k)
            child = leave_node(tree, prepared, lanes, r, any_hit)
            nodes, leaves = _list_lane(lanes, r, child, nodes, leaves)
        meet_leaves(tree, prepared, lanes, leaves)
        entered, leaves = leaves, 0
        for k in range(entered):
            r = get(lanes.at_leaf, k)
            child, hit = get(lanes.child, r), False
            if child != END:
                hit, doubtful = take_hits(tree, prepared, lanes, r)
                put(scratch.doubtful, r, get(scratch.doubtful, r) | np.int64(doubtful))
                child = leave_leaf(tree, prepared, lanes, r)
            if child == END or (any_hit and hit):
                i, doubtful = get(scratch.number, r), get(scratch.doubtful, r) != 0
                _finish(tree, rays, found, i, scratch, r, doubtful, any_hit)
                if following == count:
                    continue
                _load(rays, scratch, r, get(waiting, following))
                following += 1
                child = 0
            nodes, leaves = _list_lane(lanes, r, child, nodes, leaves)


@inlined
def _trace_stream(tree, rays, found, scratch, count, any_hit):
    """Trace the ``count`` rays in ``scratch.waiting``, sixteen in turn."""
    lanes, first = scratch.lanes, smaller(count, WIDTH)
    for r in range(first):
        _load(rays, scratch, r, get(scratch.waiting, r))
        put(lanes.at_node, r, r)
    _run_lanes(tree, rays, found, scratch, first, 0, first, count, any_hit)


@kernel
def _hand_over(tree, rays, found, first, scratch, top, doubtful, any_hit):
    """Let the rays of a packet that gave up go on as lanes: each with the octants it meets of those that wait."""
    prepared, lanes = scratch.prepared, scratch.lanes
    for r in range(WIDTH):
        begin_ray(lanes, r)
        put(scratch.number, r, first + r)
        put(scratch.doubtful, r, (doubtful >> r) & 1)
    for k in range(top):
        entry = get(scratch.packet_stack, k)
        child, at_ = child_of(tree, entry & 0xFFFFFFFF)
        meeting = meet_octant(tree, prepared, at_)
        while meeting != 0:
            wait_octant(lanes, lowest_bit(meeting), entry, child)
            meeting &= meeting - 1
    nodes, leaves = 0, 0
    for r in range(WIDTH):
        if any_hit and best_of(prepared, r)[1] != NO_FACE:
            _finish(tree, rays, found, first + r, scratch, r, False, any_hit)
        else:
            nodes, leaves = _list_lane(lanes, r, resume(tree, prepared, lanes, r), nodes, leaves)
    _run_lanes(tree, rays, found, scratch, nodes, leaves, 0, 0, any_hit)


@inlined
def _trace_sixteen(tree, rays, found, first, scratch, any_hit):
    """Trace the rays from ``first`` on as a packet, and each alone from where it gave up."""
    prepared = scratch.prepared
    for r in range(WIDTH):
        ray, t_max = ray_at(rays, first + r)
        prepare(prepared, r, ray, t_max)
    top, doubtful = trace_packet(tree, prepared, scratch.packet_stack, any_hit)
    if top > 0:
        _hand_over(tree, rays, found, first, scratch, top, doubtful, any_hit)
        return
    for r in range(WIDTH):
        _finish(tree, rays, found, first + r, scratch, r, (doubtful >> r) & 1 != 0, any_hit)


@kernel
def search_blocks(tree, rays, found, begin, end, any_hit):
    """``trace`` for a tree without nodes: every ray against every block."""
    for i in range(begin, end):
        ray, t_max = ray_at(rays, i)
        _write(found, i, rays.scale, search_all_blocks(tree, ray, t_max, any_hit), any_hit)


@kernel
def trace(tree, rays, found, begin, end, scratch, any_hit):
    """Closest hits, or with ``any_hit`` whether there is one, of the rays from ``begin`` to ``end``.

    The interval [t_min, t_max] is closed; t counts in units of |direction|; no face is culled. Among equal t the lowest
    face wins: a node is left behind only when its entry is beyond the best t, never at it, so the answer depends
    neither on the order of the visits nor on the rays that travel together. Watertight and deterministic (Woop et al.
    2013); see ``intersect`` for the bounds.
    """
    count = np.int64(0)
    for first in range(begin, end, WIDTH):
        if first + WIDTH <= end and are_coherent(rays, first):
            _trace_sixteen(tree, rays, found, first, scratch, any_hit)
            continue
        for i in range(first, smaller(first + WIDTH, end)):
            put(scratch.waiting, count, i)
            count += 1
    if count > 0:
        _trace_stream(tree, rays, found, scratch, count, any_hit)
