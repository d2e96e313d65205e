"""The distance of a point from a face, with twice the digits: rounded once, and 0 only on the face.

The nearest point is inside the face if the point, seen along the normal, is on the inner side of all edges; otherwise
it is on an edge. Two faces that share an edge compute the same bits for it.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import (
    cross_pairs,
    dot_pairs,
    length_pair,
    negative,
    power_below,
    quotient,
    scaled_difference,
)
from renderer.numerics.expansions import OUT_OF_RANGE, PARTS, expand_area, expand_volume, pair_of
from renderer.numerics.predicates import UNDECIDED, lies_within, volume_sign
from renderer.numerics.simd import maximum, store

# Shares of the terms of a sum of products of pairs, which errs by 2^-98 of them. Below CANCELLED it loses so many
# digits that it is computed as an expansion. Below LOST its sign is uncertain: a point so near an edge, seen along the
# normal, counts as on it, which changes its distance from the face by at most LOST of its reach. A distance so near the
# middle of two float64 counts as the middle.
_CANCELLED, _LOST = 2.0**-40, 2.0**-90
_TINIEST = 2.0**-1000
# Where ``parts`` has a number behind the expansion: not 0 once products of a distance have vanished or overflowed.
UNDECIDED_FLAG = PARTS
# More than any distance in units of the reach.
_BEYOND = 2.0**1000


class FaceView(NamedTuple):
    """A face seen from a point: corners less the point and sides, as pairs, and the factors that scaled them."""

    pa: Any
    pb: Any
    pc: Any
    ab: Any
    bc: Any
    ca: Any
    to_reach: float
    to_side: float


@kernel
def distance_to_face(a, b, c, p, parts):
    """The distance of the point p from a face, and u and v of the face's nearest point.

    The error is less than an ulp, or than 2^-90 of the distance of the farthest corner if that is more, and the
    distance is 0 only on the face. If float64 cannot decide, ``parts``, memory for an expansion, has a number other
    than 0 at UNDECIDED_FLAG.
    """
    view = _view_face(a, b, c, p)
    normal = _normal(view, a, b, c, parts)
    # Find on which side of each edge the point lies, as seen along the normal.
    wa = dot_pairs(view.pb, cross_pairs(view.bc, normal))[0]
    wb = dot_pairs(view.pc, cross_pairs(view.ca, normal))[0]
    wc = dot_pairs(view.pa, cross_pairs(view.ab, normal))[0]
    limit = _LOST * _largest(normal)
    on_a, on_b, on_c = limit * _largest(view.bc), limit * _largest(view.ca), limit * _largest(view.ab)
    # Over the face, measure along the normal.
    # rule: over-face
    if wa > on_a and wb > on_b and wc > on_c:
        height, total = _height(view, normal, a, b, c, p, parts), wa + wb + wc
        distance = _rounded(quotient(height, length_pair(normal)))
        return distance / view.to_reach, wb / total, wc / total
    # Elsewhere take the nearest of the edges beyond which the point lies.
    distance, u, v = _BEYOND, 0.0, 0.0
    if wc <= on_c:
        d, t = _distance_to_edge(a, b, p, view.pa, view.pb, view.ab, view, parts)
        if d < distance:
            distance, u, v = d, t, 0.0
    if wa <= on_a:
        d, t = _distance_to_edge(b, c, p, view.pb, view.pc, view.bc, view, parts)
        if d < distance:
            distance, u, v = d, 1.0 - t, t
    if wb <= on_b:
        d, t = _distance_to_edge(c, a, p, view.pc, view.pa, view.ca, view, parts)
        if d < distance:
            distance, u, v = d, 0.0, 1.0 - t
    # Where rounding could decide, find exactly whether the point lies on the face.
    if distance < 2.0 * _LOST:
        distance = _on_or_beside(a, b, c, p, distance, parts)
    return distance / view.to_reach, u, v


@kernel
def _on_or_beside(a, b, c, p, distance, parts):
    """``distance``, or 0 if the point lies on the face."""
    side = volume_sign(a, b, c, p, parts)
    on = lies_within(a, b, c, p, parts) if side == 0 else np.int64(side == UNDECIDED) * UNDECIDED
    if on == 1:
        return 0.0
    if on == UNDECIDED or distance == 0.0:
        store(parts, UNDECIDED_FLAG, 1.0)
    return distance


@kernel
def _view_face(a, b, c, p):
    """The ``FaceView`` of a face from p."""
    reach, side = _TINIEST, _TINIEST
    for k in range(3):
        reach = maximum(reach, maximum(maximum(abs(a[k] - p[k]), abs(b[k] - p[k])), abs(c[k] - p[k])))
        side = maximum(side, maximum(maximum(abs(b[k] - a[k]), abs(c[k] - b[k])), abs(a[k] - c[k])))
    to_reach, to_side = 1.0 / power_below(reach), 1.0 / power_below(side)
    return FaceView(
        scaled_difference(a, p, to_reach), scaled_difference(b, p, to_reach), scaled_difference(c, p, to_reach),
        scaled_difference(b, a, to_side), scaled_difference(c, b, to_side), scaled_difference(a, c, to_side),
        to_reach, to_side,
    )  # fmt: skip


@inlined
def _largest(vector):
    """The largest component of a vector of pairs, without its sign."""
    return maximum(maximum(abs(vector[0][0]), abs(vector[1][0])), abs(vector[2][0]))


@inlined
def _scaled(pair, x, y):
    return pair[0] * x * y, pair[1] * x * y


@kernel
def _normal(view, a, b, c, parts):
    """The cross product of a face's sides."""
    normal = cross_pairs(view.ca, view.ab)
    if _largest(normal) < _CANCELLED:
        return _expanded(b, c, a, view.to_side, view.to_side, normal, parts)
    return normal


