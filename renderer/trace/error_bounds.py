"""Bounds of the errors of t, computed from ray and face once t is known.

They do not depend on the way t was computed. The residual of t in the equation of the face's plane is computed with
twice the digits. Divided by the plane's slope along the ray it is the distance of t from the plane. If rounding could
decide that slope, as for very thin faces and rays along a face, the face's box bounds the error.
"""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import (
    LEAST_NORMAL,
    as_pairs,
    cross_pairs,
    dot_pairs,
    heads,
    minus,
    power_below,
    product,
    scaled_difference,
)
from renderer.numerics.simd import load, maximum, minimum, pointer, store
from renderer.numerics.vec3 import dot, largest_component, largest_of_three, row3, scale, sub, three
from renderer.trace.intersect import CORNER, ROOM, slack_of
from renderer.trace.starts.record import EDGE, SLACK, start_pointers

# A product of pairs errs by 7 * 2^-106 of itself, a sum by 3 * 2^-106. So a component of the normal errs by 2^-102 of
# its two products, and its scalar product with a vector by 2^-100 of all; the rest is room for what adds these up.
_PAIRS = 2.0**-98
# What vanishes of products of numbers up to 48, each by 2^-1074, and of coordinates by the tree's scale, as a share of
# the units of ``_plane_error``: less than 2^8 times that.
_VANISHED = 2.0**-1040
# A corner relative to the origin and its quotient by the direction: two roundings, and as much for the terms' own.
_ROUNDED = 2.0**-51
# Bounds are computed with some roundings themselves. What is denormal loses up to half of the least number, 2^-1075,
# each time that it is scaled: added where the unit changes.
_MORE, _LEAST = 1.0 + 2.0**-20, 2.0**-1073


@kernel
def bound_errors(vertices, faces, rays, rows, t, face, errors, begin, end, unit):
    """Write the bounds of the errors of the hits begin:end to ``errors``; NaN where a ray hits nothing.

    rows  the ray of each hit, of a ``RayBatch``; empty where it is the hit's own
    unit  the tree's scale, in whose units no product overflows
    """
    starts, own = start_pointers(rays.starts), len(rows) == 0
    origin_step, direction_step = 3 * np.int64(len(rays.origins) > 1), 3 * np.int64(len(rays.directions) > 1)
    origins, directions, corners = pointer(rays.origins), pointer(rays.directions), pointer(vertices)
    for i in range(begin, end):
        error, row = np.nan, load(pointer(face), i)
        if row >= 0:
            ray = i if own else load(pointer(rows), i)
            o = scale(three(origins, ray * origin_step), unit)
            d = three(directions, ray * direction_step)
            a, b, c = row3(pointer(faces), row)
            p0, p1, p2 = row3(corners, a), row3(corners, b), row3(corners, c)
            p0, p1, p2, at = scale(p0, unit), scale(p1, unit), scale(p2, unit), load(pointer(t), i) * unit
            off = _off(o, load(starts.rows, ray * starts.step + SLACK))
            plane = _plane_error(p0, p1, p2, o, d, at, off)
            box = _box_error(sub(p0, o), sub(p1, o), sub(p2, o), d, at, off)
            # False for NaN too, of a plane of which nothing is known.
            error = ((plane if plane < box else box) * _MORE + _LEAST) / unit + _LEAST
        store(pointer(errors), i, error)


@inlined
def _off(o, slack):
    """The largest distance of a ray's origin o from its start on the surface, along each axis. From a corner it is 0,
    from an edge a rounding, else less than the slack.
    """
    return slack_of(o, 0.0) if slack == EDGE else (0.0 if slack == CORNER else slack)


@kernel
def _plane_error(p0, p1, p2, o, d, t, off):
    """The bound of the error of t against a face's plane; inf if rounding could decide the plane's slope. The ray may
    start ``off`` its origin.

    With n the plane's normal, t is off by (n . (p0 - o) - t n . d) / (n . d). Sides, distances and the direction are
    scaled by powers of two to less than 4, so that no product overflows.
    """
    reach = largest_of_three(sub(p0, o), sub(p1, o), sub(p2, o))
    side = maximum(largest_component(sub(p1, p0)), largest_component(sub(p2, p0)))
    far, side = power_below(maximum(reach, LEAST_NORMAL)), power_below(maximum(side, LEAST_NORMAL))
    unit = power_below(largest_component(d))
    corner, d, t = scaled_difference(p0, o, 1.0 / far), scale(d, 1.0 / unit), t * unit / far
    one, other = scaled_difference(p1, p0, 1.0 / side), scaled_difference(p2, p0, 1.0 / side)
    normal, sizes = cross_pairs(one, other), _cross_sizes(_sizes(heads(one)), _sizes(heads(other)))
    slope = dot_pairs(normal, as_pairs(d))
    left = minus(dot_pairs(normal, corner), product(slope, (t, 0.0)))[0]
    vanished = _VANISHED / minimum(1.0, minimum(far, side))
    slope_error = _PAIRS * dot(sizes, _sizes(d)) + vanished
    left_error = _PAIRS * dot(sizes, _sizes(heads(corner))) + vanished + t * slope_error
    x, y, z = _sizes(heads(normal))
    left_error += off / far * (x + y + z)
    least = abs(slope[0]) - slope_error
    return ((abs(left) + left_error) / least * far + _LEAST) / unit if least > 0.0 else np.inf


@inlined
def _sizes(a):
    """The components of a vector without their signs."""
    return abs(a[0]), abs(a[1]), abs(a[2])


@inlined
def _cross_sizes(a, b):
    """For each component of a cross product, the sum of the sizes of its two products; a and b are without signs."""
    return a[1] * b[2] + a[2] * b[1], a[2] * b[0] + a[0] * b[2], a[0] * b[1] + a[1] * b[0]


@kernel
def _box_error(q0, q1, q2, d, t, off):
    """The bound of the error of t by the face's box; corners are relative to the origin.

    The box is wider than the face by ROOM. So a ray that misses a face by rounding only meets its plane inside the box,
    unless it is nearly in the plane. If it misses the box, the box's planes across the direction's longest component
    count.
    """
    largest, first, last, before, behind = 0.0, -np.inf, np.inf, -np.inf, np.inf
    for k in range(3):
        low, high = minimum(q0[k], minimum(q1[k], q2[k])) - off, maximum(q0[k], maximum(q1[k], q2[k])) + off
        near, far = _meet_slab(low, high, d[k])
        if abs(d[k]) > largest:
            largest, before, behind = abs(d[k]), near, far
        first, last = maximum(first, near), minimum(last, far)
    if first > last:
        first, last = before, behind
    return maximum(abs(t - first), abs(last - t))


@inlined
def _meet_slab(low, high, d):
    """The range of t in which a ray from 0 may be between two planes, or ROOM beside them."""
    room = (high - low) * ROOM + _LEAST
    low, high = low - (room + abs(low) * _ROUNDED), high + (room + abs(high) * _ROUNDED)
    if d == 0.0:
        return -np.inf, np.inf
    return (low / d, high / d) if d > 0.0 else (high / d, low / d)
