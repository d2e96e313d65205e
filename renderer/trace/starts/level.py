"""Faces that coincide where a ray meets the surface: in one plane, but for the rounding of their corners.

Corners that were turned or moved are off by rounding, and so are planes that were one: such faces count as coinciding,
and the order in which the ray passes them is exact.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.pairs import as_pairs, cross_pairs, dot_pairs, heads, quotient
from renderer.kernels.simd import get, larger, load8, movemask, put, smaller, splat8
from renderer.kernels.vec3 import barycentric, cross, dot, largest_component, length, sub
from renderer.trace.intersect import round_both
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, NODE_WORDS
from renderer.trace.leaf import blocks_of, push_children
from renderer.trace.sides import corner
from renderer.trace.starts.anchor import anchor_of
from renderer.trace.starts.cone import MOST_HOLDERS, NUMBER, PLACE, holder, make_holders, put_holder
from renderer.trace.starts.meeting import has_area, height_sign, seen_from, turn_sign, unit_direction
from renderer.trace.starts.record import BARYCENTRIC, Start, corners_of

NO_MEMBER = -1
# The share of the largest coordinate by which corners are off: 16 roundings.
CORNER_ERROR = 2.0**-49
# Whether a face holds a point is asked so far inside the face that the ray met: at these weights of its corners.
_INWARDS, _U, _V = 2.0**-44, 0.3217, 0.4159
# Of the products of lengths that say on which side of an edge a point is, what is taken for rounding.
_BESIDE = 2.0**-36


class Spot(NamedTuple):
    """A point of a face, by its barycentrics."""

    face: int
    u: float
    v: float


class Members(NamedTuple):
    """Faces that coincide where a ray meets one of them, listed in words of ``cone.Holders``: their number, and where
    the ray is before it passes all of them and after it. Of faces that it passes at once, the highest is last.
    """

    count: int
    near: Spot
    far: Spot


class _Met(NamedTuple):
    """A point that a ray meets, exactly; the same point farther inside the face; and the ray's direction."""

    corners: Any
    anchor: Any
    inner: Any
    d: Any


@inlined
def _largest(corners):
    p0, p1, p2 = corners
    return larger(largest_component(p0), larger(largest_component(p1), largest_component(p2)))


@inlined
def plane_of(corners):
    """The normal of a face, and twice the length of its longest side."""
    one, other, third = sub(corners[1], corners[0]), sub(corners[2], corners[0]), sub(corners[2], corners[1])
    side = larger(largest_component(one), larger(largest_component(other), largest_component(third)))
    return cross(one, other), 4.0 * side


@kernel
def _is_below(p, q, error):
    """Whether the corners of q are in the plane of p, whose corners are off by ``error``."""
    n, side = plane_of(p)
    size, level = length(n), True
    for a in q:
        way = sub(a, p[0])
        level = level and abs(dot(n, way)) <= error * (size + side * largest_component(way))
    return level


@inlined
def are_level(p, q):
    """Whether two faces are in one plane, but for the rounding of their corners."""
    error = CORNER_ERROR * larger(_largest(p), _largest(q))
    return _is_below(p, q, error) and _is_below(q, p, error)


@inlined
def corners_at(tree, place):
    """The corners of the face at a place of a block."""
    return corner(tree, place), corner(tree, place + 12), corner(tree, place + 24)


@kernel
def _met_at(tree, surfaces, spot, d):
    corners = corners_of(surfaces.vertices, surfaces.faces, spot.face, tree.scale)
    u, v = spot.u + _INWARDS * (_U - spot.u), spot.v + _INWARDS * (_V - spot.v)
    anchor = anchor_of(Start(corners, (spot.u, spot.v, 0.0), spot.face, BARYCENTRIC))
    inner = anchor_of(Start(corners, (u, v, 0.0), spot.face, BARYCENTRIC))
    return _Met(corners, anchor, inner, unit_direction(d)[0])


@kernel
def _is_member(tree, place, met):
    """Whether a face is level with the one met, and holds its inner point."""
    if not are_level(met.corners, corners_at(tree, place)):
        return False
    face = seen_from(tree, place, met.inner)
    return has_area(face) and (
        turn_sign(face, face.a1, face.a2) >= 0
        and turn_sign(face, face.a2, face.a0) >= 0
        and turn_sign(face, face.a0, face.a1) >= 0
    )


@kernel
def _passed_at(tree, place, met):
    """Where the ray passes a member, counted from the point met: negative before it."""
    face = seen_from(tree, place, met.anchor)
    slope = dot_pairs(face.normal, as_pairs(met.d))
    if height_sign(face) == 0 or slope[0] == 0.0:
        return 0.0
    return quotient(dot_pairs(face.normal, face.a0), slope)[0] / face.factor


@kernel
def _spot_of(tree, place, number, met):
    """The ``Spot`` of a member."""
    face = seen_from(tree, place, met.anchor)
    n = heads(face.normal)
    e0 = larger(dot(n, heads(cross_pairs(face.a1, face.a2))), 0.0)
    e1 = larger(dot(n, heads(cross_pairs(face.a2, face.a0))), 0.0)
    e2 = larger(dot(n, heads(cross_pairs(face.a0, face.a1))), 0.0)
    whole = e0 + e1 + e2
    return Spot(number, e1 / whole, e2 / whole)


