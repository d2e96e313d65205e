"""Rays from many points in many directions through translucent faces, tile by tile.

``sweep`` has found the directions that opaque faces hide. Each other ray crosses all translucent faces in its way: what
is left of it is the product of the shares that these let through, in the order in which it crosses them. Each point
sums its directions in their order, so the bits of its result do not depend on its tile.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.all_hits.candidates import CANDIDATE_WORDS
from renderer.all_hits.gather import DOUBLE_ROWS, INTEGER_ROWS, OUT_FACE, Choice, Found, gather_rays
from renderer.jit.decorators import kernel
from renderer.numerics.simd import load, minimum, offset, pointer, store
from renderer.numerics.vec3 import put3, row3
from renderer.studies.sweep import (
    RAYS,
    RAYS_A_CALL,
    SUM,
    TILE,
    WHOLE,
    SweepScratch,
    begin_tile,
    end_tile,
    look,
    make_sweep_scratch,
    start_ray,
    sweep_pointers,
)
from renderer.trace.rays import RayPointers
from renderer.trace.starts.record import BARYCENTRIC, CODE, EDGE, FACE, ROW, SLACK, StartPointers
from renderer.trace.traverse import new_scratch, scratch_pointers
from renderer.trace.trees import tree_pointers

# Hits that are gathered at once: sixteen for each ray of a list, 1.8 MB. A ray that has more needs more memory.
_CAPACITY = 16 * RAYS
_ANY_NUMBER = np.iinfo(np.int64).max


class PaneArrays(NamedTuple):
    """Translucent faces: the descriptor of the tree over ``vertices`` and ``faces``, and ``shares`` (F,) float64, what
    each face lets through.
    """

    descriptor: NDArray[np.uint64]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    shares: NDArray[np.float64]


class ThroughScratch(NamedTuple):
    """The scratch of one thread: that of a sweep; what gathering hits needs, with room for ``doubles.shape[1]`` of
    them; and for each ray of a list the number of its hits and the share that is left of it.
    """

    sweep: SweepScratch
    trace: NDArray[np.int64]
    doubles: NDArray[np.float64]
    integers: NDArray[np.int64]
    counts: NDArray[np.int64]
    left: NDArray[np.float64]


def make_through_scratch(depth: int) -> ThroughScratch:
    """Scratch for tiles against a tree of ``depth`` levels."""
    return ThroughScratch(
        make_sweep_scratch(depth),
        new_scratch(depth, CANDIDATE_WORDS),
        np.empty((DOUBLE_ROWS, _CAPACITY)),
        np.empty((INTEGER_ROWS, _CAPACITY), np.int64),
        np.empty(RAYS, np.int64),
        np.empty(RAYS),
    )


def with_more_room(scratch: ThroughScratch) -> ThroughScratch:
    """The scratch with room for twice as many hits."""
    room = 2 * scratch.doubles.shape[1]
    return scratch._replace(doubles=np.empty((DOUBLE_ROWS, room)), integers=np.empty((INTEGER_ROWS, room), np.int64))


@kernel
def sweep_through(panes, places, sky, bits, answers, rows, begin, k, arrays):
    """Sum what is left of the rays of the points in ``rows``, one tile after the other; some rays with each call.

    panes     ``PaneArrays``; ``places`` are ``sweep.Places`` against these
    bits      (n, ceil(k / 8)) uint8: a set bit for each direction of a row that needs no ray, as it is hidden
    answers   ``sweep.Answers``, of which sums are written
    begin, k  as for ``sweep``
    arrays    a ``ThroughScratch``

    Returns where to go on, (len(rows), 0) if all is done; and whether the scratch has too little room for one ray.
    """
    tree, scratch = tree_pointers(panes.descriptor), sweep_pointers(arrays.sweep, panes.vertices, panes.faces)
    count, work = minimum(np.int64(TILE), len(rows) - begin), np.int64(0)
    if k == 0:
        begin_tile(tree, places, rows, begin, count, scratch)
    while k < len(sky.values) and work < RAYS_A_CALL:
        listed, rays, following = np.int64(0), np.int64(0), k
        while following < len(sky.values) and listed + count <= RAYS:
            listed, rays = _aim_through(places, sky, scratch, bits, rows, begin, following, count, listed, rays)
            following += 1
        hits = _let_through(tree, panes.shares, scratch, arrays, rays)
        if hits < 0:
            return begin, k, True
        _add_up(answers, scratch, arrays.left, listed)
        work += listed + hits
        k = following
    if k < len(sky.values):
        return begin, k, False
    end_tile(answers, scratch, count)
    return begin + count, np.int64(0), False


@kernel
def _aim_through(places, sky, scratch, bits, rows, begin, k, count, listed, rays):
    """``sweep._aim`` for a tile that begins at ``begin`` and for directions of which ``bits`` say whether they need a
    ray.
    """
    given, weight, limit = row3(pointer(sky.directions), k), sky.values[k], sky.limits[k]
    for i in range(count):
        d, height, value = look(places, sky, scratch, i, given, weight)
        seen = height > 0.0 and bits[rows[begin + i], k >> 3] & np.uint8(0x80 >> (k & 7)) == 0
        if seen:
            _start_through(scratch, i, d, rays)
            put3(scratch.directions, 3 * rays, d)
            store(scratch.limits, rays, limit)
        store(scratch.values, listed, value)
        store(scratch.listed, listed, i * 2 + np.int64(seen))
        listed += 1
        rays += np.int64(seen)
    return listed, rays


@kernel
def _start_through(scratch, i, d, ray):
    """``start_ray`` for a ray that a face at its start does not stop, but takes its share of."""
    is_free, row = start_ray(scratch, i, d, ray), offset(scratch.starts, ROW * ray)
    if load(row, FACE) < 0.0:
        return
    if not is_free:
        # The search from the exact start lists the face.
        store(row, SLACK, EDGE)
    elif load(row, SLACK) != EDGE:
        # Within its face nothing is left to be decided at the start.
        store(row, CODE, np.float64(np.int64(load(row, CODE)) & BARYCENTRIC))


@kernel
def _let_through(tree, shares, scratch, arrays, rays):
    """Write to ``arrays.left`` what is left of each ray behind all faces that it crosses.

    Returns the number of hits, or -1 if there is too little room for those of one ray.
    """
    starts = StartPointers(scratch.starts, ROW, scratch.vertices, scratch.faces)
    batch = RayPointers(
        scratch.origins, scratch.directions, scratch.zero, scratch.limits, 3, 3, 0, 1, tree.scale, starts
    )
    found = Found(pointer(arrays.doubles), pointer(arrays.integers), arrays.doubles.shape[1])
    memory, choice = scratch_pointers(arrays.trace, starts), Choice(True, _ANY_NUMBER, True)
    crossed, done, hits = offset(found.integers, found.capacity * OUT_FACE), np.int64(0), np.int64(0)
    while done < rays:
        reached, place = gather_rays(tree, batch, done, rays, choice, arrays.counts, found, memory), np.int64(0)
        if reached == done:
            return np.int64(-1)
        for ray in range(done, reached):
            left = 1.0
            for _ in range(arrays.counts[ray]):
                # rule: share-of-pane
                left *= shares[load(crossed, place)]
                place += 1
            arrays.left[ray] = left
        hits += place
        done = reached
    return hits


@kernel
def _add_up(answers, scratch, left, listed):
    """Add what the listed points see: for each point in the order of directions."""
    ray = np.int64(0)
    for entry in range(listed):
        code, value, share = load(scratch.listed, entry), load(scratch.values, entry), 0.0
        if code & 1 != 0:
            share = left[ray]
            ray += 1
        i = code >> 1
        store(scratch.points, WHOLE + i, load(scratch.points, WHOLE + i) + value)
        counted = value * (1.0 - share) if answers.hidden else value * share
        store(scratch.points, SUM + i, load(scratch.points, SUM + i) + counted)
