"""The exact start of a ray: a corner of its face and an offset in pairs of float64.

So the start is known to 2^-100 of the face's size, however far the face is from the origin of coordinates.
"""

from typing import Any, NamedTuple

from renderer.jit.decorators import apart, inlined, kernel
from renderer.numerics.double_double import (
    LEAST_NORMAL,
    cross_pairs,
    dot_pairs,
    exact_sum,
    heads,
    minus,
    plus,
    power_below,
    product,
    quotient,
    scaled_difference,
)
from renderer.numerics.simd import maximum
from renderer.numerics.vec3 import largest_component, largest_of_three, sub
from renderer.trace.starts.record import BARYCENTRIC

_ZERO = (0.0, 0.0)
# A point of a face as near to an edge, as a share of the size of the face, is on it: pairs err by 2^-98 of four
# factors.
_TINY = 2.0**-92


class Anchor(NamedTuple):
    """A point of a face: ``base`` + ``unit`` ``way``, where ``way`` is a vector of pairs and ``unit`` a power of two.

    corners  those of the face
    zeros    the bits of the corners whose weights are exactly 0
    """

    base: Any
    way: Any
    unit: float
    corners: Any
    zeros: int


@apart
def anchor_of(start):
    """The exact start: the point of the given barycentrics, or the point of the face nearest to the given one.

    Barycentrics below 0, by rounding, count as 0; the two others are scaled to add up to 1.
    """
    p0, p1, p2 = corners = start.corners
    side = largest_of_three(sub(p1, p0), sub(p2, p1), sub(p0, p2))
    unit = power_below(maximum(side, LEAST_NORMAL))
    if start.code & BARYCENTRIC != 0:
        return _at_weights(corners, start.anchor[0], start.anchor[1], unit)
    return _nearest(corners, start.anchor, unit)


@kernel
def rounded(anchor):
    """The anchor as float64; each coordinate has a small relative error."""
    (x, y, z), (bx, by, bz), unit = anchor.way, anchor.base, anchor.unit
    return _nearest_float(bx, x, unit), _nearest_float(by, y, unit), _nearest_float(bz, z, unit)


@inlined
def _nearest_float(base, way, unit):
    head, tail = exact_sum(base, way[0] * unit)
    return head + (tail + way[1] * unit)


@kernel
def from_anchor(anchor, p, factor):
    """The vector from an anchor to a point, times a power of two, as pairs."""
    a, share = scaled_difference(p, anchor.base, factor), anchor.unit * factor
    (x, y, z), (a0, a1, a2) = anchor.way, a
    return (
        minus(a0, (x[0] * share, x[1] * share)),
        minus(a1, (y[0] * share, y[1] * share)),
        minus(a2, (z[0] * share, z[1] * share)),
    )


@inlined
def _times(a, s):
    """A vector of pairs times a pair."""
    return product(a[0], s), product(a[1], s), product(a[2], s)


@inlined
def _sum(a, b):
    return plus(a[0], b[0]), plus(a[1], b[1]), plus(a[2], b[2])


@inlined
def one_of(three, k):
    """The k-th of three things of one type, which Numba cannot index by a variable."""
    return three[0] if k == 0 else (three[1] if k == 1 else three[2])


@inlined
def _atone_of(corners, k, unit):
    return Anchor(one_of(corners, k), (_ZERO, _ZERO, _ZERO), unit, corners, 7 & ~(1 << k))


@kernel
def _along(corners, i, j, share, unit):
    """The point of the side from corner i to corner j at ``share`` from i; at the ends exactly the corner."""
    if share[0] <= _TINY:
        return _atone_of(corners, i, unit)
    rest = minus((1.0, 0.0), share)
    if rest[0] <= _TINY:
        return _atone_of(corners, j, unit)
    if share[0] > 0.5:
        i, j, share = j, i, rest
    a, b = one_of(corners, i), one_of(corners, j)
    return Anchor(a, _times(scaled_difference(b, a, 1.0 / unit), share), unit, corners, 7 & ~((1 << i) | (1 << j)))


