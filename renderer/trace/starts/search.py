"""The closest hit of a ray from its exact start on the surface.

The faces that hold the start do not stop the ray by rounding: ``region`` says whether one stops it at t = 0. Those near
the start are met from the exact start, all others from its coordinates.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import as_pairs, cross_pairs, dot_pairs, power_below, quotient, scaled_difference
from renderer.numerics.simd import extract, get, larger, local_doubles, lowest_bit, pointer, put, smaller, splat8
from renderer.numerics.vec3 import add, largest_component, sub
from renderer.trace.edge_signs import corner
from renderer.trace.intersect import (
    CORNER,
    Ray,
    box_limit,
    enter_boxes,
    hit_triangles,
    largest_of,
    make_shear,
    make_slabs,
    near_planes,
    round_down,
    see_triangles,
    unsure_sides,
)
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.leaf import NO_FACE, blocks_of, is_better, octants_around, push_children, tree_pointers
from renderer.trace.resolve import settled
from renderer.trace.starts.anchor import anchor_of, from_anchor, rounded
from renderer.trace.starts.arcs import arcs_of
from renderer.trace.starts.cone import NUMBER, PLACE, add_holder, cone_of, holder, make_holders
from renderer.trace.starts.fan import clear_fan, write_fan
from renderer.trace.starts.meeting import (
    HOLDS,
    IS_HIT,
    barycentrics_of,
    meet_face,
    seen_from,
    slope_of,
    slope_there,
    unit_direction,
)
from renderer.trace.starts.record import (
    ABOVE,
    ANCHOR,
    BACK,
    BARYCENTRIC,
    CODE,
    EDGE,
    FACE,
    KNOWN,
    THROUGH,
    StartPointers,
    corners_of,
    slack_of,
    start_at,
    way_back,
)
from renderer.trace.starts.region import NOT_STOPPED, Behind, bounding_holder, holder_of, stopping_holder

# The boxes of the faces that hold a start hold it as rounded, with so much room of its coordinates.
_ROOM = 2.0**-50
# The t of a hit on the next face of a pile, which differs from others at t = 0 by its sign.
AHEAD = -0.0
# The least t of a face that does not hold the start: what is less would be 0 in the mesh's own units.
_LEAST_T = 2.0**-900
# A hit that is farther than so often its slack errs by less than 2^-20 of t by where the ray starts.
NEAR_HIT = 2.0**20
_NOTHING = (np.inf, np.int32(NO_FACE), 0.0, 0.0, 1.0)


@inlined
def _box_holds(tree, place, o):
    """Whether the box of a face, with _ROOM, holds a point."""
    p0, p1, p2 = corner(tree, place), corner(tree, place + 12), corner(tree, place + 24)
    holds, room = True, largest_component(o) * _ROOM
    for k in range(3):
        low, high = smaller(p0[k], smaller(p1[k], p2[k])), larger(p0[k], larger(p1[k], p2[k]))
        holds = holds and low - room <= o[k] and o[k] <= high + room
    return holds


@kernel
def list_holders(tree, anchor, d, slope, dz, stack, holders):
    """List the faces that hold an anchor, from which a ray leaves in direction d; returns their number."""
    o, count, top = rounded(anchor), 0, 1
    room = largest_component(o) * _ROOM
    low, high = sub(o, (room, room, room)), add(o, (room, room, room))
    if not tree.has_nodes:
        return _add_holders(tree, 0, tree.count, anchor, o, d, slope, dz, holders, count)
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            first, blocks = blocks_of(child)
            count = _add_holders(tree, first, blocks, anchor, o, d, slope, dz, holders, count)
            continue
        top = push_children(tree, child, octants_around(tree, child, low, high), stack, top)
    return count


@kernel
def _add_holders(tree, first, blocks, anchor, o, d, slope, dz, holders, count):
    """List those faces of some blocks that hold an anchor."""
    for block in range(first, first + blocks):
        for i in range(BLOCK_FACES):
            face, place = get(tree.faces, block * BLOCK_FACES + i), block * BLOCK_WORDS + i
            if face >= 0 and _box_holds(tree, place, o):
                met = meet_face(seen_from(tree, place, anchor), anchor, d, slope, dz)
                if met.kind == HOLDS:
                    count = add_holder(tree, holders, count, place, face, met.zeros)
    return count


@kernel
def _stopped(tree, behind, anchor, count, d, slope, dz, holders):
    """The hit (t, face, u, v, w) that stops a ray at its start, which ``count`` faces hold; NO_FACE for none."""
    arcs, number, nodes = arcs_of(tree, anchor, holders, count)
    k, ahead = stopping_holder(tree, anchor, arcs, number, nodes, behind, d)
    if k == NOT_STOPPED:
        return _NOTHING
    met = meet_face(seen_from(tree, holder(arcs, k, PLACE), anchor), anchor, d, slope, dz)
    return AHEAD if ahead else 0.0, np.int32(holder(arcs, k, NUMBER)), met.u, met.v, met.w


class Departure(NamedTuple):
    """A ray as it leaves its start: as ``intersect.Ray``, its anchor, its direction scaled by a power of two, the
    ``slope_there`` of that, and the power; whether its origin is off the anchor; and of a ray that
    may be stopped how many faces hold the start.
    """

    ray: Any
    anchor: Any
    d: Any
    slope: int
    unit: float
    is_off: bool
    holders: int


@kernel
def depart(tree, starts, i, ray, stack, memory):
    """The ``Departure`` of ray ``i``, and the hit that stops it at its start, of NO_FACE for none.

    ``ray`` is as ``rays.ray_at`` has it. ``stack`` is memory for ``singly.stack_size`` int64, and ``memory`` for
    ``cone.HOLDERS_WORDS``.
    """
    start = start_at(starts, i, tree.scale)
    anchor = anchor_of(start)
    o, (d, unit) = rounded(anchor), unit_direction((ray.dx, ray.dy, ray.dz))
    at_corner = ray.slack == CORNER
    if at_corner or ray.slack == EDGE:
        ray = Ray(o[0], o[1], o[2], ray.dx, ray.dy, ray.dz, ray.t_min, slack_of(o, 0.0), ray.leaving)
    stopped, slope, count = _NOTHING, slope_there(anchor, d), 0
    if start.code & KNOWN != 0 and ray.t_min == 0.0:
        dz, holders = make_shear(ray).direction_z, make_holders(memory)
        count = list_holders(tree, anchor, d, slope, dz, stack, holders)
        # rule: side-of-start
        behind = Behind(
            start.face, 1 if start.code & ABOVE != 0 else -1, start.code & THROUGH != 0, np.int64(start.anchor[2]),
            start.code & BACK != 0, way_back(starts, i),
        )  # fmt: skip
        stopped = _stopped(tree, behind, anchor, count, d, slope, dz, holders)
    return Departure(ray, anchor, d, slope, unit, not at_corner, count), stopped


@kernel
def stopped_again(tree, departure, face, pile, memory):
    """The hit that stops a ray at its start once it went through ``face`` there, which stopped it; as of ``depart``,
    with the same ``memory``. ``pile`` is the first face of those that coincide with it.
    """
    anchor, d, holders, dz = departure.anchor, departure.d, make_holders(memory), make_shear(departure.ray).direction_z
    side = slope_of(cone_of(tree, anchor, holders, holder_of(holders, departure.holders, face)).face, d)
    behind = Behind(face, side, True, pile, False, d)
    return _stopped(tree, behind, anchor, departure.holders, d, departure.slope, dz, holders)


@inlined
def near_bits(tree, block, departure, shear, seen):
    """The bits of the faces of a block that are met from the exact start: those near it, and where the origin is off it
    those of which that may have made the side that the ray passes on. So all are judged from one start.
    """
    if not departure.is_off and seen == 0:
        return np.int64(0)
    edges, _ = see_triangles(tree, block * BLOCK_WORDS, shear)
    near = seen & near_planes(edges, departure.ray.slack)
    return near | unsure_sides(edges, departure.ray.slack) if departure.is_off else near


@inlined
def meet_near(tree, place, departure, dz):
    """The hit (t, u, v, w) of a face that is met from the exact start, t = NaN for none, and its ``Meeting.zeros``."""
    met = meet_face(seen_from(tree, place, departure.anchor), departure.anchor, departure.d, departure.slope, dz)
    # rule: met-once
    t = larger(met.t / departure.unit, _LEAST_T) if met.kind == IS_HIT else np.nan
    return (t, met.u, met.v, met.w), met.zeros


@kernel
def _nearest_from(tree, first, count, departure, shear, best):
    """``leaf.nearest_carefully`` for a ray that leaves the surface."""
    ray = departure.ray
    for block in range(first, first + count):
        base = block * BLOCK_WORDS
        bits, doubts, blurred, _, t4, u4, v4, w4 = hit_triangles(tree, base, shear, ray.t_min, best[0])
        near = near_bits(tree, block, departure, shear, bits)
        bits |= near
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            face = get(tree.faces, block * BLOCK_FACES + i)
            if np.float64(face) == ray.leaving:
                continue
            if (near >> i) & 1 != 0:
                hit, _ = meet_near(tree, base + i, departure, shear.direction_z)
            else:
                hit = extract(t4, i), extract(u4, i), extract(v4, i), extract(w4, i)
                if (doubts >> i) & 1 != 0:
                    hit = settled(tree, base + i, ray, shear, hit, (blurred >> i) & 1 != 0)
            if is_better(hit[0], face, ray, best):
                best = hit[0], face, hit[1], hit[2], hit[3]
    return best


@kernel
def search_from(tree, starts, i, ray, t_max, stack, memory, any_hit):
    """The closest hit (t, face, u, v, w) of ray ``i`` from its start, NO_FACE for none; with ``any_hit`` any one.

    Arguments as for ``depart``; ``t_max`` is the ray's own. Also returns the number of nodes and blocks that it took.
    """
    departure, stopped = depart(tree, starts, i, ray, stack, memory)
    best, steps = (t_max, np.int32(NO_FACE), 0.0, 0.0, 1.0), np.int64(1)
    if stopped[1] != NO_FACE:
        return stopped, steps
    ray = departure.ray
    largest = largest_of(ray)
    slabs, shear = make_slabs(ray, largest), make_shear(ray)
    if not tree.has_nodes:
        return _nearest_from(tree, 0, tree.count, departure, shear, best), steps
    lower, top = splat8(round_down(ray.t_min * largest)), 1
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            first, count = blocks_of(child)
            best = _nearest_from(tree, first, count, departure, shear, best)
            steps += count
            if any_hit and best[1] != NO_FACE:
                break
            continue
        _, bits = enter_boxes(tree.nodes, child, slabs, lower, splat8(box_limit(best[0], largest)))
        top = push_children(tree, child, bits, stack, top)
        steps += 1
    return best, steps


@kernel
def t_from(tree, starts, i, ray, face, t):
    """Where a ray meets the plane of a face that it hits at t, counted from its exact start."""
    anchor, (d, unit) = anchor_of(start_at(starts, i, tree.scale)), unit_direction((ray.dx, ray.dy, ray.dz))
    p0, p1, p2 = corners_of(starts.vertices, starts.faces, face, tree.scale)
    side = larger(largest_component(sub(p1, p0)), largest_component(sub(p2, p0)))
    factor = 1.0 / power_below(side)
    normal = cross_pairs(scaled_difference(p1, p0, factor), scaled_difference(p2, p0, factor))
    far = 1.0 / power_below(larger(largest_component(sub(p0, rounded(anchor))), 1.0 / factor))
    exact = quotient(dot_pairs(normal, from_anchor(anchor, p0, far)), dot_pairs(normal, as_pairs(d)))[0] / far / unit
    return exact if exact > 0.0 and abs(exact - t) <= t else t


@inlined
def counted_from_start(tree, starts, i, ray, largest, hit, face):
    """A hit (t, u, v, w) with t counted from the exact start of ray ``i``: where it is near, the way that the origin
    was moved is a part of t.
    """
    if 0.0 < ray.slack < EDGE and face != NO_FACE and hit[0] * largest <= NEAR_HIT * ray.slack:
        return t_from(tree, starts, i, ray, face, hit[0]), hit[1], hit[2], hit[3]
    return hit


@kernel
def take_side(tree, starts, n, stack, memory, table, room):
    """Write to the row of a start on which side of its face it is, whose normal n says in which region; or on which
    side of another face, if its own does not bound that. And write its ``fan`` to ``table``, if ``room`` float64 hold
    it. Where n says nothing, the row stays.
    """
    start, holders = start_at(starts, 0, tree.scale), make_holders(memory)
    anchor, (d, _) = anchor_of(start), unit_direction(n)
    slope = slope_there(anchor, d)
    count = list_holders(tree, anchor, d, slope, 1.0, stack, holders)
    arcs, number, nodes = arcs_of(tree, anchor, holders, count)
    k, side = bounding_holder(tree, anchor, arcs, number, nodes, d, start.face)
    clear_fan(table)
    if k == NOT_STOPPED:
        return
    write_fan(tree, anchor, arcs, number, nodes, k, side, table, room)
    row = starts.rows
    # rule: side-of-normal
    put(row, CODE, np.float64(start.code | KNOWN | BACK | (ABOVE if side > 0 else 0)))
    if holder(arcs, k, NUMBER) == start.face:
        return
    put(row, FACE, np.float64(holder(arcs, k, NUMBER)))
    # A point is on both faces, but barycentrics are those of one.
    if start.code & BARYCENTRIC != 0:
        met = meet_face(seen_from(tree, holder(arcs, k, PLACE), anchor), anchor, d, slope, 1.0)
        u, v = barycentrics_of(met)
        put(row, ANCHOR, u)
        put(row, ANCHOR + 1, v)
        put(row, ANCHOR + 2, 0.0)


@kernel
def side_taken(words, vertices, faces, row, n, stack, memory):
    """For Python: ``take_side`` of the start in a row of ``starts.record``."""
    starts = StartPointers(pointer(row), 0, pointer(vertices), pointer(faces))
    take_side(tree_pointers(words), starts, n, pointer(stack), pointer(memory), local_doubles(), 0)
