"""The start of a ray that leaves a surface: off it by the bound of rounding errors, without a chosen epsilon.

Vectors are tuples of float64.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import maximum, minimum, offset, pointer, store
from renderer.numerics.vec3 import (
    add,
    barycentric,
    cross,
    dot,
    largest_component,
    largest_of_three,
    least_axis,
    normalized,
    row3,
    scale,
    sub,
    three,
    unit_and_length,
)
from renderer.trace.intersect import CORNER, DOUBT, SLANT, slack_of
from renderer.trace.resolve import LINE, ROUNDING
from renderer.trace.starts.anchor import anchor_of, far_from, rounded
from renderer.trace.starts.record import (
    ABOVE,
    ALL,
    ANCHOR,
    BACK,
    BARYCENTRIC,
    CODE,
    EDGE,
    FACE,
    IGNORED,
    KNOWN,
    MASK,
    PILE,
    SLACK,
    THROUGH,
    WAY,
    Start,
    corners_of,
)

_ROUNDOFF = 2.0**-53
# gamma(7) = 7 u / (1 - 7 u): the barycentric point's rounding (Pharr, Jakob, Humphreys, PBRT 4, section 6.8.4).
_GAMMA7 = 7.0 * _ROUNDOFF / (1.0 - 7.0 * _ROUNDOFF)
# The next ray's test of the same triangle errs too. With L the largest component of a vertex relative to the origin and
# every shear at most 1: a sheared coordinate is at most 2 L and errs by 5 u L; an edge function is at most 8 L^2 and
# errs by 56 u L^2; the sum of the three e z errs by 3 (56 + 8 + 24) u L^3. Divided by the determinant, which is
# |cross(p1 - p0, p2 - p0) . d| / |d_z|, and projected onto the normal, the direction drops out: 264 u L^3 / |cross|.
_GAMMA264 = 264.0 * _ROUNDOFF / (1.0 - 264.0 * _ROUNDOFF)
# The same for the distance of a point from a face's plane as ``offset_from_faces`` finds it: the cross product's
# components err by 32 u L^2, its product with the point by 192 u L^3, and dividing by its length adds 6 u of at most
# 24 L^3.
_GAMMA336 = 336.0 * _ROUNDOFF / (1.0 - 336.0 * _ROUNDOFF)
# And never more than 47 u / SLANT of L, where a hit lies whose determinant is certain (see ``intersect``).
_MOST = 50.0 * _ROUNDOFF / SLANT
# Of a face thinner than this share of its longest side every determinant is uncertain: it is at most 3 |cross| / side^2
# of A D, because A is at least the side as the ray sees it, and D at least side / sqrt(3).
_THIN = DOUBT / 4.0
# A hit whose determinant is uncertain counts within ROUNDING of the face: twice that from its plane is off it, and four
# times that from a line, which the face may be LINE wide.
_LEAST = 2.0 * ROUNDING
_SMALLEST = 2.0**-1074
# A start that would be moved by more of its face, as of needles, is left to exact signs: t is counted from there.
_FARTHEST_MOVE = 2.0**-38
# A start is inside its face where it is farther from the edges than so often the slack of such a move: a face beside
# it, at more than a 64th of a right angle, is farther from it than where it is moved to.
_INSIDE = 8.0
# A ray at a smaller angle to its face is left to exact signs. Of normal . direction 2^-43 is rounding, of a face that
# is not thinner than 2^-10 of its side.
LEVEL = 2.0**-20
# A point that went through float32 is off by 2^-24 of its largest coordinate: 64 times that is taken, as the same
# may hold for the mesh and for what the point was computed from.
FARTHEST_START = 2.0**-18
# Mitsuba 3's RayEpsilon: 1500 times the unit roundoff of float32.
MITSUBA_EPSILON = 1500.0 * 2.0**-24


class OffsetRule(NamedTuple):
    """The distance from the surface at which a ray starts: the bound of roundings, or (1 + max|p|) ``epsilon``."""

    uses_error_bound: bool
    epsilon: float


BOUNDED = OffsetRule(True, 0.0)


class Place(NamedTuple):
    """A hit at which a ray may start: the face, as float64, its barycentrics, the slack of rays from there, the side of
    n_g that the ray came from, 1 or -1, and the first of the faces that coincide there, as of ``starts.record``.
    """

    face: float
    u: float
    v: float
    slack: float
    came: float
    pile: float


class Facet(NamedTuple):
    """A face for rays that start on it: unit normal, twice the area, and the largest component of a side."""

    normal: Any
    double_area: float
    side: float


@inlined
def _extends(n, side):
    """Whether a face's corners, as rounded, do not lie on a line; n is the product of two of its sides."""
    return largest_component(n) > side * LINE * side


