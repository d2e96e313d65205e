"""Rays from many points in many directions, traced tile by tile without writing them all down.

A tile is up to TILE points that lie together. The rays of a tile in one direction are traced together, then those
in the next direction. Directions below a point's horizon need no ray. Each point sums its directions in their order,
and no ray depends on another, so the bits of its result do not depend on its tile.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load, minimum, offset, pointer, store
from renderer.numerics.vec3 import add, cross, dot, largest_component, least_axis, normalized, put3, row3, scale, three
from renderer.trace.intersect import CORNER
from renderer.trace.layout import cache_aligned
from renderer.trace.parallel_rays import (
    ParallelPointers,
    ParallelScratch,
    new_parallel_scratch,
    parallel_pointers,
    trace_parallel,
)
from renderer.trace.rays import HitPointers, RayPointers, hit_pointers
from renderer.trace.spawn import LEVEL, has_normal, offset_to_both_sides, put_no_start
from renderer.trace.starts.anchor import anchor_of, rounded
from renderer.trace.starts.cone import make_holders
from renderer.trace.starts.fan import FAN_HEAD, OPEN, STOPPED, UNSURE, has_fan, size_of_fan, stop_of
from renderer.trace.starts.record import (
    ABOVE,
    ANCHOR,
    BACK,
    BARYCENTRIC,
    CODE,
    EDGE,
    FACE,
    KNOWN,
    ON_SURFACE,
    ROW,
    SLACK,
    WAY,
    StartPointers,
    corners_in,
    start_at,
)
from renderer.trace.starts.search import take_side
from renderer.trace.traverse import ScratchPointers, new_scratch, scratch_pointers, trace_rays
from renderer.trace.trees import tree_pointers

TILE = 256
# A tile ends where the curve leaves the largest cell, but not before so many points: else its parts may be far apart,
# and their rays enter three times as many leaves together.
_LEAST_TILE = 32
# From so many points on, their rays in one direction are traced together.
_TOGETHER = 16
# So often may that be given up in a tile before it is no longer tried.
_TRIES = 4
# Points with directions that are listed, and their rays traced, together: of a whole tile some directions, of a few
# points many.
RAYS = 1024
# And in one call, or one more list: some 10 ms, so that Ctrl-C and other threads need not wait for long.
RAYS_A_CALL = 1 << 14
# For each point of a tile: where a ray starts that goes to the side of its face's normal, and to the other side; that
# normal; the frame, whose third vector is the point's own normal; the sum so far; that of all directions; its row of
# ``starts.record``; and of a point on an edge the table of ``starts.fan``.
_ABOVE, _BELOW, _FACING, _FRAME = 0, 3 * TILE, 6 * TILE, 9 * TILE
SUM, WHOLE, _START, _FAN = 18 * TILE, 19 * TILE, 20 * TILE, (20 + ROW) * TILE
# The room for all tables: what sixteen faces a point take; and for a table of none.
_FANS, _LEAST_FAN = 256 * TILE, FAN_HEAD
_POINT_DOUBLES = _FAN + _FANS
# Its row; whether it is a corner of the mesh; where its table begins, -1 for none; and once for the tile, how often
# tracing its rays together may still be tried, and where the next table begins.
_ROW, _CORNER, _TABLE = 0, TILE, 2 * TILE
_LEFT, _TABLES, _POINT_INTEGERS = 3 * TILE, 3 * TILE + 1, 3 * TILE + 8


class Places(NamedTuple):
    """The starts of rays. ``normals`` has one row for all points, or no row if points have no horizon.

    points (n, 3), normals (n, 3), (1, 3) or (0, 3) float64, not zero; leaving (n,) int64, -1 for a point that is on no
    face; codes (n,) int64 and anchors (n, 3) float64, as of ``on_surface.SurfacePoints``
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    leaving: NDArray[np.int64]
    codes: NDArray[np.int64]
    anchors: NDArray[np.float64]


class Sky(NamedTuple):
    """The directions that every point looks in.

    directions  (k, 3) float64
    values      (k,) float64: what each adds to the sums
    limits      (k,) float64: hits beyond this t do not count
    turned      whether directions are in the frame of each point, whose z is its normal
    cosine      whether values are multiplied by the cosine between direction and normal
    """

    directions: NDArray[np.float64]
    values: NDArray[np.float64]
    limits: NDArray[np.float64]
    turned: bool
    cosine: bool


