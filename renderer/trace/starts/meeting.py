"""A face as a ray hits it from its exact start: it contains the start, is hit further on, or is missed.

All signs are those of sums of pairs, and exact if the start is not one of their terms. Less than their error counts as
0: less than 2^-88 of the size of both faces together. Faces that share a side with the face of the start are judged
exactly: a point of that face is on the same side of another face as the corner opposite to the common side.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import (
    LEAST_NORMAL,
    as_pairs,
    cross_pairs,
    dot_pairs,
    heads,
    power_below,
    quotient,
    scaled_difference,
)
from renderer.numerics.predicates import UNDECIDED, slope_sign, volume_sign
from renderer.numerics.simd import local_doubles, maximum
from renderer.numerics.vec3 import largest_component, largest_of_three, scale, sub
from renderer.trace.edge_signs import corners_at
from renderer.trace.starts.anchor import from_anchor, one_of

NONE = -1
# A product of three vectors errs by less than 2^-94 of the products of their largest components, and the vector to a
# corner by 2^-100 of the terms of its difference.
_ERROR, _WAY_ERROR = 2.0**-94, 2.0**-98


class SeenFace(NamedTuple):
    """A face seen from an anchor, scaled by a power of two: the vectors to its corners and its normal, as pairs; the
    corners in the tree's units; the length of one of the tree's units in that scale; the product of the sides, which
    scales the normal's error; the errors of the vectors; and for each corner the equal corner of the anchor's face,
    NONE for none.
    """

    a0: Any
    a1: Any
    a2: Any
    normal: Any
    corners: Any
    factor: float
    sides: float
    errors: Any
    same: Any


class Meeting(NamedTuple):
    """A ray against a face: t, NaN if the face contains the start or is missed; u, v and their denominator, which has
    the sign of the determinant; and the bits of the corners whose weights are 0.
    """

    t: float
    u: float
    v: float
    w: float
    zeros: int


@inlined
def _equal(p, q):
    return p[0] == q[0] and p[1] == q[1] and p[2] == q[2]


@inlined
def _same(anchor, p):
    """The corner of the anchor's face at the place p, NONE for none."""
    a, b, c = anchor.corners
    return 0 if _equal(a, p) else (1 if _equal(b, p) else (2 if _equal(c, p) else NONE))


@inlined
def _way_error(anchor, p, factor):
    """The error of the vector from an anchor to a corner, a difference of two."""
    way = largest_component(heads(anchor.way)) * anchor.unit
    return _WAY_ERROR * factor * (largest_component(sub(p, anchor.base)) + way)


@kernel
def seen_from(tree, place, anchor):
    """The face at a place of a block, as a ``SeenFace``."""
    p0, p1, p2 = corners_at(tree, place)
    o = anchor.base
    reach = largest_of_three(sub(p0, o), sub(p1, o), sub(p2, o))
    factor = 1.0 / power_below(maximum(reach, LEAST_NORMAL))
    one, other = scaled_difference(p1, p0, factor), scaled_difference(p2, p0, factor)
    sides = largest_component(heads(one)) * largest_component(heads(other))
    return SeenFace(
        from_anchor(anchor, p0, factor), from_anchor(anchor, p1, factor), from_anchor(anchor, p2, factor),
        cross_pairs(one, other), (p0, p1, p2), factor, sides,
        (_way_error(anchor, p0, factor), _way_error(anchor, p1, factor), _way_error(anchor, p2, factor)),
        (_same(anchor, p0), _same(anchor, p1), _same(anchor, p2)),
    )  # fmt: skip


@inlined
def _sign_beyond(value, error):
    return 0 if abs(value) <= error else (1 if value > 0.0 else -1)


@inlined
def _size(a):
    return largest_component(heads(a))


@kernel
def _way_sign(face, d, i, j):
    """The sign of d . (a x b) for the vectors to two corners, 0 if rounding could decide it; and the value."""
    a, b = _way(face, i), _way(face, j)
    value = dot_pairs(d, cross_pairs(a, b))[0]
    return _sign_beyond(value, _size(d) * _error_of(face, i, j)), value


@inlined
def _way(face, k):
    return face.a0 if k == 0 else (face.a1 if k == 1 else face.a2)


