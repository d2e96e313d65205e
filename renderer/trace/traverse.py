"""Closest and any hits of a range of rays: sixteen coherent rays as a packet, others as a stream."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import apart, inlined, kernel
from renderer.numerics.kinds import of_none
from renderer.numerics.simd import (
    address,
    float32_pointer,
    float64_pointer,
    int32_pointer,
    load,
    lowest_bit,
    minimum,
    offset,
    pointer,
    store,
)
from renderer.trace.best import NO_FACE, no_hit
from renderer.trace.intersect import largest_of, make_shear
from renderer.trace.layout import WORD_BYTES, cache_aligned
from renderer.trace.leaf import search_all_blocks
from renderer.trace.packet import are_coherent, child_of, meet_octant
from renderer.trace.ray_lanes import (
    DIRECTION_Z,
    GROUP_STRIDE,
    LARGEST,
    NUMBER,
    UNRESOLVED,
    WIDTH,
    Prepared,
    best_of,
    prepare_eight,
    start_of,
)
from renderer.trace.rays import HitPointers, RayPointers, first_bad_ray, ray_at, write_misses
from renderer.trace.single import search_carefully, write_best
from renderer.trace.stack_entry import distance_of, octant_of
from renderer.trace.starts.cone import HOLDERS_WORDS
from renderer.trace.starts.record import EDGE
from renderer.trace.stream import (
    GROUPS,
    LANE_DOUBLES,
    LANE_INTEGERS,
    MIN_ACTIVE,
    LaneCounts,
    Lanes,
    Queue,
    begin_eight,
    clear_lanes,
    end_stacks,
    list_lane,
    make_lanes,
    meet_leaves,
    resume,
    run_lanes,
    take_any,
    take_hits,
    wait_octant,
)
from renderer.trace.trees import call_pointers
from renderer.trace.walk import stack_size

# The rounds of lanes in a call, beside those of the rays under way then: some 10 ms, so that Ctrl-C need not wait for
# long. A chunk of rays takes fewer on most meshes, and is not cut.
_WORK = 1 << 14


class ScratchPointers(NamedTuple):
    """Pointers into a scratch: prepared rays, of which a packet takes the first sixteen; a stream's lanes; a packet's
    stack; the numbers of the rays that wait for a stream; and the faces that contain a start.
    """

    prepared: Prepared
    lanes: Lanes
    packet_stack: Any
    waiting: Any
    holders: Any


# A scratch is one array of int64, because Numba takes each array that it gets apart. These words begin its parts: the
# entries of one stack; prepared rays as float32; prepared rays and lanes as float64; faces that contain a start;
# prepared rays, lanes and stacks as int64. Between them is as much as keeps the first group of each kind apart in the
# cache: at equal places of 4 kB, packets took a sixth longer.
_STACK_SIZE, _FLOATS, _PREPARED = 0, 8, GROUPS * GROUP_STRIDE
_DOUBLES = _FLOATS + _PREPARED // 2 + GROUP_STRIDE // 2
_HOLDERS = _DOUBLES + _PREPARED + LANE_DOUBLES
_INTEGERS = _HOLDERS + HOLDERS_WORDS + GROUP_STRIDE


def new_scratch(depth: int, rays: int) -> NDArray[np.int64]:
    """Memory in which a thread traces ranges of up to ``rays`` rays against a tree of ``depth`` levels."""
    size = stack_size(depth)
    integers = _PREPARED + LANE_INTEGERS + (GROUPS * WIDTH + 1) * size + rays + WIDTH
    scratch = cache_aligned(_INTEGERS + integers, np.int64)
    scratch[_STACK_SIZE] = size
    return scratch


def is_deep_enough(scratch: NDArray[np.int64], depth: int) -> bool:
    """Whether a scratch serves a tree of ``depth`` levels."""
    return int(scratch[_STACK_SIZE]) >= stack_size(depth)


def holders_in(scratch: NDArray[np.int64]) -> NDArray[np.int64]:
    """The part of a scratch for the faces that contain a start."""
    return scratch[_HOLDERS:_INTEGERS]


@inlined
def scratch_pointers(scratch, starts):
    """The ``ScratchPointers`` into a scratch, for rays with ``starts``, or ON_SURFACE."""
    words, start = pointer(scratch), address(scratch)
    floats, doubles = float32_pointer(start + WORD_BYTES * _FLOATS), float64_pointer(start + WORD_BYTES * _DOUBLES)
    size, integers = load(words, _STACK_SIZE), offset(words, _INTEGERS)
    lane_integers = offset(integers, _PREPARED)
    stacks = start + WORD_BYTES * (_INTEGERS + _PREPARED + LANE_INTEGERS)
    distances, children = float32_pointer(stacks), int32_pointer(stacks + WORD_BYTES // 2 * GROUPS * WIDTH * size)
    lanes = make_lanes(lane_integers, offset(doubles, _PREPARED), distances, children, size)
    packet_stack = offset(lane_integers, LANE_INTEGERS + GROUPS * WIDTH * size)
    return ScratchPointers(
        Prepared(floats, doubles, integers, starts), lanes, packet_stack, offset(packet_stack, size),
        offset(words, _HOLDERS),
    )  # fmt: skip


class Progress(NamedTuple):
    """The first ray that was not yet tried as a packet; the first ray in ``ScratchPointers.waiting`` that no stream
    took; and the number of rays there.
    """

    begin: int
    following: int
    count: int  # type: ignore[assignment]  # tuples have a method of that name


class _Query(NamedTuple):
    """Rays under way, the pointers to their hits, the scratch that they share, and ``any_hit`` as of ``trace``."""

    rays: RayPointers
    found: HitPointers
    scratch: ScratchPointers
    any_hit: Any


@inlined
def _finish(tree, query, r):
    """Write the hit of the ray in lane ``r``. If a hit must be resolved, a careful search comes first.

    Returns the number of rounds that take as long as that search.
    """
    rays, scratch, prepared = query.rays, query.scratch, query.scratch.prepared
    best, steps = best_of(prepared, r), np.int64(0)
    i, (slack, _) = load(prepared.integers, NUMBER + r), start_of(prepared, r)
    # rule: resolve-uncertain
    if load(prepared.integers, UNRESOLVED + r) != 0 or slack == EDGE:
        # No packet is under way.
        stack, any_hit = scratch.packet_stack, query.any_hit is not None
        careful = search_carefully(tree, rays, i, stack, scratch.holders, any_hit)
        best, steps = careful.best, careful.steps
    largest, dz = load(prepared.doubles, LARGEST + r), load(prepared.doubles, DIRECTION_Z + r)
    write_best(tree, rays, query.found, i, best, slack, largest, dz, query.any_hit is not None)
    return steps // MIN_ACTIVE


@inlined
def _meet(tree, query, lanes, count):
    meet_leaves(tree, query.scratch.prepared, lanes, count, query.any_hit)


@inlined
def _take(tree, query, k):
    take = of_none(query.any_hit, take_hits, take_any)
    hit = take(tree, query.scratch.prepared, query.scratch.lanes, k)
    return query.any_hit is not None and hit


@kernel
def _run(tree, query, counts, queue):
    """Trace rays in lanes and those of a queue to their ends; none of the queue begins after _WORK rounds.

    Returns the first ray that still waits, and the number of rounds.
    """
    scratch = query.scratch
    return run_lanes(
        tree, query.rays, scratch.prepared, scratch.lanes, counts, queue, _WORK, query, query.any_hit,
        _meet, _take, _finish,
    )  # fmt: skip


@inlined
def _no_lanes():
    return LaneCounts(np.int64(0), np.int64(0), np.int64(0))


@inlined
def _trace_stream(tree, query, following, count):
    """Trace the rays in ``scratch.waiting`` from ``following`` to ``count``; returns the first that still waits."""
    scratch = query.scratch
    clear_lanes(scratch.lanes, count - following)
    for k in range(count, count + WIDTH):
        store(scratch.waiting, k, load(scratch.waiting, count - 1))
    return _run(tree, query, _no_lanes(), Queue(scratch.waiting, following, count))[0]


@kernel
def _hand_over(tree, query, top, unresolved):
    """Move the rays of a packet that gave up to lanes, each with the waiting octants that it enters.

    Returns the number of rounds.
    """
    scratch, prepared, lanes = query.scratch, query.scratch.prepared, query.scratch.lanes
    end_stacks(lanes, WIDTH)
    for r in range(0, WIDTH, 8):
        begin_eight(tree, query.rays, prepared, lanes, r, offset(prepared.integers, NUMBER + r), 8)
    for r in range(WIDTH):
        store(prepared.integers, UNRESOLVED + r, (unresolved >> r) & 1)
    for k in range(top):
        entry = load(scratch.packet_stack, k)
        child, at_ = child_of(tree, octant_of(entry))
        meeting = meet_octant(tree.nodes, prepared, at_)
        while meeting != 0:
            wait_octant(prepared, lanes, lowest_bit(meeting), distance_of(entry), child)
            meeting &= meeting - 1
    counts = _no_lanes()
    for r in range(WIDTH):
        if query.any_hit is not None and best_of(prepared, r).face != NO_FACE:
            store(prepared.integers, UNRESOLVED + r, 0)
            _finish(tree, query, r)
        else:
            counts = list_lane(lanes, r, resume(tree, query.rays, prepared, lanes, r, query.any_hit), counts)
    return _run(tree, query, counts, Queue(scratch.waiting, np.int64(0), np.int64(0)))[1]


@inlined
def _trace_sixteen(tree, query, first):
    """Trace the rays from ``first`` on as a packet, and as lanes once it gives up. Returns the rounds of lanes."""
    prepared, rounds = query.scratch.prepared, np.int64(0)
    numbers = offset(prepared.integers, NUMBER)
    for r in range(WIDTH):
        store(numbers, r, first + r)
    for half in range(0, WIDTH, 8):
        prepare_eight(query.rays, prepared, half, offset(numbers, half))
    top, unresolved = tree.ways.trace_packet(tree, prepared, query.scratch.packet_stack, query.any_hit)
    if top > 0:
        return _hand_over(tree, query, top, unresolved)
    for r in range(WIDTH):
        store(prepared.integers, UNRESOLVED + r, (unresolved >> r) & 1)
        rounds += _finish(tree, query, r)
    return rounds


@kernel
def search_blocks(tree, rays, found, begin, end, holders, any_hit):
    """``trace`` for a tree without nodes: every ray against every block; ``holders`` as in ``ScratchPointers``."""
    write_misses(found, begin, end, any_hit is not None)
    for i in range(begin, end):
        ray, t_max = ray_at(rays, i)
        best, unresolved = no_hit(t_max), True
        if ray.slack != EDGE:
            best, unresolved = search_all_blocks(tree, ray, t_max, any_hit is not None)
        if unresolved:
            # Nothing waits on a stack where there are no nodes.
            best = search_carefully(tree, rays, i, holders, holders, any_hit is not None).best
        dz = make_shear(ray).direction_z
        write_best(tree, rays, found, i, best, ray.slack, largest_of(ray), dz, any_hit is not None)


@kernel
def trace(tree, rays, found, begin, end, scratch, any_hit):
    """Closest hits of the rays from ``begin`` to ``end`` if ``any_hit`` is None; whether there is one if it is True.

    The interval [t_min, t_max] is closed; t counts in units of |direction|; no face is culled. Among equal t the lowest
    face wins: a node is skipped only if its entry is beyond the best t, never at it. So the answer depends neither on
    the order of visits nor on the rays that travel together. Watertight and deterministic (Woop et al. 2013); see
    ``intersect`` for the bounds.
    """
    query, progress = _Query(rays, found, scratch, any_hit), Progress(begin, np.int64(0), np.int64(0))
    while progress.begin < end or progress.following < progress.count:
        progress = _trace_on(tree, query, progress, end)


@kernel
def _trace_on(tree, query, progress, end):
    """``trace`` for more rays; returns the ``Progress`` after them."""
    rounds, following, count, waiting = np.int64(0), progress.following, progress.count, query.scratch.waiting
    for first in range(progress.begin, end, WIDTH):
        write_misses(query.found, first, minimum(first + WIDTH, end), query.any_hit is not None)
        if first + WIDTH <= end and are_coherent(query.rays, first):
            rounds += _trace_sixteen(tree, query, first)
            if rounds > _WORK:
                return Progress(first + WIDTH, following, count)
            continue
        for i in range(first, minimum(first + WIDTH, end)):
            store(waiting, count, i)
            count += 1
    if following < count:
        following = _trace_stream(tree, query, following, count)
    return Progress(end, following, count)


@apart
def trace_rays(tree, rays, found, count, scratch, any_hit):
    """``trace`` of the first ``count`` rays, or ``search_blocks`` where the tree has no nodes."""
    if tree.has_nodes:
        trace(tree, rays, found, 0, count, scratch, any_hit)
    else:
        search_blocks(tree, rays, found, 0, count, scratch.holders, any_hit)


@kernel
def trace_chunk(
    descriptor, origins, directions, t_min, t_max, starts, t, face, u, v, side, pile, hit, any_hit, scratch,
    begin, following, count, end,
):  # fmt: skip
    """Hits of the rays of a ``RayBatch`` up to ``end`` to the arrays of a ``HitArrays``.

    ``descriptor`` is the tree's, which must have nodes. The ``Progress`` is (begin, 0, 0) in the first call for a
    chunk, then that of the last call, with the same scratch. A call with much work ends early; all is done at (end, n,
    n).

    Returns the three numbers of the ``Progress``, and the row of the first ray out of range, or -1; if there is one,
    nothing is traced. Plain numbers, as Numba would call Python to make a named tuple, and crash if Ctrl-C came then.
    """
    call = call_pointers(descriptor, origins, directions, t_min, t_max, starts, t, face, u, v, side, pile, hit)
    (tree, source, found), progress = call, Progress(begin, following, count)
    bad = first_bad_ray(source, begin, end)
    if bad < 0:
        query = _Query(source, found, scratch_pointers(scratch, source.starts), any_hit)
        progress = _trace_on(tree, query, progress, end)
    return progress.begin, progress.following, progress.count, bad


@kernel
def search_chunk(
    descriptor, origins, directions, t_min, t_max, starts, t, face, u, v, side, pile, hit, any_hit, holders, begin, end
):  # fmt: skip
    """Hits of the rays begin:end, as ``trace_chunk`` writes them, for a tree without nodes; returns the row or -1."""
    call = call_pointers(descriptor, origins, directions, t_min, t_max, starts, t, face, u, v, side, pile, hit)
    tree, source, found = call
    bad = first_bad_ray(source, begin, end)
    if bad < 0:
        search_blocks(tree, source, found, begin, end, pointer(holders), any_hit)
    return bad