@inlined
def has_normal(p0, p1, p2):
    """Whether a face has a normal of its own, which does not depend on the ray."""
    one, other = sub(p1, p0), sub(p2, p0)
    return _extends(cross(one, other), largest_of_three(one, other, sub(p2, p1)))


@inlined
def facet_of(p0, p1, p2, d):
    """The ``Facet`` of a face hit by a ray of direction d, with its normal by winding."""
    one, other = sub(p1, p0), sub(p2, p0)
    n, side = cross(one, other), largest_of_three(one, other, sub(p2, p1))
    unit, double_area = unit_and_length(n)
    return Facet(unit if _extends(n, side) else _normal_of_line(p0, p1, p2, d), double_area, side)


@kernel
def _normal_of_line(p0, p1, p2, d):
    """The normal for a face without one: it fills a slit between its neighbours, so it faces back along d as far as its
    longest side allows.
    """
    side0, side1, side2 = sub(p2, p1), sub(p0, p2), sub(p1, p0)
    l0, l1, l2 = largest_component(side0), largest_component(side1), largest_component(side2)
    longest = normalized(side2 if l2 >= l0 and l2 >= l1 else (side1 if l1 >= l0 else side0))
    across = normalized(sub(scale(longest, dot(d, longest)), d))
    if largest_component(across) == 0.0:
        # Of a d along the side every direction across looks as far back.
        across = normalized(cross(longest, least_axis(longest)))
    # Once more, because of a d nearly along the side rounding leaves much of what points along it.
    return normalized(sub(across, scale(longest, dot(across, longest))))


@inlined
def _clearance(side, double_area, reach):
    """The distance from a face's plane beyond which no ray that leads away hits the face.

    ``side`` is the largest component of its sides, ``reach`` that of a corner relative to the ray's start.
    """
    if not double_area / side > _THIN * side:
        return 2.0 * _LEAST * reach
    # In this order nothing overflows or vanishes before the result does: a hit triangle has reach^2 near its area.
    return reach * maximum(_LEAST, minimum(_GAMMA264 * (reach / double_area * reach), _MOST))


@inlined
def offset_distance(p, p0, p1, p2, u, v, facet):
    """The distance by which p = (1 - u - v) p0 + u p1 + v p2 must move along the normal to be certainly off the face's
    plane, and the slack of a ray that starts there, EDGE near an edge. ``facet`` is the ``Facet`` of the face.

    The bound of p's own rounding (PBRT 4, 6.8.6), and that of the next ray's test against the same triangle, which
    matters where the first vanishes (on a plane through the origin) and for slivers.
    """
    n_g, double_area, side = facet.normal, facet.double_area, facet.side
    w, distance, reach = 1.0 - u - v, 0.0, 0.0
    for k in range(3):
        distance += abs(n_g[k]) * (abs(w * p0[k]) + abs(u * p1[k]) + abs(v * p2[k]))
        reach = maximum(reach, largest_component((p0[k] - p[k], p1[k] - p[k], p2[k] - p[k])))
    error = _GAMMA7 * distance + _clearance(side, double_area, reach)
    # A weight times the double area is the distance from its edge times the edge's length.
    inside = minimum(u, minimum(v, w)) * double_area > _from_edges(p, side) * side
    inside = inside and double_area > side * LINE * side and error <= _FARTHEST_MOVE * side
    # rule: slack-on-edges
    return error, slack_of(p, error) if inside else EDGE


@inlined
def _from_edges(p, side):
    """The least distance of a moved start from the edges of its face."""
    return _INSIDE * slack_of(p, _FARTHEST_MOVE * side)


@inlined
def _away(x, step, towards):
    """x + step, rounded at least one float64 further in the direction of ``towards``."""
    y = x + step
    if towards == 0.0 or not math.isfinite(y):
        return y
    # nextafter without its call: the bits of a float64 count up away from 0.
    if y == 0.0:
        return math.copysign(_SMALLEST, towards)
    away = 1 if (y > 0.0) == (towards > 0.0) else -1
    return np.int64(np.float64(y).view(np.int64) + away).view(np.float64)