class Answers(NamedTuple):
    """The arrays of results; one without rows is not written.

    sums    (n,) float64: the sum over the hidden or the open directions
    bits    (n, ceil(k / 8)) uint8, zeros at first: a bit for each hidden direction, in the order of ``numpy.packbits``
    hidden  whether to sum the hidden directions; else the open ones
    share   whether to divide by the sum over all directions, including those below the horizon
    """

    sums: NDArray[np.float64]
    bits: NDArray[np.uint8]
    hidden: bool
    share: bool


class SweepScratch(NamedTuple):
    """The scratch of one thread: its tile's points, its rays, what they hit, and what tracing needs."""

    doubles: NDArray[np.float64]
    integers: NDArray[np.int64]
    hits: NDArray[np.float64]
    trace: NDArray[np.int64]
    parallel: ParallelScratch


class SweepPointers(NamedTuple):
    """Pointers into a ``SweepScratch`` and to the mesh: the tile's points; origins, directions, t_max and starts of
    rays; the points with directions that are listed, (direction * TILE + point) * 2, and 1 more for those that have a
    ray; and their values.
    """

    points: Any
    numbers: Any
    origins: Any
    directions: Any
    limits: Any
    starts: Any
    values: Any
    zero: Any
    listed: Any
    vertices: Any
    faces: Any
    found: HitPointers
    trace: ScratchPointers
    parallel: ParallelPointers


