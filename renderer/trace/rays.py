"""Batches of rays and their hits as kernels read and write them; the range check of rays."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.limits import FARTHEST, FLATTEST, LONGEST, SHORTEST
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.kinds import of_none
from renderer.numerics.simd import (
    address,
    bool_pointer,
    broadcast_like,
    counting8,
    fabs,
    float64_pointer,
    gather8,
    int64_pointer,
    load,
    load_strided8,
    maximum,
    minimum,
    movemask,
    offset,
    pointer,
    select,
    store,
)
from renderer.trace.best import side_of
from renderer.trace.intersect import Ray
from renderer.trace.layout import WORD_BYTES
from renderer.trace.starts.record import ALL, FACE, SLACK, no_start, start_pointers, start_row

_MOST, _TINIEST = np.finfo(np.float64).max, 2.0**-1074
# Rows of the array that closest hits are written to.
HIT_ROWS = 6


class RayPointers(NamedTuple):
    """Pointers to rows of origins and directions, and to t_min and t_max.

    Each has a step from one ray to the next, 0 where all share one. ``scale`` is the tree's, a power of two, so t is
    converted exactly. ``starts`` are those of the rays that start on the surface, or None.
    """

    origins: Any
    directions: Any
    t_min: Any
    t_max: Any
    origin_step: int
    direction_step: int
    min_step: int
    max_step: int
    scale: float
    starts: Any


class HitArrays(NamedTuple):
    """The arrays of ``HitPointers``; those that a query does not write are empty."""

    t: NDArray[np.float64]
    face: NDArray[np.int64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    side: NDArray[np.int64]
    pile: NDArray[np.int64]
    hit: NDArray[np.bool_]


class HitPointers(NamedTuple):
    """Pointers to the results: t, face, u, v and side as in ``Hits``, the first of the coinciding faces that the ray
    reached; for any hits only ``hit``, a bool.
    """

    t: Any
    face: Any
    u: Any
    v: Any
    side: Any
    pile: Any
    hit: Any


@inlined
def ray_pointers(origins, directions, t_min, t_max, starts, scale):
    """``RayPointers`` of the arrays of a ``RayBatch``; ``starts`` are pointers."""
    return RayPointers(
        pointer(origins), pointer(directions), pointer(t_min), pointer(t_max),
        3 * np.int64(len(origins) > 1), 3 * np.int64(len(directions) > 1), np.int64(len(t_min) > 1),
        np.int64(len(t_max) > 1), scale, starts,
    )  # fmt: skip


@inlined
def batch_pointers(rays, scale):
    """``RayPointers`` of a ``RayBatch``."""
    origins, directions, t_min, t_max, starts = rays
    return ray_pointers(origins, directions, t_min, t_max, start_pointers(starts), scale)


@inlined
def found_pointers(t, face, u, v, side, pile, hit):
    """``HitPointers`` of the arrays of a ``HitArrays``."""
    return HitPointers(pointer(t), pointer(face), pointer(u), pointer(v), pointer(side), pointer(pile), pointer(hit))


@inlined
def hit_pointers(out, count):
    """``HitPointers`` into the memory of ``out``: rows t, u, v, face, side and pile of ``count``
    values, or ``count`` bools."""
    first, row = address(out), WORD_BYTES * count
    return HitPointers(
        float64_pointer(first), int64_pointer(first + 3 * row), float64_pointer(first + row),
        float64_pointer(first + 2 * row), int64_pointer(first + 4 * row), int64_pointer(first + 5 * row),
        bool_pointer(first),
    )  # fmt: skip


@kernel
def first_bad_ray(rays, begin, end):
    """The row of the first ray of a range that is out of bounds, or -1.

    In bounds means: components of ``scale`` times the origin up to FARTHEST, and a largest component of the direction
    from SHORTEST to LONGEST. NaN is out of bounds.
    """
    i = begin
    # Eight at a time; those among which one is out of bounds, and the last ones, one by one.
    while i < end:
        if i + 8 <= end and _are_good(rays, i):
            i += 8
            continue
        for j in range(i, minimum(i + 8, end)):
            if not _is_good(rays, j):
                return j
        i += 8
    return -1


@inlined
def _are_good(rays, i):
    """Whether the eight rays from ``i`` on are in bounds. A comparison with NaN is false."""
    o, s, d, z = rays.origins, rays.origin_step, rays.directions, rays.direction_step
    x, y, w = load_strided8(o, i * s, s), load_strided8(o, i * s + 1, s), load_strided8(o, i * s + 2, s)
    near = (fabs(x) * rays.scale <= FARTHEST) & (fabs(y) * rays.scale <= FARTHEST)
    near = near & (fabs(w) * rays.scale <= FARTHEST)
    x, y, w = load_strided8(d, i * z, z), load_strided8(d, i * z + 1, z), load_strided8(d, i * z + 2, z)
    x, y, w = fabs(x), fabs(y), fabs(w)
    good = near & (x <= LONGEST) & (y <= LONGEST) & (w <= LONGEST)
    # rule: range-of-eight
    return movemask(good & (maximum(maximum(x, y), w) >= SHORTEST)) == 0xFF


@inlined
def _is_good(rays, i):
    far, largest, odd = 0.0, 0.0, 0.0
    for k in range(3):
        o, d = load(rays.origins, i * rays.origin_step + k), load(rays.directions, i * rays.direction_step + k)
        far, largest = maximum(far, abs(o)), maximum(largest, abs(d))
        # A NaN is never larger, but x - x is NaN for NaN and inf, and 0 otherwise.
        odd += (o - o) + (d - d)
    return odd == 0.0 and far * rays.scale <= FARTHEST and SHORTEST <= largest <= LONGEST


@inlined
def ray_at(rays, i):
    """Ray ``i`` in the tree's units, and its t_max."""
    o, d = offset(rays.origins, i * rays.origin_step), offset(rays.directions, i * rays.direction_step)
    origin, direction = (load(o, 0), load(o, 1), load(o, 2)), (load(d, 0), load(d, 1), load(d, 2))
    return _scaled(
        origin, direction, load(rays.t_min, i * rays.min_step), load(rays.t_max, i * rays.max_step), rays.scale,
        *start_row(rays.starts, i),
    )  # fmt: skip