@inlined
def spawn_origin(p, error, n_g, w, rule):
    """The start of a ray from the surface point p in direction w that does not hit that surface again.

    By the ``OffsetRule``: moved along n_g by ``error``, the bound of ``offset_distance``, and rounded away; or by
    Mitsuba's epsilon.
    """
    side = 1.0 if dot(n_g, w) >= 0.0 else -1.0
    if not rule.uses_error_bound:
        distance = (1.0 + largest_component(p)) * rule.epsilon
        return add(p, scale(n_g, side * distance))
    # rule: spawn-offset
    step = scale(n_g, side * error)
    return (_away(p[0], step[0], step[0]), _away(p[1], step[1], step[1]), _away(p[2], step[2], step[2]))


@inlined
def put_start(row, place, n_g, w, d, rule):
    """Write the row of ``starts.record`` for a ray in direction w from a ``Place`` that a ray of direction d reached.
    Its side is the one that w leads to; if that is not the side that d came from, the ray has gone through the face.
    """
    slope = dot(n_g, w)
    side = 1.0 if slope >= 0.0 else -1.0
    code = KNOWN | BARYCENTRIC | (ABOVE if side > 0.0 else 0) | (THROUGH if side != place.came else BACK)
    slack = place.slack if abs(slope) > LEVEL * largest_component(w) else EDGE
    store(row, SLACK, slack if rule.uses_error_bound else 0.0)
    store(row, FACE, place.face if rule.uses_error_bound else -1.0)
    store(row, CODE, np.float64(code))
    store(row, ANCHOR, place.u)
    store(row, ANCHOR + 1, place.v)
    store(row, PILE, place.pile)
    for k in range(3):
        store(row, WAY + k, -d[k])


@kernel
def start_row(row, place, n_g, w, d):
    """``put_start`` for Python: an array (starts.record.ROW,), by the bounded offset."""
    put_start(pointer(row), place, n_g, w, d, BOUNDED)


@inlined
def put_no_start(row):
    """Write the row of ``starts.record`` for a ray that starts on no surface."""
    store(row, SLACK, 0.0)
    store(row, FACE, -1.0)


@inlined
def put_all_visible(row):
    """Let the ray of a row of ``starts.record`` hit all instances of a ray scene; the two above leave that as it is."""
    store(row, MASK, ALL)
    store(row, IGNORED, -1.0)


class _Plane(NamedTuple):
    """The plane of a face near a point: the unit normal, the point's height above it, the distance that a start needs,
    the slack of that start, and whether the point is certainly inside the face.
    """

    normal: Any
    height: float
    needed: float
    slack: float
    inside: bool


@inlined
def _plane_near(p0, p1, p2, o):
    """The ``_Plane`` of a face near o. For a face without area nothing is known, and no point is inside it."""
    one, other, q = sub(p1, p0), sub(p2, p0), sub(o, p0)
    n = cross(one, other)
    whole = dot(n, n)
    area = math.sqrt(whole)
    side = largest_of_three(one, other, sub(p2, p1))
    reach = largest_of_three(q, sub(p1, o), sub(p2, o))
    share = reach / area * reach
    # The bound of ``_clearance``, a 1024th more because the next test measures from where the point is moved to, and
    # that of the height below.
    needed = reach * (maximum(_LEAST, minimum(_GAMMA264 * share, _MOST)) * (1.0 + 2.0**-10) + _GAMMA336 * share)
    u, v = dot(cross(q, other), n), dot(cross(one, q), n)
    # A weight is the distance from its edge times the edge's length times the double area.
    least = minimum(u, minimum(v, whole - u - v))
    # rule: start-inside-face
    inside = least > _from_edges(o, side) * side * area and needed <= _FARTHEST_MOVE * side
    n_g = scale(n, 1.0 / area)
    return _Plane(n_g, dot(n_g, q), needed, slack_of(o, needed), inside and area > _THIN * side * side)


@inlined
def _moved(o, plane, away):
    """The point o near a face, moved along the normal until it is certainly off; away = -1 is the other side."""
    out = scale(plane.normal, away)
    step = scale(out, plane.needed - away * plane.height)
    return (_away(o[0], step[0], out[0]), _away(o[1], step[1], out[1]), _away(o[2], step[2], out[2]))


@inlined
def _side_of(slope, w, code):
    """The side of its face to which a ray of direction w leaves; 0 if rounding could decide it, or if the code says
    that the ray starts on the other side. ``slope`` is the unit normal times w.
    """
    side = 1.0 if slope >= 0.0 else -1.0
    if abs(slope) <= LEVEL * largest_component(w):
        return 0.0
    known = 1.0 if code & ABOVE != 0 else -1.0
    return side if code & KNOWN == 0 or side == known else 0.0