def make_sweep_scratch(depth: int) -> SweepScratch:
    """Scratch for tiles against a tree of ``depth`` levels."""
    return SweepScratch(
        cache_aligned(_POINT_DOUBLES + (8 + ROW) * RAYS + 8, np.float64),
        cache_aligned(_POINT_INTEGERS + RAYS, np.int64),
        cache_aligned(RAYS // 8, np.float64),
        new_scratch(depth, RAYS),
        new_parallel_scratch(depth, TILE),
    )


@inlined
def sweep_pointers(arrays, vertices, faces):
    """The ``SweepPointers`` of a ``SweepScratch`` and a mesh."""
    doubles, integers = pointer(arrays.doubles), pointer(arrays.integers)
    origins = offset(doubles, _POINT_DOUBLES)
    directions, limits, values = offset(origins, 3 * RAYS), offset(origins, 6 * RAYS), offset(origins, 7 * RAYS)
    starts, zero = offset(origins, 8 * RAYS), offset(origins, (8 + ROW) * RAYS)
    store(zero, 0, 0.0)
    return SweepPointers(
        doubles, integers, origins, directions, limits, starts, values, zero, offset(integers, _POINT_INTEGERS),
        pointer(vertices), pointer(faces),
        hit_pointers(arrays.hits, 0), scratch_pointers(arrays.trace, ON_SURFACE), parallel_pointers(arrays.parallel),
    )  # fmt: skip


@inlined
def _frame_of(normal):
    """Unit vectors across each other, the third one along ``normal``; they depend on it alone."""
    n = normalized(normal)
    first = normalized(cross(least_axis(n), n))
    return first, cross(n, first), n


@kernel
def begin_tile(tree, places, rows, begin, count, scratch):
    """Read ``count`` points, those in ``rows`` from ``begin`` on, and prepare where their rays start."""
    points, normals, leaving = pointer(places.points), pointer(places.normals), pointer(places.leaving)
    step = np.int64(len(places.normals) > 1)
    store(scratch.numbers, _LEFT, _TRIES)
    store(scratch.numbers, _TABLES, 0)
    for i in range(count):
        row = rows[begin + i]
        face, o, start = load(leaving, row), row3(points, row), offset(scratch.points, _START + ROW * i)
        store(scratch.numbers, _ROW + i, row)
        put3(scratch.points, _ABOVE + 3 * i, o)
        put_no_start(start)
        if len(places.normals) > 0:
            first, second, third = _frame_of(row3(normals, row * step))
            put3(scratch.points, _FRAME + 9 * i, first)
            put3(scratch.points, _FRAME + 9 * i + 3, second)
            put3(scratch.points, _FRAME + 9 * i + 6, third)
        if face >= 0:
            put3(start, ANCHOR, row3(pointer(places.anchors), row))
            _begin_on_face(tree, scratch, i, o, face, places.codes[row], len(places.normals) > 0)
        store(scratch.points, SUM + i, 0.0)
        store(scratch.points, WHOLE + i, 0.0)


@kernel
def _begin_on_face(tree, scratch, i, o, face, code, has_horizon):
    """Prepare where the rays of a tile's ``i``-th point start, which lies on a face; its normal says on which side."""
    start, n = offset(scratch.points, _START + ROW * i), three(scratch.points, _FRAME + 9 * i + 6)
    starts = StartPointers(start, 0, scratch.vertices, scratch.faces)
    corners, slack = corners_in(tree, starts, face), EDGE
    if has_normal(corners[0], corners[1], corners[2]):
        normal, above, below, slack = offset_to_both_sides(corners, o, tree.scale)
        put3(scratch.points, _FACING + 3 * i, normal)
        put3(scratch.points, _ABOVE + 3 * i, above)
        put3(scratch.points, _BELOW + 3 * i, below)
        if has_horizon and slack != EDGE and dot(normal, n) != 0.0:
            code |= KNOWN | BACK | (ABOVE if dot(normal, n) > 0.0 else 0)
    put3(start, WAY, n)
    store(start, FACE, np.float64(face))
    store(start, SLACK, slack)
    store(start, CODE, np.float64(code))
    if slack == EDGE:
        _begin_on_edge(tree, starts, scratch, i, n, has_horizon)


@kernel
def _begin_on_edge(tree, starts, scratch, i, n, has_horizon):
    """``_begin_on_face`` for a point on or near an edge."""
    begin = load(scratch.numbers, _TABLES)
    anchor = anchor_of(start_at(tree, starts, 0))
    store(scratch.numbers, _CORNER + i, np.int64(anchor.zeros & (anchor.zeros - 1) != 0))
    put3(scratch.points, _ABOVE + 3 * i, scale(rounded(anchor), 1.0 / tree.scale))
    store(scratch.numbers, _TABLE + i, -1)
    if has_horizon and _FANS - begin >= _LEAST_FAN:
        stack, holders, table = scratch.trace.packet_stack, scratch.trace.holders, offset(scratch.points, _FAN + begin)
        take_side(tree, starts, n, stack, holders, table, _FANS - begin)
        if has_fan(table):
            store(scratch.numbers, _TABLE + i, begin)
            store(scratch.numbers, _TABLES, begin + size_of_fan(table))


@kernel
def start_ray(scratch, i, d, ray):
    """Write the origin and the start of a ray from point ``i`` in direction d. Returns whether nothing stops it yet."""
    own, row = offset(scratch.points, _START + ROW * i), offset(scratch.starts, ROW * ray)
    for k in range(ROW):
        store(row, k, load(own, k))
    put3(scratch.origins, 3 * ray, three(scratch.points, _ABOVE + 3 * i))
    if load(own, FACE) < 0.0:
        return True
    if load(own, SLACK) == EDGE:
        return _start_on_edge(scratch, i, d, row)
    slope, code = dot(three(scratch.points, _FACING + 3 * i), d), np.int64(load(own, CODE))
    # rule: side-of-study-ray
    above = slope >= 0.0
    if not above:
        put3(scratch.origins, 3 * ray, three(scratch.points, _BELOW + 3 * i))
    if abs(slope) <= LEVEL * largest_component(d):
        store(row, SLACK, EDGE)
        return True
    return code & KNOWN == 0 or above == (code & ABOVE != 0)


@kernel
def _start_on_edge(scratch, i, d, row):
    """``start_ray`` for a point on or near an edge, whose start is written."""
    begin, stop = load(scratch.numbers, _TABLE + i), OPEN
    if np.int64(load(row, CODE)) & KNOWN != 0:
        stop = UNSURE
        if begin >= 0:
            stop = stop_of(offset(scratch.points, _FAN + begin), d, make_holders(scratch.trace.holders))
    if stop == OPEN:
        # Nothing is left to be decided at the start.
        store(row, CODE, np.float64(np.int64(load(row, CODE)) & BARYCENTRIC))
        if load(scratch.numbers, _CORNER + i) != 0:
            store(row, SLACK, CORNER)
    return stop != STOPPED


@inlined
def look(places, sky, scratch, i, given, weight):
    """The direction in which a tile's i-th point looks, its height above the point's horizon, and what it adds, for a
    direction of the sky and its value.
    """
    d, height, value = given, 1.0, weight
    if sky.turned:
        frame = offset(scratch.points, _FRAME + 9 * i)
        across = add(scale(row3(frame, 0), given[0]), scale(row3(frame, 1), given[1]))
        d, height = add(across, scale(row3(frame, 2), given[2])), given[2]
    elif len(places.normals) > 0:
        height = dot(three(scratch.points, _FRAME + 9 * i + 6), given)
    if sky.cosine:
        # rule: cosine-weight
        value *= abs(height)
    return d, height, value


@kernel
def _aim(places, sky, scratch, k, count, listed, rays):
    """List a tile's ``count`` points with direction ``k``, after the entries and rays that are listed already.

    Returns the entries and rays with them. What is below the horizon of a point, or behind its face, has no ray.
    """
    given, weight, limit = row3(pointer(sky.directions), k), sky.values[k], sky.limits[k]
    for i in range(count):
        d, height, value = look(places, sky, scratch, i, given, weight)
        store(scratch.points, WHOLE + i, load(scratch.points, WHOLE + i) + value)
        # rule: open-above-horizon
        seen = height > 0.0 and start_ray(scratch, i, d, rays)
        if seen:
            put3(scratch.directions, 3 * rays, d)
            store(scratch.limits, rays, limit)
        store(scratch.values, listed, value)
        store(scratch.listed, listed, (k * TILE + i) * 2 + np.int64(seen))
        listed += 1
        rays += np.int64(seen)
    return listed, rays


@kernel
def _take_down(answers, scratch, listed):
    """Take down what the listed points see, once their rays are traced: for each point in the order of directions."""
    ray = np.int64(0)
    for entry in range(listed):
        code, hides = load(scratch.listed, entry), True
        if code & 1 != 0:
            hides = load(scratch.found.hit, ray)
            ray += 1
        k, i = (code >> 1) // TILE, (code >> 1) % TILE
        if hides == answers.hidden:
            store(scratch.points, SUM + i, load(scratch.points, SUM + i) + load(scratch.values, entry))
        if hides and len(answers.bits) > 0:
            row = load(scratch.numbers, _ROW + i)
            answers.bits[row, k >> 3] |= np.uint8(0x80 >> (k & 7))


@kernel
def end_tile(answers, scratch, count):
    """Write the sums of a tile's points."""
    if len(answers.sums) == 0:
        return
    for i in range(count):
        total, whole = load(scratch.points, SUM + i), load(scratch.points, WHOLE + i)
        # Nothing counts where all directions lie in the horizon of a point that weighs them by the cosine.
        answers.sums[load(scratch.numbers, _ROW + i)] = total / whole if answers.share and whole > 0.0 else total


@inlined
def _trace(tree, scratch, rays, together):
    """Find which rays hit anything; ``together`` says that they are those of one direction."""
    starts = StartPointers(scratch.starts, ROW, scratch.vertices, scratch.faces)
    origins, directions, zero, limits = scratch.origins, scratch.directions, scratch.zero, scratch.limits
    batch = RayPointers(origins, directions, zero, limits, 3, 3, 0, 1, tree.scale, starts)
    if together and rays > 0:
        if trace_parallel(tree, batch, scratch.found, rays, scratch.trace, scratch.parallel):
            return
        store(scratch.numbers, _LEFT, load(scratch.numbers, _LEFT) - 1)
    trace_rays(tree, batch, scratch.found, rays, scratch.trace, np.bool_(True))


@kernel
def _tile_from(rows, steps, begin):
    """The number of points of the tile that begins there: with steps given, up to the longest step of the curve."""
    count = minimum(np.int64(TILE), len(rows) - begin)
    if begin + count >= len(steps):
        return count
    longest, end = steps[begin + count], count
    for i in range(_LEAST_TILE, count):
        if steps[begin + i] > longest:
            longest, end = steps[begin + i], i
    return end


@kernel
def sweep(descriptor, vertices, faces, places, sky, answers, rows, steps, begin, k, arrays):
    """Let the points in ``rows``, one tile after the other, look in all directions; some rays more with each call.

    descriptor  that of the tree over ``vertices`` and ``faces``
    steps       those of the curve to the rows; none where the points are too far apart for their rays to be traced
                together
    begin, k    where the tile under way begins, and its next direction: 0, 0 in the first call, and later what the
                last one returned, with the same ``arrays``, a ``SweepScratch``

    All is done at (len(rows), 0).
    """
    tree, scratch = tree_pointers(descriptor), sweep_pointers(arrays, vertices, faces)
    count = _tile_from(rows, steps, begin)
    if k == 0:
        begin_tile(tree, places, rows, begin, count, scratch)
    traced, parallel = np.int64(0), len(steps) > 0 and tree.has_nodes and not sky.turned and count >= _TOGETHER
    while k < len(sky.values) and traced < RAYS_A_CALL:
        together = parallel and load(scratch.numbers, _LEFT) > 0
        listed, rays, most = np.int64(0), np.int64(0), count if together else np.int64(RAYS)
        while k < len(sky.values) and listed + count <= most:
            listed, rays = _aim(places, sky, scratch, k, count, listed, rays)
            k += 1
        _trace(tree, scratch, rays, together)
        _take_down(answers, scratch, listed)
        traced += listed
    if k < len(sky.values):
        return begin, k
    end_tile(answers, scratch, count)
    return begin + count, np.int64(0)