@kernel
def list_members(tree, surfaces, spot, d, stack, memory):
    """The ``Members`` at a ``Spot`` that a ray of direction d met, at least that itself; and the point, for
    ``member_spot``. ``stack`` and ``memory`` as for ``search.depart``.
    """
    met, holders = _met_at(tree, surfaces, spot, d), make_holders(memory)
    count = _keep_members(tree, met, holders, _list_near(tree, surfaces, spot, stack, holders))
    near, far, least, most, holds_own = NO_MEMBER, NO_MEMBER, 0.0, 0.0, False
    for k in range(count):
        t, number = _passed_at(tree, holder(holders, k, PLACE), met), holder(holders, k, NUMBER)
        holds_own = holds_own or number == spot.face
        if near == NO_MEMBER or t < least or (t == least and number < holder(holders, near, NUMBER)):
            near, least = k, t
        if far == NO_MEMBER or t > most or (t == most and number > holder(holders, far, NUMBER)):
            far, most = k, t
    if count < 2 or not holds_own:
        return Members(1, spot, spot), met
    return Members(count, member_spot(tree, holders, near, spot, met), member_spot(tree, holders, far, spot, met)), met


@kernel
def meets_alone(tree, surfaces, spot, stack, memory):
    """Whether no other face may coincide with one at a ``Spot``. It costs little: most answers are yes."""
    return _list_near(tree, surfaces, spot, stack, make_holders(memory)) < 2


@inlined
def member_spot(tree, holders, k, spot, met):
    """The ``Spot`` of the k-th member; ``spot`` is that of the face met."""
    number = holder(holders, k, NUMBER)
    return spot if number == spot.face else _spot_of(tree, holder(holders, k, PLACE), number, met)


@inlined
def _octants_at(tree, child, o, room):
    """The bits of the octants of a node whose boxes hold a point, with some room."""
    base, bits = child * NODE_WORDS, 0xFF
    for k in range(3):
        low, high = round_both(o[k] - room)[0], round_both(o[k] + room)[1]
        bits &= movemask(
            (load8(tree.nodes, base + 16 * k) <= splat8(high)) & (load8(tree.nodes, base + 16 * k + 8) >= splat8(low))
        )
    return bits


@kernel
def _list_near(tree, surfaces, spot, stack, holders):
    """List the faces that touch others and may hold a spot, as far as float64 tells; returns their number."""
    corners = corners_of(surfaces.vertices, surfaces.faces, spot.face, tree.scale)
    o = barycentric(corners[0], corners[1], corners[2], spot.u, spot.v)
    room, count, top = 4.0 * CORNER_ERROR * _largest(corners), 0, 1
    if not tree.has_nodes:
        return _list_in(tree, 0, tree.count, surfaces.touching, o, room, holders, count)
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            first, blocks = blocks_of(child)
            count = _list_in(tree, first, blocks, surfaces.touching, o, room, holders, count)
            continue
        top = push_children(tree, child, _octants_at(tree, child, o, room), stack, top)
    return count


@inlined
def _list_in(tree, first, blocks, touching, o, room, holders, count):
    """List those of the faces of some blocks that touch others and may hold a point."""
    for slot in range(first * BLOCK_FACES, (first + blocks) * BLOCK_FACES):
        face = get(tree.faces, slot)
        if face >= 0 and get(touching, face) != 0:
            place = slot // BLOCK_FACES * BLOCK_WORDS + slot % BLOCK_FACES
            if _may_hold(corners_at(tree, place), o, room):
                count = _put_face(holders, count, place, np.int64(face))
    return count


@kernel
def _may_hold(corners, o, room):
    """Whether a face may hold a point, in its box with some room, and beyond its sides by no more than rounding."""
    a, b, c = corners
    for k in range(3):
        low, high = smaller(a[k], smaller(b[k], c[k])), larger(a[k], larger(b[k], c[k]))
        if o[k] < low - room or o[k] > high + room:
            return False
    a, b, c = sub(a, o), sub(b, o), sub(c, o)
    n = cross(sub(b, a), sub(c, a))
    reach = larger(largest_component(a), larger(largest_component(b), largest_component(c)))
    least = -_BESIDE * largest_component(n) * reach * (reach + room)
    return dot(n, cross(a, b)) >= least and dot(n, cross(b, c)) >= least and dot(n, cross(c, a)) >= least


@kernel
def _keep_members(tree, met, holders, count):
    """Keep those of the listed faces that are members; returns their number."""
    kept = 0
    for k in range(count):
        place, face = holder(holders, k, PLACE), holder(holders, k, NUMBER)
        if _is_member(tree, place, met):
            put_holder(holders, kept, PLACE, place)
            put_holder(holders, kept, NUMBER, face)
            kept += 1
    return kept


@inlined
def _put_face(holders, count, place, face):
    """Put a face where its number says among those listed, unless there is no room; returns how many there are."""
    if count >= MOST_HOLDERS:
        return count
    k = count
    while k > 0 and holder(holders, k - 1, NUMBER) > face:
        put_holder(holders, k, PLACE, holder(holders, k - 1, PLACE))
        put_holder(holders, k, NUMBER, holder(holders, k - 1, NUMBER))
        k -= 1
    put_holder(holders, k, PLACE, place)
    put_holder(holders, k, NUMBER, face)
    return count + 1
