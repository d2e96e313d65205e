"""The closest hit of a ray from its exact start on the surface.

The faces that contain the start do not stop the ray by rounding: ``region`` decides whether one stops it at t = 0.
Faces near the start are tested from the exact start, all others from its coordinates.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import apart, inlined, kernel
from renderer.numerics.double_double import as_pairs, cross_pairs, dot_pairs, power_below, quotient, scaled_difference
from renderer.numerics.simd import local_doubles, lowest_bit, maximum, pointer, store
from renderer.numerics.vec3 import add, largest_component, sub
from renderer.trace.best import NO_FACE, Best, FaceHit, hit_on, is_better, no_hit
from renderer.trace.edge_signs import corners_at
from renderer.trace.intersect import (
    CORNER,
    Ray,
    face_in,
    hit_triangles,
    make_shear,
    near_start,
    see_triangles,
    slack_of,
)
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.leaf import resolved_hit
from renderer.trace.single_ray import Found, SingleRay, enter_counted, prepare_single
from renderer.trace.starts.anchor import anchor_of, from_anchor, rounded
from renderer.trace.starts.arcs import arcs_of
from renderer.trace.starts.around import enter_around, hold_sign
from renderer.trace.starts.cone import NUMBER, PLACE, add_holder, cone_of, holder, make_holders
from renderer.trace.starts.fan import clear_fan, write_fan
from renderer.trace.starts.meeting import (
    barycentrics_of,
    meet_face,
    seen_from,
    slope_of,
    slope_there,
    unit_direction,
    zeros_if_held,
)
from renderer.trace.starts.record import (
    ABOVE,
    ALL,
    ANCHOR,
    BACK,
    BARYCENTRIC,
    CODE,
    EDGE,
    FACE,
    KNOWN,
    THROUGH,
    StartPointers,
    corners_in,
    start_at,
    way_back,
)
from renderer.trace.starts.region import (
    NOT_STOPPED,
    Behind,
    are_one_plane,
    bounding_holder,
    holder_of,
    stopping_holder,
)
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import always, walk, walk_nearest_first

# The boxes of the faces that hold a start hold it as rounded, with so much room of its coordinates.
_ROOM = 2.0**-50
# The t of a hit on the next face of a pile, which differs from others at t = 0 by its sign.
AHEAD = -0.0
# The least t of a face that does not hold the start: what is less would be 0 in the mesh's own units.
_LEAST_T = 2.0**-900
# A hit that is farther than so often its slack errs by less than 2^-20 of t by where the ray starts.
_NEAR_HIT = 2.0**20


class _Surroundings(NamedTuple):
    """The search for faces around a start: the anchor, also as rounded; the room around that, and the box of both; the
    list of faces that contain the anchor; and mask and instance ignored, as of ``intersect.Ray``.
    """

    anchor: Any
    o: Any
    room: float
    low: Any
    high: Any
    holders: Any
    mask: float
    ignored: float


@kernel
def list_holders(tree, anchor, stack, holders, mask, ignored):
    """List the faces that contain an anchor and that a ray from there may hit. Returns their number."""
    o = rounded(anchor)
    room = largest_component(o) * _ROOM
    low, high = sub(o, (room, room, room)), add(o, (room, room, room))
    query = _Surroundings(anchor, o, room, low, high, holders, mask, ignored)
    return walk(tree, stack, query, np.int64(0), enter_around, _add_holders)


@kernel
def _add_holders(tree, query, first, blocks, count):
    """List the faces of some blocks that contain an anchor."""
    # rule: holders-of-mask
    if not tree.ways.may_hit(tree, first, query.mask, query.ignored):
        return count, False
    for block in range(first, first + blocks):
        for i in range(BLOCK_FACES):
            face, place = face_in(tree, block * BLOCK_FACES + i), block * BLOCK_WORDS + i
            if face >= 0 and hold_sign(corners_at(tree, place), query.o, query.room) >= 0:
                zeros = zeros_if_held(seen_from(tree, place, query.anchor), query.anchor)
                if zeros >= 0:
                    count = add_holder(query.holders, count, place, face, zeros)
    return count, False


@kernel
def _stopped(tree, behind, anchor, count, d, slope, dz, holders):
    """The ``Best`` hit that stops a ray at its start, which ``count`` faces contain."""
    if slope != 0 and not behind.through and are_one_plane(tree, anchor, holders, count, behind.face, d, slope):
        return _stop_at(tree, holders, 0, anchor, d, slope, dz, 0.0) if slope == -behind.side else no_hit(np.inf)
    arcs, number, nodes = arcs_of(tree, anchor, holders, count)
    k, ahead = stopping_holder(tree, anchor, arcs, number, nodes, behind, d)
    if k == NOT_STOPPED:
        return no_hit(np.inf)
    return _stop_at(tree, arcs, k, anchor, d, slope, dz, AHEAD if ahead else 0.0)


@kernel
def _stop_at(tree, arcs, k, anchor, d, slope, dz, t):
    """The ``Best`` hit of the k-th of the faces that contain a start."""
    met = meet_face(seen_from(tree, holder(arcs, k, PLACE), anchor), anchor, d, slope, dz)
    return Best(t, np.int32(holder(arcs, k, NUMBER)), met.u, met.v, met.w)


class Departure(NamedTuple):
    """A ray at its start: as ``intersect.Ray``, its anchor, its direction scaled by a power of two, the ``slope_there``
    of that, and the power; whether its origin is off the anchor; and, if it may be stopped, the number of faces that
    contain the start.
    """

    ray: Any
    anchor: Any
    d: Any
    slope: int
    unit: float
    is_off: bool
    holders: int


@apart
def depart(tree, starts, i, ray, stack, memory):
    """The ``Departure`` of ray ``i``, and the ``Best`` hit that stops it at its start.

    ``ray`` is from ``rays.ray_at``. ``stack`` is memory for ``walk.stack_size`` int64, and ``memory`` for
    ``cone.HOLDERS_WORDS``.
    """
    start = start_at(tree, starts, i)
    anchor = anchor_of(start)
    o, (d, unit) = rounded(anchor), unit_direction((ray.dx, ray.dy, ray.dz))
    at_corner = ray.slack == CORNER
    if at_corner or ray.slack == EDGE:
        ray = Ray(
            o[0], o[1], o[2], ray.dx, ray.dy, ray.dz, ray.t_min, slack_of(o, 0.0), ray.leaving, ray.mask, ray.ignored
        )
    stopped, slope, count = no_hit(np.inf), slope_there(anchor, d), 0
    if start.code & KNOWN != 0 and ray.t_min == 0.0:
        dz, holders = make_shear(ray).direction_z, make_holders(memory)
        count = list_holders(tree, anchor, stack, holders, ray.mask, ray.ignored)
        # rule: side-of-start
        behind = Behind(
            start.face, 1 if start.code & ABOVE != 0 else -1, start.code & THROUGH != 0, np.int64(start.anchor[2]),
            start.code & BACK != 0, way_back(starts, i),
        )  # fmt: skip
        stopped = _stopped(tree, behind, anchor, count, d, slope, dz, holders)
    return Departure(ray, anchor, d, slope, unit, not at_corner, count), stopped


@apart
def stopped_again(tree, departure, face, pile, memory):
    """The hit that stops a ray at its start after it went through ``face`` there; otherwise as ``depart``, with the
    same ``memory``. ``pile`` is the first of the faces that coincide with it.
    """
    anchor, d, holders, dz = departure.anchor, departure.d, make_holders(memory), make_shear(departure.ray).direction_z
    side = slope_of(cone_of(tree, anchor, holders, holder_of(holders, departure.holders, face)).face, d)
    behind = Behind(face, side, True, pile, False, d)
    return _stopped(tree, behind, anchor, departure.holders, d, departure.slope, dz, holders)


@inlined
def near_bits(tree, block, departure, shear, seen):
    """``near_start`` of the faces of a block."""
    if not departure.is_off and seen == 0:
        return np.int64(0)
    edges, _ = see_triangles(tree, block * BLOCK_WORDS, shear)
    return near_start(edges, seen, departure.ray.slack, departure.is_off)


@inlined
def meet_near(tree, place, departure, dz):
    """The ``FaceHit`` of a face tested from the exact start, and its ``Meeting.zeros``."""
    met = meet_face(seen_from(tree, place, departure.anchor), departure.anchor, departure.d, departure.slope, dz)
    t = met.t / departure.unit
    return FaceHit(_LEAST_T if t < _LEAST_T else t, met.u, met.v, met.w), met.zeros


@kernel
def _nearest_from(tree, first, count, departure, shear, best):
    """``leaf.nearest_carefully`` for a ray that leaves the surface."""
    ray = departure.ray
    for block in range(first, first + count):
        hits = hit_triangles(tree, block * BLOCK_WORDS, shear, ray.t_min, best.t)
        near = near_bits(tree, block, departure, shear, hits.bits)
        bits = hits.bits | near
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            face = face_in(tree, block * BLOCK_FACES + i)
            if np.float64(face) == ray.leaving:
                continue
            if (near >> i) & 1 != 0:
                hit, _ = meet_near(tree, block * BLOCK_WORDS + i, departure, shear.direction_z)
            else:
                hit = resolved_hit(tree, block, hits, i, ray, shear)
            if is_better(hit.t, face, ray.t_min, best):
                best = hit_on(face, hit)
    return best


class _Query(NamedTuple):
    """A ray that leaves a surface, whether any hit ends its walk, and the stack of that."""

    departure: Departure
    single: SingleRay
    any_hit: bool
    stack: Any


@kernel
def search_from(tree, starts, i, ray, t_max, stack, memory, any_hit):
    """The closest hit of ray ``i`` from its start, or with ``any_hit`` any one, as ``Found``.

    Arguments as for ``depart``; ``t_max`` is the ray's own.
    """
    departure, stopped = depart(tree, starts, i, ray, stack, memory)
    if stopped.face != NO_FACE:
        return Found(stopped, np.int64(1))
    query = _Query(departure, prepare_single(departure.ray), any_hit, stack)
    return walk_nearest_first(tree, stack, query, Found(no_hit(t_max), np.int64(1)), always, enter_counted, _visit)


@inlined
def _visit(tree, query, first, count, found):
    best = _nearest_from(tree, first, count, query.departure, query.single.shear, found.best)
    return Found(best, found.steps + count), query.any_hit and best.face != NO_FACE


@apart
def t_from(tree, starts, i, ray, face, t):
    """t from the exact start for the plane of a face that the ray hits at t."""
    anchor, (d, unit) = anchor_of(start_at(tree, starts, i)), unit_direction((ray.dx, ray.dy, ray.dz))
    p0, p1, p2 = corners_in(tree, starts, face)
    side = maximum(largest_component(sub(p1, p0)), largest_component(sub(p2, p0)))
    factor = 1.0 / power_below(side)
    normal = cross_pairs(scaled_difference(p1, p0, factor), scaled_difference(p2, p0, factor))
    far = 1.0 / power_below(maximum(largest_component(sub(p0, rounded(anchor))), 1.0 / factor))
    exact = quotient(dot_pairs(normal, from_anchor(anchor, p0, far)), dot_pairs(normal, as_pairs(d)))[0] / far / unit
    return exact if exact > 0.0 and abs(exact - t) <= t else t


@inlined
def is_near_start(slack, distance):
    """Whether a hit is so near that the way that its ray's origin was moved is a part of t."""
    return 0.0 < slack < EDGE and distance <= _NEAR_HIT * slack