@kernel
def _at_weights(corners, u, v, unit):
    """The point (1 - u - v) p0 + u p1 + v p2."""
    u, v = maximum(u, 0.0), maximum(v, 0.0)
    w = minus(exact_sum(1.0, -u), (v, 0.0))
    if w[0] <= 0.0:
        return _along(corners, 1, 2, quotient((v, 0.0), exact_sum(u, v)), unit)
    if u == 0.0:
        return _along(corners, 0, 2, (v, 0.0), unit)
    if v == 0.0:
        return _along(corners, 0, 1, (u, 0.0), unit)
    # From the corner of the largest weight: the way to one nearby has as many digits as others.
    p0, p1, p2 = corners
    if u >= v and u >= w[0]:
        return Anchor(p1, _mean(p1, p2, p0, (v, 0.0), w, unit), unit, corners, 0)
    if v >= w[0]:
        return Anchor(p2, _mean(p2, p0, p1, w, (u, 0.0), unit), unit, corners, 0)
    return Anchor(p0, _mean(p0, p1, p2, (u, 0.0), (v, 0.0), unit), unit, corners, 0)


@kernel
def _mean(a, b, c, s, t, unit):
    """s (b - a) + t (c - a), scaled by a unit."""
    one, other = scaled_difference(b, a, 1.0 / unit), scaled_difference(c, a, 1.0 / unit)
    return _sum(_times(one, s), _times(other, t))


@kernel
def _nearest(corners, o, unit):
    """The point of a face nearest to o. Source: Ericson, Real-Time Collision Detection, 2005, section 5.1.5."""
    p0, p1, p2 = corners
    one, other = scaled_difference(p1, p0, 1.0 / unit), scaled_difference(p2, p0, 1.0 / unit)
    q = scaled_difference(o, p0, 1.0 / unit)
    d1, d2 = dot_pairs(one, q), dot_pairs(other, q)
    aa, ab, bb = dot_pairs(one, one), dot_pairs(one, other), dot_pairs(other, other)
    d3, d4, d5, d6 = minus(d1, aa), minus(d2, ab), minus(d1, ab), minus(d2, bb)
    rise, fall = minus(d4, d3), minus(d5, d6)
    if d1[0] <= 0.0 and d2[0] <= 0.0:
        return _atone_of(corners, 0, unit)
    if d3[0] >= 0.0 and rise[0] <= 0.0:
        return _atone_of(corners, 1, unit)
    if d6[0] >= 0.0 and fall[0] <= 0.0:
        return _atone_of(corners, 2, unit)
    # Two corners at one place have no side between them.
    if aa[0] > 0.0 and _is_beyond(d3, d2, d1, d4) and d1[0] >= 0.0 and d3[0] <= 0.0:
        return _along(corners, 0, 1, quotient(d1, aa), unit)
    if _is_beyond(d1, d6, d5, d2) and d2[0] >= 0.0 and d6[0] <= 0.0:
        return _along(corners, 0, 2, quotient(d2, bb), unit)
    if _is_beyond(d5, d4, d3, d6) and rise[0] >= 0.0 and fall[0] >= 0.0:
        return _along(corners, 1, 2, quotient(rise, plus(rise, fall)), unit)
    n = cross_pairs(one, other)
    height = quotient(dot_pairs(n, q), dot_pairs(n, n))
    back = _times(n, (-height[0], -height[1]))
    f0, f1, f2 = largest_component(sub(o, p0)), largest_component(sub(o, p1)), largest_component(sub(o, p2))
    base = p0 if f0 <= f1 and f0 <= f2 else (p1 if f1 <= f2 else p2)
    return Anchor(base, _sum(scaled_difference(o, base, 1.0 / unit), back), unit, corners, 0)


@inlined
def _is_beyond(a, b, c, d):
    """Whether a b >= c d for pairs, up to rounding: then a weight, c d - a b, is 0 or less."""
    one, other = product(a, b), product(c, d)
    return minus(other, one)[0] <= _TINY * (abs(one[0]) + abs(other[0]))


@kernel
def far_from(anchor, o):
    """The distance of a point from an anchor along the axis where it is largest."""
    way = heads(from_anchor(anchor, o, 1.0))
    return largest_component(way)