@kernel
def _expanded(a, b, p, first, second, otherwise, parts):
    """(a - p) x (b - p) times two factors, by expansions, or ``otherwise`` if they are out of range."""
    x = expand_area((a[1], a[2]), (b[1], b[2]), (p[1], p[2]), parts)
    x_pair = pair_of(parts, x)
    y = expand_area((a[2], a[0]), (b[2], b[0]), (p[2], p[0]), parts)
    y_pair = pair_of(parts, y)
    z = expand_area((a[0], a[1]), (b[0], b[1]), (p[0], p[1]), parts)
    z_pair = pair_of(parts, z)
    if x == OUT_OF_RANGE or y == OUT_OF_RANGE or z == OUT_OF_RANGE:
        store(parts, UNDECIDED_FLAG, 1.0)
        return otherwise
    return _scaled(x_pair, first, second), _scaled(y_pair, first, second), _scaled(z_pair, first, second)


@kernel
def _height(view, normal, a, b, c, p, parts):
    """The distance of the point from the face's plane times the length of the normal."""
    height = dot_pairs(view.pa, normal)
    # rule: cancelled-height
    if abs(height[0]) < _CANCELLED * _largest(normal):
        count = expand_volume(a, b, c, p, parts)
        if count == OUT_OF_RANGE:
            store(parts, UNDECIDED_FLAG, 1.0)
        else:
            height = _scaled(_scaled(pair_of(parts, count), view.to_side, view.to_reach), view.to_side, 1.0)
    return height if height[0] >= 0.0 else (-height[0], -height[1])


@kernel
def _distance_to_edge(a, b, p, pa, pb, ab, view, parts):
    """The distance of the point from the edge from a to b, in units of its reach, and the share of the edge from a."""
    if _precedes(b, a):
        d, t = _distance_to_ordered(b, a, p, pb, pa, negative(ab), view, parts)
        return d, 1.0 - t
    return _distance_to_ordered(a, b, p, pa, pb, ab, view, parts)


@kernel
def _distance_to_ordered(a, b, p, pa, pb, ab, view, parts):
    behind, ahead = -dot_pairs(pa, ab)[0], dot_pairs(pb, ab)[0]
    # rule: nearest-corner
    if behind <= 0.0:
        return _rounded(length_pair(pa)), 0.0
    if ahead <= 0.0:
        return _rounded(length_pair(pb)), 1.0
    area = cross_pairs(pa, ab)
    # rule: cancelled-area
    if _largest(area) < _CANCELLED * _largest(pa):
        area = _expanded(a, b, p, view.to_reach, view.to_side, area, parts)
    return _rounded(quotient(length_pair(area), length_pair(ab))), behind / (behind + ahead)


@kernel
def _rounded(pair):
    """A pair >= 0 as one float64: to even if halfway, also where the last digits of the pair are lost.

    So equal distances, as of faces in one plane, stay equal.
    """
    head, tail = pair[0], pair[1]
    bits = np.int64(np.float64(head).view(np.int64))
    other = np.int64(bits + (1 if tail > 0.0 else -1)).view(np.float64)
    if tail != 0.0 and bits & 1 != 0 and abs(2.0 * abs(tail) - abs(other - head)) <= _LOST * head:
        return other
    return head


@inlined
def _precedes(a, b):
    """The order of two corners, by x, then y, then z."""
    return a[0] < b[0] or (a[0] == b[0] and (a[1] < b[1] or (a[1] == b[1] and a[2] < b[2])))