@inlined
def offset_from_face(corners, o, w, unit, code):
    """The start of a ray from o, near a face, in direction w: off the face, see ``offset_from_faces``; and its slack.
    Near an edge, or if the face stops the ray, the start is o and the slack EDGE.

    ``corners`` are ``corners_of`` the face; o and the start are in the mesh's units, the slack in those of ``corners``.
    """
    scaled = scale(o, unit)
    plane = _plane_near(corners[0], corners[1], corners[2], scaled)
    side = _side_of(dot(plane.normal, w), w, code)
    if not plane.inside or side == 0.0:
        return o, EDGE
    return scale(_moved(scaled, plane, side), 1.0 / unit), plane.slack


@kernel
def offset_to_both_sides(corners, o, unit):
    """``offset_from_face`` for all directions w at once, of a face that ``has_normal``.

    Returns that normal, the start for each w with normal . w >= 0, and the start for all others, and the slack of both.
    """
    scaled = scale(o, unit)
    plane = _plane_near(corners[0], corners[1], corners[2], scaled)
    above, below = _moved(scaled, plane, 1.0), _moved(scaled, plane, -1.0)
    return plane.normal, scale(above, 1.0 / unit), scale(below, 1.0 / unit), plane.slack if plane.inside else EDGE


@inlined
def _lies_above(start, o):
    """Whether a start was moved by more than half of what points that went through float32 may be off."""
    return largest_component(sub(start, o)) > 0.25 * FARTHEST_START * largest_component(o)


@kernel
def _lies_far(corners, o, unit):
    """Whether a point is farther from a face than points that went through float32 may be."""
    p0, p1, p2 = corners
    o = scale(o, unit)
    most = maximum(largest_component(o), largest_of_three(p0, p1, p2))
    return far_from(anchor_of(Start(corners, o, 0, 0)), o) > FARTHEST_START * most


@inlined
def _lies_at(corners, weights, o, unit):
    """Whether a point is where a face's barycentrics say, as exactly as ``_lies_far`` demands."""
    p0, p1, p2 = corners
    most = largest_of_three(p0, p1, p2)
    place = barycentric(p0, p1, p2, weights[0], weights[1])
    return largest_component(sub(place, scale(o, unit))) <= FARTHEST_START * most


@kernel
def _at_corner(start, o, unit):
    """The corner on which a start lies, from which a ray starts exactly, and its slack; elsewhere o and EDGE."""
    anchor = anchor_of(start)
    if anchor.zeros & (anchor.zeros - 1) == 0:
        return o, EDGE
    return scale(rounded(anchor), 1.0 / unit), CORNER


@kernel
def offset_from_faces(vertices, faces, origins, directions, leaving, starts, rows, begin, end, unit):
    """Write the origins of the rays begin:end to ``starts`` (n, 3), moved off the faces that they leave.

    origins     one row a ray or one for all, as ``directions``
    leaving     a ``batch.Leaving``
    rows        (n, starts.record.ROW) float64, which is written too
    unit        the tree's scale, in whose units no product overflows or vanishes

    A start moves only along its face's normal, by no more than its distance from the plane and some roundings, so that
    the ray hits neither that face nor another in its plane. Returns the row of the first origin that is too far from
    its face, or -1.
    """
    corners, code_step = pointer(vertices), np.int64(len(leaving.code) > 1)
    step, way_step = 3 * np.int64(len(origins) > 1), 3 * np.int64(len(directions) > 1)
    for i in range(begin, end):
        face, o, w = leaving.faces[i], three(pointer(origins), i * step), three(pointer(directions), i * way_step)
        own, slack, bits = o, 0.0, leaving.code[i * code_step]
        anchor = row3(pointer(leaving.anchors), i) if bits & BARYCENTRIC != 0 else o
        if face >= 0:
            around = corners_of(corners, pointer(faces), face, unit)
            own, slack = offset_from_face(around, o, w, unit, bits)
            if bits & BARYCENTRIC != 0:
                if not _lies_at(around, anchor, o, unit):
                    return i
            # A point inside its face may only be above or below.
            elif (slack == EDGE or _lies_above(own, o)) and _lies_far(around, o, unit):
                return i
            if slack == EDGE and bits & KNOWN == 0:
                given = anchor if bits & BARYCENTRIC != 0 else scale(o, unit)
                own, slack = _at_corner(Start(around, given, face, bits), o, unit)
        row = offset(pointer(starts), 3 * i)
        for k in range(3):
            store(row, k, own[k])
            rows[i, ANCHOR + k] = anchor[k]
        rows[i, SLACK], rows[i, FACE], rows[i, CODE] = slack, np.float64(face), np.float64(bits)
    return -1
