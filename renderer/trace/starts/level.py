"""Faces that coincide where a ray hits the surface: in one plane up to the rounding of their corners.

Turned or moved corners are rounded, and so planes that were equal differ. Such faces count as coinciding; the order in
which the ray crosses them is exact.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import as_pairs, dot_pairs, quotient
from renderer.numerics.simd import maximum
from renderer.numerics.vec3 import add, barycentric, cross, dot, largest_component, largest_of_three, length, sub
from renderer.trace.edge_signs import corners_at
from renderer.trace.intersect import face_in
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.starts.anchor import anchor_of
from renderer.trace.starts.around import areas_at, enter_around, hold_sign
from renderer.trace.starts.cone import NUMBER, PLACE, ZEROS, add_holder, holder, put_holder
from renderer.trace.starts.meeting import has_area, height_sign, seen_from, turn_sign, unit_direction
from renderer.trace.starts.record import BARYCENTRIC, Start, corners_in
from renderer.trace.walk import walk

NO_MEMBER = -1
# The share of the largest coordinate by which corners are off: 16 roundings.
CORNER_ERROR = 2.0**-49
# A face contains the hit if it contains a point so far inside the face hit, at these weights of its corners.
_INWARDS, _U, _V = 2.0**-44, 0.3217, 0.4159


class Spot(NamedTuple):
    """A point of a face, by its barycentrics."""

    face: int
    u: float
    v: float


class Members(NamedTuple):
    """Coinciding faces that a ray hits together, listed in words of ``cone.Holders``: their number, and where the ray
    is before and after it crosses all of them. Of faces crossed at once, the highest is last.
    """

    count: int  # type: ignore[assignment]  # tuples have a method of that name
    near: Spot
    far: Spot


class _SurfacePoint(NamedTuple):
    """A point hit by a ray: the face's corners, the barycentrics, the point as rounded, and the ray's direction, scaled
    to about 1.
    """

    corners: Any
    spot: Spot
    o: Any
    d: Any


@inlined
def plane_of(corners):
    """The normal of a face, and twice the length of its longest side."""
    one, other, third = sub(corners[1], corners[0]), sub(corners[2], corners[0]), sub(corners[2], corners[1])
    side = largest_of_three(one, other, third)
    return cross(one, other), 4.0 * side


@kernel
def _is_below(p, q, error):
    """Whether the points q lie in the plane of p, whose corners are off by ``error``."""
    n, side = plane_of(p)
    size, level = length(n), True
    for a in q:
        way = sub(a, p[0])
        level = level and abs(dot(n, way)) <= error * (size + side * largest_component(way))
    return level


@inlined
def are_level(p, q):
    """Whether two faces lie in one plane up to the rounding of their corners."""
    error = CORNER_ERROR * maximum(largest_of_three(*p), largest_of_three(*q))
    return _is_below(p, q, error) and _is_below(q, p, error)


@kernel
def _anchor_at(met, inwards):
    """The exact hit point, moved by some share towards a point inside the face."""
    spot = met.spot
    u, v = spot.u + inwards * (_U - spot.u), spot.v + inwards * (_V - spot.v)
    return anchor_of(Start(met.corners, (u, v, 0.0), spot.face, BARYCENTRIC))


@inlined
def _precedes(a, b):
    return a[0] < b[0] or (a[0] == b[0] and (a[1] < b[1] or (a[1] == b[1] and a[2] < b[2])))


@inlined
def _is_within(face, p, q, a, b):
    """Whether a point lies on the inner side of the side of a face from p to q, which a and b are seen from the point.
    On the side itself it belongs to one of two neighbours.
    """
    # rule: one-of-neighbours
    return turn_sign(face, a, b) >= (0 if _precedes(p, q) else 1)


@kernel
def _holds_inner_point(tree, place, met):
    """Whether a face contains the inner point, exactly."""
    (p0, p1, p2), face = corners_at(tree, place), seen_from(tree, place, _anchor_at(met, _INWARDS))
    return has_area(face) and (
        _is_within(face, p1, p2, face.a1, face.a2)
        and _is_within(face, p2, p0, face.a2, face.a0)
        and _is_within(face, p0, p1, face.a0, face.a1)
    )


@inlined
def _share_axis(p, q):
    """Whether two faces lie in one plane across an axis."""
    share = False
    for k in range(3):
        x = p[0][k]
        own, other = p[1][k] == x and p[2][k] == x, q[0][k] == x and q[1][k] == x and q[2][k] == x
        share = share or (own and other)
    return share


@kernel
def _passed_at(tree, place, met):
    """t at which the ray crosses a member, relative to the hit: negative before it."""
    if _share_axis(met.corners, corners_at(tree, place)):
        return 0.0
    face = seen_from(tree, place, _anchor_at(met, 0.0))
    slope = dot_pairs(face.normal, as_pairs(met.d))
    if height_sign(face) == 0 or slope[0] == 0.0:
        return 0.0
    return quotient(dot_pairs(face.normal, face.a0), slope)[0] / face.factor


@inlined
def point_of(tree, surfaces, spot):
    """The point of a spot, rounded."""
    p0, p1, p2 = corners_in(tree, surfaces, spot.face)
    return barycentric(p0, p1, p2, spot.u, spot.v)


@kernel
def spot_of(tree, place, number, o):
    """The ``Spot`` of a face, whose corners stand at ``place``, next to a point."""
    e0, e1, e2 = areas_at(corners_at(tree, place), o)
    e0, e1, e2 = maximum(e0, 0.0), maximum(e1, 0.0), maximum(e2, 0.0)
    whole = e0 + e1 + e2
    return Spot(number, e1 / whole, e2 / whole)


@kernel
def list_members(tree, surfaces, spot, d, holders, count):
    """The ``Members`` at a ``Spot`` hit by a ray of direction d, among those that ``list_near`` listed, at least the
    face of the spot; and the point, for ``member_spot``.
    """
    corners, o = corners_in(tree, surfaces, spot.face), point_of(tree, surfaces, spot)
    met = _SurfacePoint(corners, spot, o, unit_direction(d)[0])
    count, holds_own = _keep_members(tree, met, holders, count)
    if count < 2 or not holds_own:
        return Members(1, spot, spot), met
    near, far, least, most = NO_MEMBER, NO_MEMBER, 0.0, 0.0
    for k in range(count):
        t, number = _passed_at(tree, holder(holders, k, PLACE), met), holder(holders, k, NUMBER)
        if near == NO_MEMBER or t < least or (t == least and number < holder(holders, near, NUMBER)):
            near, least = k, t
        if far == NO_MEMBER or t > most or (t == most and number > holder(holders, far, NUMBER)):
            far, most = k, t
    return Members(count, member_spot(tree, holders, near, spot, met), member_spot(tree, holders, far, spot, met)), met


@inlined
def member_spot(tree, holders, k, spot, met):
    """The ``Spot`` of the k-th member; ``spot`` is that of the face hit."""
    number = holder(holders, k, NUMBER)
    return spot if number == spot.face else spot_of(tree, holder(holders, k, PLACE), number, met.o)


class _Around(NamedTuple):
    """The search for faces at a point: the point, the room around it, the box of both, the surfaces that know which
    faces touch, whether others count too, and the list of those found.
    """

    o: Any
    room: float
    low: Any
    high: Any
    surfaces: Any
    every: bool
    holders: Any


@kernel
def list_near(tree, surfaces, spot, stack, holders, every):
    """List the touching faces that may contain a spot, as float64 can tell, or every face. Returns their number,
    usually 1. ``stack`` as in ``search.depart``.
    """
    corners, o = corners_in(tree, surfaces, spot.face), point_of(tree, surfaces, spot)
    # What moves the point: rounding, and the step to the inner point.
    # rule: room-around-hit
    room = 4.0 * CORNER_ERROR * largest_of_three(*corners) + _INWARDS * plane_of(corners)[1]
    low, high = sub(o, (room, room, room)), add(o, (room, room, room))
    query = _Around(o, room, low, high, surfaces, every, holders)
    return walk(tree, stack, query, np.int64(0), enter_around, _list_in)


@inlined
def _list_in(tree, query, first, blocks, count):
    """List the faces of some blocks that may contain a point."""
    for slot in range(first * BLOCK_FACES, (first + blocks) * BLOCK_FACES):
        face = face_in(tree, slot)
        if face >= 0 and (query.every or query.surfaces.ways.touches(query.surfaces, face)):
            place = slot // BLOCK_FACES * BLOCK_WORDS + slot % BLOCK_FACES
            corners = corners_at(tree, place)
            held = hold_sign(corners, query.o, query.room)
            # Touching faces are compared with the plane of the face hit later.
            error = query.room + CORNER_ERROR * largest_of_three(*corners)
            if held >= 0 and (not query.every or _is_below(corners, (query.o,), error)):
                count = add_holder(query.holders, count, place, np.int64(face), held)
    return count, False


@kernel
def _keep_members(tree, met, holders, count):
    """Keep only the listed faces that are members. Returns their number, and whether the face hit is one of them."""
    kept, holds_own = 0, False
    for k in range(count):
        place, face = holder(holders, k, PLACE), holder(holders, k, NUMBER)
        level = are_level(met.corners, corners_at(tree, place))
        if level and (holder(holders, k, ZEROS) != 0 or _holds_inner_point(tree, place, met)):
            holds_own = holds_own or face == met.spot.face
            put_holder(holders, kept, PLACE, place)
            put_holder(holders, kept, NUMBER, face)
            kept += 1
    return kept, holds_own
