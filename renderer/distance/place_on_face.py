"""The place of a point on a face, as barycentrics that are exact at edges and corners, and its distance from there."""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import cross_pairs, heads, power_below, scaled_difference
from renderer.numerics.simd import minimum, pointer
from renderer.numerics.vec3 import (
    barycentric,
    cross,
    dot,
    largest_component,
    largest_of_three,
    length,
    row3,
    scale,
    sub,
)
from renderer.trace.starts.anchor import anchor_of, far_from
from renderer.trace.starts.record import BARYCENTRIC, Start, corners_of

# 32 roundings of float64, and 8 of float32.
DOUBLE, SINGLE = 2.0**-48, 2.0**-21
# A point is exactly on an edge where the product of the vectors along it and to the point is less, of vectors of size
# about 1.
_EXACT = 2.0**-80


@kernel
def anchor_all(vertices, faces, points, chosen, rough, codes, anchors):
    """Write codes and anchors of points on faces ``chosen`` (n,); nothing for face -1.

    A point is on an edge if it is nearer than DOUBLE of its largest coordinate; if it is farther from its face and
    ``rough`` (n,), SINGLE takes the place of DOUBLE. At a corner the anchor is the corner. A point inside a face,
    within DOUBLE, or exactly on an edge is its own anchor, as it may lie exactly on other faces, such as at the foot of
    a wall. Otherwise the anchor has barycentrics.
    """
    for i in range(len(points)):
        if chosen[i] >= 0:
            p0, p1, p2 = corners_of(pointer(vertices), pointer(faces), chosen[i], 1.0)
            o = row3(pointer(points), i)
            largest = largest_component(o)
            u, v = _weights_of(p0, p1, p2, o, DOUBLE * largest)
            near = _measured(p0, p1, p2, u, v, o, DOUBLE * largest) <= DOUBLE * largest
            if rough[i] and not near:
                u, v = _weights_of(p0, p1, p2, o, SINGLE * largest)
            code, anchor = np.int64(0), o
            if u == 1.0 or v == 1.0 or (u == 0.0 and v == 0.0):
                anchor = p1 if u == 1.0 else (p2 if v == 1.0 else p0)
            elif not (near and _is_exact(p0, p1, p2, u, v, o)):
                code, anchor = np.int64(BARYCENTRIC), (u, v, 0.0)
            codes[i] = code
            for k in range(3):
                anchors[i, k] = anchor[k]


@inlined
def _measured(p0, p1, p2, u, v, o, enough):
    """The distance of a point from a face along the axis where it is largest; with twice the digits, unless it is
    within ``enough`` of the place of barycentrics u and v.
    """
    distance = largest_component(sub(o, barycentric(p0, p1, p2, u, v)))
    return distance if distance <= enough else far_from(anchor_of(Start((p0, p1, p2), o, 0, 0)), o)


@kernel
def _is_exact(p0, p1, p2, u, v, o):
    """Whether a point with barycentrics u and v is inside a face, or exactly on the edge if u and v are."""
    w = 1.0 - u - v
    if w == 0.0:
        return u > 0.0 and v > 0.0 and _is_between(p1, p2, o)
    if u == 0.0:
        return v > 0.0 and _is_between(p0, p2, o)
    return v > 0.0 or _is_between(p0, p1, o)


@inlined
def _is_between(p, q, o):
    """Whether a point is on the line of two others, with twice the digits."""
    unit = 1.0 / power_below(largest_component(sub(q, p)))
    across = cross_pairs(scaled_difference(q, p, unit), scaled_difference(o, p, unit))
    return largest_component(heads(across)) <= _EXACT


@kernel
def measure_all(vertices, faces, points, chosen, enough, distances):
    """Write the distances of points from faces along the axis where they are largest; approximate up to ``enough``
    (n,).
    """
    for i in range(len(points)):
        p0, p1, p2 = corners_of(pointer(vertices), pointer(faces), chosen[i], 1.0)
        o = row3(pointer(points), i)
        u, v = _weights_of(p0, p1, p2, o, 0.0)
        distances[i] = _measured(p0, p1, p2, u, v, o, enough[i])


@inlined
def _over(a, size):
    return a[0] / size, a[1] / size, a[2] / size


@kernel
def _weights_of(p0, p1, p2, o, room):
    """u and v of the point of a face nearest to o; a point within ``room`` of an edge is on it."""
    s0, s1, s2 = sub(p2, p1), sub(p0, p2), sub(p1, p0)
    size = largest_of_three(s0, s1, s2)
    if size == 0.0:
        return 0.0, 0.0
    # In units of the face, so that no product overflows or vanishes.
    s0, s1, s2 = _over(s0, size), _over(s1, size), _over(s2, size)
    w0, w1, w2, room = _over(sub(o, p0), size), _over(sub(o, p1), size), _over(sub(o, p2), size), room / size
    n = cross(s2, scale(s1, -1.0))
    area = length(n)
    # The double areas of the point with each side.
    a = _beyond(dot(cross(s0, w1), n) / area, room * length(s0))
    b = _beyond(dot(cross(s1, w2), n) / area, room * length(s1))
    c = _beyond(dot(cross(s2, w0), n) / area, room * length(s2))
    if not a + b + c > 0.0:
        # A face without area is its longest side.
        a, b, c = _along_longest(s0, s1, s2, w0, w1, w2, room)
    return _exact_shares(a, b, c)


@inlined
def _beyond(part, room):
    """A number if it exceeds some room, else 0, also for NaN."""
    return part if part > room else 0.0


@inlined
def _exact_shares(a, b, c):
    """u and v of three weights >= 0, not all 0: exactly 0 or 1 at corners, 1 in total on the side opposite to the first
    corner.
    """
    whole = a + b + c
    if b == whole or c == whole:
        return (1.0 if b == whole else 0.0), (1.0 if c == whole else 0.0)
    u, v = b / whole, c / whole
    # What is left of 1 is exact if that is at least a half.
    if a == 0.0:
        return (u, 1.0 - u) if u >= 0.5 else (1.0 - v, v)
    return u, v


@kernel
def _along_longest(s0, s1, s2, w0, w1, w2, room):
    """Weights of the nearest point of the longest side; within ``room`` of a corner, those of the corner.

    Side s0 is opposite to the first corner, from which w0 leads to the point; likewise s1, s2.
    """
    l0, l1, l2 = length(s0), length(s1), length(s2)
    d0, d1, d2 = length(w0), length(w1), length(w2)
    least = minimum(d0, minimum(d1, d2))
    if not least > room:
        return (1.0, 0.0, 0.0) if d0 == least else ((0.0, 1.0, 0.0) if d1 == least else (0.0, 0.0, 1.0))
    if l0 >= l1 and l0 >= l2:
        share = _share_along(s0, w1, l0)
        return 0.0, 1.0 - share, share
    if l1 >= l2:
        share = _share_along(s1, w2, l1)
        return share, 0.0, 1.0 - share
    share = _share_along(s2, w0, l2)
    return 1.0 - share, share, 0.0


@inlined
def _share_along(side, way, size):
    """The share along a side, of some length, of its point nearest to the end of a vector from its first corner."""
    along = dot(side, way) / size
    return minimum(along / size, 1.0) if along > 0.0 else 0.0