@inlined
def counted_from_start(tree, starts, i, ray, largest, hit, face):
    """A ``FaceHit`` with t counted from the exact start of ray ``i``."""
    if is_near_start(ray.slack, hit.t * largest):
        return FaceHit(t_from(tree, starts, i, ray, face, hit.t), hit.u, hit.v, hit.w)
    return hit


@apart
def take_side(tree, starts, n, stack, memory, table, room):
    """Write to the row of a start the side of its face that the normal n selects; or the side of another face, if its
    own does not bound that region. Also write its ``fan`` to ``table``, if ``room`` float64 suffice. If n selects
    nothing, the row stays.
    """
    start, holders = start_at(tree, starts, 0), make_holders(memory)
    anchor, (d, _) = anchor_of(start), unit_direction(n)
    slope = slope_there(anchor, d)
    count = list_holders(tree, anchor, stack, holders, ALL, -1.0)
    arcs, number, nodes = arcs_of(tree, anchor, holders, count)
    k, side = bounding_holder(tree, anchor, arcs, number, nodes, d, start.face)
    clear_fan(table)
    if k == NOT_STOPPED:
        return
    write_fan(tree, anchor, arcs, number, nodes, k, side, table, room)
    row = starts.rows
    # rule: side-of-normal
    store(row, CODE, np.float64(start.code | KNOWN | BACK | (ABOVE if side > 0 else 0)))
    if holder(arcs, k, NUMBER) == start.face:
        return
    store(row, FACE, np.float64(holder(arcs, k, NUMBER)))
    # A point is on both faces, but barycentrics are those of one.
    if start.code & BARYCENTRIC != 0:
        met = meet_face(seen_from(tree, holder(arcs, k, PLACE), anchor), anchor, d, slope, 1.0)
        u, v = barycentrics_of(met)
        store(row, ANCHOR, u)
        store(row, ANCHOR + 1, v)
        store(row, ANCHOR + 2, 0.0)


@kernel
def side_taken(descriptor, vertices, faces, row, n, stack, memory):
    """``take_side`` for Python, for a start in a row of ``starts.record``."""
    starts = StartPointers(pointer(row), 0, pointer(vertices), pointer(faces))
    take_side(tree_pointers(descriptor), starts, n, pointer(stack), pointer(memory), local_doubles(), 0)