@inlined
def eight_rays_at(rays, numbers):
    """``ray_at`` of the eight rays numbered at ``numbers``, as vectors; without what only ``Ways.begin`` reads."""
    o, d, s, z = rays.origins, rays.directions, rays.origin_step, rays.direction_step
    origin = gather8(o, numbers, s, 0), gather8(o, numbers, s, 1), gather8(o, numbers, s, 2)
    direction = gather8(d, numbers, z, 0), gather8(d, numbers, z, 1), gather8(d, numbers, z, 2)
    # rule: ends-of-eight
    t_min, t_max = _often_one(rays.t_min, numbers, rays.min_step, 0), _often_one(rays.t_max, numbers, rays.max_step, 0)
    slack, leaving = of_none(rays.starts, no_start, starts8)(rays.starts, numbers)
    slack, leaving = broadcast_like(slack, t_min), broadcast_like(leaving, t_min)
    return _scaled(origin, direction, t_min, t_max, rays.scale, slack, leaving, ALL, -1.0)


@inlined
def _often_one(base, numbers, step, column):
    """``gather8`` for rows that all rays often share."""
    first = gather8(base, numbers, 0, column)
    return gather8(base, numbers, step, column) if step != 0 else first


@inlined
def starts8(starts, numbers):
    """Slack and face, as in ``Ray``, of the eight rays numbered at ``numbers``."""
    rows, step = starts.rows, starts.step
    return _often_one(rows, numbers, step, SLACK), _often_one(rows, numbers, step, FACE)


@inlined
def _scaled(origin, direction, t_min, t_max, scale, slack, leaving, mask, ignored):
    """Rays in the tree's units, given its ``scale``, and their t_max."""
    # A t_min above 0 stays above 0 in the tree's units too, so that a hit at the origin is still too near.
    t_min = select(t_min > 0.0, maximum(t_min * scale, _TINIEST), t_min)
    dx, dy, dz = direction
    least = maximum(fabs(dx), maximum(fabs(dy), fabs(dz))) * FLATTEST
    dx, dy, dz = _or_zero(dx, least), _or_zero(dy, least), _or_zero(dz, least)
    ray = Ray(origin[0] * scale, origin[1] * scale, origin[2] * scale, dx, dy, dz, t_min, slack, leaving, mask, ignored)
    # A hit whose t is beyond the largest float64, in either unit, is none.
    return ray, minimum(minimum(t_max, _MOST) * scale, _MOST)


@inlined
def _or_zero(x, least):
    """A component of a direction; a zero of its sign if it is below ``least``."""
    return select(fabs(x) < least, x * 0.0, x)


@inlined
def write_misses(found, begin, end, any_hit):
    """Write that the rays from ``begin`` to ``end`` hit nothing, before they are traced."""
    i, none = begin, counting8(0, 0)
    while i + 8 <= end and not any_hit:
        _write_miss(found, i, none)
        i += 8
    while i < end:
        if any_hit:
            store(found.hit, i, False)
        else:
            _write_miss(found, i, 0.0)
        i += 1


@inlined
def _write_miss(found, i, like):
    """Write a miss for ray ``i``; or eight from it on, if ``like`` is a vector."""
    store(found.t, i, broadcast_like(np.inf, like))
    store(found.u, i, broadcast_like(np.nan, like))
    store(found.v, i, broadcast_like(np.nan, like))
    store(found.face, i, broadcast_like(np.int64(-1), like))
    # In this order, as those that keep no piles give the sides' memory for them.
    store(found.pile, i, broadcast_like(np.int64(-1), like))
    store(found.side, i, broadcast_like(np.int64(0), like))


@inlined
def write_hit(found, i, scale, best, dz, any_hit):
    """Write the ``Best`` hit of ray ``i``, or with ``any_hit`` only that there is one.

    ``dz`` is the ray's ``Shear.direction_z``: with the sign of w it gives the side of the face that the ray came from.
    """
    if any_hit:
        store(found.hit, i, True)
        return
    # + 0.0 turns -0.0 into 0.0.
    # rule: t-in-mesh-units
    store(found.t, i, best.t / scale + 0.0)
    store(found.face, i, np.int64(best.face))
    store(found.u, i, best.u / best.w + 0.0)
    store(found.v, i, best.v / best.w + 0.0)
    # The pile first, as in ``write_misses``.
    store(found.pile, i, np.int64(best.face))
    store(found.side, i, np.int64(side_of(best.w, dz)))