@inlined
def _error_of(face, i, j):
    """The error of the cross product of the vectors to two corners."""
    a, b = _size(_way(face, i)), _size(_way(face, j))
    return a * b * _ERROR + a * one_of(face.errors, j) + b * one_of(face.errors, i)


@kernel
def _corner_sign(face, i, j):
    """The sign of normal . (a x b) for the vectors to two corners, 0 if rounding could decide it; and the value."""
    value = dot_pairs(face.normal, cross_pairs(_way(face, i), _way(face, j)))[0]
    return _sign_beyond(value, face.sides * _error_of(face, i, j)), value


@kernel
def turn_sign(face, a, b):
    """The sign of normal . (a x b) for vectors of pairs, 0 if rounding could decide it."""
    value = dot_pairs(face.normal, cross_pairs(a, b))[0]
    return _sign_beyond(value, face.sides * _size(a) * _size(b) * _ERROR)


@inlined
def has_area(face):
    """Whether the corners do not lie on a line."""
    return _size(face.normal) > face.sides * _ERROR


@kernel
def lean_sign(face, x):
    """The sign of normal . x for a vector of pairs, 0 if rounding could decide it."""
    return _sign_beyond(dot_pairs(face.normal, x)[0], face.sides * _size(x) * _ERROR)


@kernel
def slope_of(face, d):
    """The sign of normal . d for a float64 direction, 0 if it lies in the face's plane."""
    p0, p1, p2 = face.corners
    sign = slope_sign(p0, p1, p2, d, local_doubles())
    return lean_sign(face, as_pairs(d)) if sign == UNDECIDED else sign


@kernel
def slope_there(anchor, d):
    """``slope_of`` an anchor's face."""
    p0, p1, p2 = anchor.corners
    sign = slope_sign(p0, p1, p2, d, local_doubles())
    return 0 if sign == UNDECIDED else sign


@kernel
def height_sign(face):
    """The sign of normal . (p0 - start), 0 if the start lies in the face's plane."""
    error = face.sides * (_size(face.a0) * _ERROR + face.errors[0])
    return _sign_beyond(dot_pairs(face.normal, face.a0)[0], error)


@inlined
def _none():
    return Meeting(np.nan, 0.0, 0.0, 1.0, 0)


@inlined
def _third(i, j):
    return 3 - i - j


@inlined
def _is_after(i, j):
    """Whether corner j follows corner i around a face."""
    return j == (i + 1 if i < 2 else 0)


@kernel
def _common(face, anchor, slope, i, j, sign):
    """The sign of direction . (way to corner i x way to corner j), exact for a side of the anchor's face."""
    a, b = face.same[i], face.same[j]
    if a == b or a < 0 or b < 0:  # NONE is the one below 0
        return sign
    weight = 0 if (anchor.zeros >> _third(a, b)) & 1 != 0 else 1
    return weight * (slope if _is_after(a, b) else -slope)


@kernel
def _height(face, anchor):
    """The sign of normal . (p0 - start), exact if the face shares a side with the anchor's."""
    a, b, c = face.same
    shared = int(a != NONE) + int(b != NONE) + int(c != NONE)
    if shared == 3:
        return 0
    if shared == 2:
        third = _third(a, b) if c == NONE else (_third(b, c) if a == NONE else _third(a, c))
        # rule: start-on-edge
        if (anchor.zeros >> third) & 1 != 0:
            return 0
        p0, p1, p2 = face.corners
        q0, q1, q2 = anchor.corners
        beside = q0 if third == 0 else (q1 if third == 1 else q2)
        sign = volume_sign(p0, p1, p2, beside, local_doubles())
        if sign != UNDECIDED:
            return sign
    return height_sign(face)


@kernel
def meet_face(face, anchor, d, slope_there, dz):
    """The ``Meeting`` of a ray in direction d, scaled to about 1, with a face; ``dz`` is the direction's largest
    component, and ``slope_there`` the ``slope_of`` the anchor's face.
    """
    if not has_area(face):
        return _none()
    height = _height(face, anchor)
    if height == 0:
        return _held(face, anchor, d, dz)
    slope, way = slope_of(face, d), as_pairs(d)
    s0, e0 = _way_sign(face, way, 1, 2)
    s1, e1 = _way_sign(face, way, 2, 0)
    s2, e2 = _way_sign(face, way, 0, 1)
    s0 = _common(face, anchor, slope_there, 1, 2, s0)
    s1 = _common(face, anchor, slope_there, 2, 0, s1)
    s2 = _common(face, anchor, slope_there, 0, 1, s2)
    # Behind the start, or beside the face.
    if height * slope <= 0 or s0 * slope < 0 or s1 * slope < 0 or s2 * slope < 0 or (s0 == 0 and s1 == 0 and s2 == 0):
        return _none()
    t = quotient(dot_pairs(face.normal, face.a0), dot_pairs(face.normal, way))
    u, v, w = _weights(e0, e1, e2, slope, dz)
    return Meeting(maximum(t[0], 0.0) / face.factor, u, v, w, _zeros(s0, s1, s2))


@kernel
def _held(face, anchor, d, dz):
    """The ``Meeting`` with a face whose plane contains the start: the face contains it, or is missed."""
    zeros = _zeros_within(face, anchor)
    if zeros < 0:
        return _none()
    e0, e1, e2 = _corner_sign(face, 1, 2)[1], _corner_sign(face, 2, 0)[1], _corner_sign(face, 0, 1)[1]
    u, v, w = _weights(e0, e1, e2, slope_of(face, d), dz)
    # rule: met-once
    return Meeting(np.nan, u, v, w, zeros)


@kernel
def zeros_if_held(face, anchor):
    """The bits of the corners of weight 0 of a face that contains the start, -1 for one that does not."""
    return _zeros_within(face, anchor) if has_area(face) and _height(face, anchor) == 0 else np.int64(-1)


@kernel
def _zeros_within(face, anchor):
    """``zeros_if_held`` for a face whose plane contains the start."""
    a, b, c = face.same
    # The weights of common corners are those on the anchor's face, where it shares all that are not 0 there.
    own = (np.int64(a != NONE) << (a & 3)) | (np.int64(b != NONE) << (b & 3)) | (np.int64(c != NONE) << (c & 3))
    if (own | anchor.zeros) & 7 == 7:
        s0 = 0 if a == NONE else 1 - ((anchor.zeros >> a) & 1)
        s1 = 0 if b == NONE else 1 - ((anchor.zeros >> b) & 1)
        s2 = 0 if c == NONE else 1 - ((anchor.zeros >> c) & 1)
    else:
        s0, s1, s2 = _corner_sign(face, 1, 2)[0], _corner_sign(face, 2, 0)[0], _corner_sign(face, 0, 1)[0]
    if s0 < 0 or s1 < 0 or s2 < 0 or (s0 == 0 and s1 == 0 and s2 == 0):
        return np.int64(-1)
    return _zeros(s0, s1, s2)


@inlined
def _zeros(s0, s1, s2):
    return np.int64(s0 == 0) | (np.int64(s1 == 0) << 1) | (np.int64(s2 == 0) << 2)


@inlined
def _weights(e0, e1, e2, slope, dz):
    """Barycentrics u and v, from edge functions of one sign, as numerators over a denominator with the sign that
    ``intersect`` gives the determinant for ``slope``, the sign of normal . direction.
    """
    e0, e1, e2 = abs(e0), abs(e1), abs(e2)
    turn = -1.0 if (slope > 0) == (dz > 0.0) else 1.0
    whole = e0 + e1 + e2
    return turn * (e1 / whole), turn * (e2 / whole), turn


@inlined
def barycentrics_of(met):
    """u and v of a ``Meeting``: exactly 0 or 1, or 1 in total, on an edge or corner."""
    u, v = (0.0 if met.zeros & 2 != 0 else met.u / met.w), (0.0 if met.zeros & 4 != 0 else met.v / met.w)
    if met.zeros & 1 == 0:
        return u, v
    # What is left of one is exact if that is at least a half.
    return (u, 1.0 - u) if u >= 0.5 else (1.0 - v, v)


@inlined
def unit_direction(d):
    """A direction scaled by a power of two, so that its largest component is from 1 to 2, and that power."""
    unit = power_below(largest_component(d))
    return scale(d, 1.0 / unit), unit
