"""Resolves uncertain hits: those whose t or determinant rounding could decide, and those at an edge.

Afterwards three rules hold. At an edge, exact signs decide whether the ray hits a face. t is clamped to the ray's
interval inside the face's box, so a search never skips a box that contains the hit. A hit with an uncertain determinant
is computed with twice the digits, and counts if the ray comes within ROUNDING of the face.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import apart, inlined, kernel
from renderer.numerics.double_double import (
    LEAST_NORMAL,
    as_pairs,
    cross_pairs,
    dot_pairs,
    heads,
    minus,
    power_below,
    product,
    quotient,
    scaled_difference,
)
from renderer.numerics.predicates import UNDECIDED, lies_within, slope_sign, volume_sign
from renderer.numerics.simd import local_doubles, maximum, minimum
from renderer.numerics.vec3 import add, cross, dot, largest_component, largest_of_three, length, normalized, scale, sub
from renderer.trace.best import FaceHit
from renderer.trace.edge_signs import coordinate, corners_at, exact_sides, passes_within
from renderer.trace.intersect import (
    FAR_PADDING,
    LARGEST_FLOAT,
    box_limit,
    face_range,
    largest_of,
    longest_axis,
    make_slab,
    room_of,
    round_down,
    turned,
)

# How near a ray must come to a face to hit it, in units of the power of two below L, the largest component of a corner
# relative to the origin. A sheared coordinate errs by 5 u L (``spawn`` derives it), so a ray that passes a face on the
# same side of all its edges, as rounded, passes within 7.1 u L of it, less than 2^-50 L. This is at least eight times
# as much, so no closed mesh opens. What float64 adds below, 2^-50 L at most, does not matter.
ROUNDING = 2.0**-46
# The least t that ``box_limit`` allows, as a share of the entry of a box, and a rounding more.
_BEFORE = (1.0 + 2.0**-30) / np.float64(FAR_PADDING)
# A face thinner than this share of its length is a line: its normal errs by 2^-100, its product with a corner by 2^-97,
# and so the distance from the plane of any other face by 2^-49, a sixteenth of ROUNDING.
LINE = 2.0**-48
# A product of three vectors is wrong in sign only where it is less than this share of its terms: 16 roundings.
_NEAR = 2.0**-48
# What ``_height_sign`` says of an origin that is not near.
_FAR = 3
# What a place along the longest side errs by at most, as a share of it and of the distance: eight roundings.
_SLACK = 2.0**-50
# The least normal number, which is divided by in place of zero.
_LEAST = 2.0**-1022


@apart
def resolve_uncertain(tree, at, ray, shear, hit, determinant_uncertain):
    """The ``FaceHit`` that an uncertain hit on the face at ``at`` becomes.

    A ray that begins exactly on the face hits it at t = 0. t is clamped to the ray's interval inside the face's own
    box, in the arithmetic of ``enter_boxes``. That is monotone: the ray enters no box around this one later, and leaves
    none earlier. The result depends on the ray and the face alone, not on t_min.
    """
    height = _height_sign(tree, at, ray)
    if height == 0:
        holds, begun = _met_at_start(tree, at, ray, shear)
        if holds:
            return begun
    if not passes_within(exact_sides(tree, at, shear)):
        return FaceHit(np.nan, 0.0, 0.0, 1.0)
    # From the ray itself: to keep its ``Slabs`` for this would cost every ray.
    largest = largest_of(ray)
    t0, t1 = _own_box(tree, at, ray, largest)
    first, last = np.float64(t0) * _BEFORE, np.float32(t1 * FAR_PADDING)
    t, u, v, w = hit.t, hit.u, hit.v, hit.w
    # rule: uncertain-determinant
    if determinant_uncertain:
        t, u, v = _meet_face(tree, at, ray, first / largest, np.float64(last) / largest)
        w = -1.0 if _slope(tree, at, ray) * shear.direction_z > 0.0 else 1.0
        u, v = u * w, v * w
    elif height != _FAR and height != 0:
        # Rounding may have made this t and its sign.
        slope = _slope(tree, at, ray)
        t = height * abs(_exact_t(tree, at, ray)) * (1.0 if slope > 0 else -1.0)
    if not (t0 <= last and t0 <= LARGEST_FLOAT and t >= 0.0):
        return FaceHit(np.nan, u, v, w)
    if round_down(t * largest) > last:
        t = np.float64(last) / largest
    if t0 > box_limit(t, largest):
        # rule: t-within-box
        t = first / largest
    return FaceHit(t, u, v, w)


@kernel
def _height_sign(tree, at, ray):
    """The exact sign of normal . (p0 - origin) for an origin near the plane of a face, 0 in the plane; else _FAR."""
    (p0, p1, p2), o = corners_at(tree, at), _origin(ray)
    one, other, way = sub(p1, p0), sub(p2, p0), sub(p0, o)
    normal = cross(one, other)
    size = largest_component(one) * largest_component(other) * largest_component(way)
    if abs(dot(normal, way)) > size * _NEAR or largest_component(normal) == 0.0:
        return _FAR
    sign = volume_sign(p0, p1, p2, o, local_doubles())
    # Negative is the volume of (p0 - o), (p1 - o), (p2 - o) where the normal looks away from o.
    return _FAR if sign == UNDECIDED else sign


@kernel
def _scaled_normal(tree, at):
    """The normal of a face as pairs; its sides are scaled by a power of two."""
    p0, p1, p2 = corners_at(tree, at)
    side = maximum(largest_component(sub(p1, p0)), largest_component(sub(p2, p0)))
    unit = 1.0 / power_below(side)
    return cross_pairs(scaled_difference(p1, p0, unit), scaled_difference(p2, p0, unit))


@inlined
def _origin(ray):
    return ray.ox, ray.oy, ray.oz


@inlined
def _direction(ray):
    """A ray's direction scaled by a power of two, and that power."""
    d = ray.dx, ray.dy, ray.dz
    unit = power_below(largest_component(d))
    return scale(d, 1.0 / unit), unit


@kernel
def _slope(tree, at, ray):
    """The sign of normal . direction of a face and a ray."""
    (p0, p1, p2), (d, _) = corners_at(tree, at), _direction(ray)
    return slope_sign(p0, p1, p2, d, local_doubles())


@kernel
def _exact_t(tree, at, ray):
    """t for the plane of a face, with twice the digits."""
    (p0, _, _), o, (d, d_unit) = corners_at(tree, at), _origin(ray), _direction(ray)
    way = sub(p0, o)
    unit = power_below(maximum(largest_component(way), LEAST_NORMAL))
    normal = _scaled_normal(tree, at)
    height = dot_pairs(normal, scaled_difference(p0, o, 1.0 / unit))
    return quotient(height, dot_pairs(normal, as_pairs(d)))[0] * unit / d_unit


@kernel
def _met_at_start(tree, at, ray, shear):
    """Whether a ray that starts in the plane of a face starts on the face, and its hit: t = 0, unless the ray lies in
    the plane.
    """
    (p0, p1, p2), o, slope = corners_at(tree, at), _origin(ray), _slope(tree, at, ray)
    holds = lies_within(p0, p1, p2, o, local_doubles()) == 1
    if not holds or slope == 0:
        return holds, FaceHit(np.nan, 0.0, 0.0, 1.0)
    a, b, c = sub(p0, o), sub(p1, o), sub(p2, o)
    e0, e1, e2 = length(cross(b, c)), length(cross(c, a)), length(cross(a, b))
    turn, whole = (-1.0 if slope * shear.direction_z > 0.0 else 1.0), e0 + e1 + e2
    return holds, FaceHit(0.0, turn * (e1 / whole), turn * (e2 / whole), turn)


@inlined
def _own_box(tree, at, ray, largest):
    """The ray's interval inside a face's own box, in the arithmetic of ``enter_boxes``."""
    t0, t1 = np.float32(0.0), np.float32(np.inf)
    t0, t1 = _meet_slab(tree, at, 0, ray.ox, ray.dx, largest, t0, t1)
    t0, t1 = _meet_slab(tree, at, 1, ray.oy, ray.dy, largest, t0, t1)
    return _meet_slab(tree, at, 2, ray.oz, ray.dz, largest, t0, t1)


@kernel
def _meet_slab(tree, at, axis, o, d, largest, t0, t1):
    """Narrow [t0, t1] to one axis of a face's own box."""
    row = at + 4 * axis
    near, far = face_range(coordinate(tree, row), coordinate(tree, row + 12), coordinate(tree, row + 24))
    near_row, far_row, near_origin, far_origin, near_inverse, far_inverse = make_slab(axis, o, d, largest, room_of(0.0))
    if near_row > far_row:
        near, far = far, near
    n = np.float32(np.float32(near - near_origin) * near_inverse)
    f = np.float32(np.float32(far - far_origin) * far_inverse)
    return (n if n > t0 else t0), (f if f < t1 else t1)


@inlined
def _corner(tree, at, axis):
    return turned(axis, coordinate(tree, at), coordinate(tree, at + 4), coordinate(tree, at + 8))


class _Face(NamedTuple):
    """A face as a ray sees it, its longest side from the first corner to the second, all scaled by powers of two.

    first, second  the corners of the longest side relative to the origin, as pairs
    along, other   the sides from the first corner to the second and to the apex, as pairs
    back           the side from the second corner to the apex, rounded
    direction      the ray's direction, its largest component from 1 to 2
    t_unit         one t in these units, in the ray's own
    ratio          the unit of the corners over that of the sides
    """

    first: Any
    second: Any
    along: Any
    other: Any
    back: Any
    direction: Any
    t_unit: float
    ratio: float


@kernel
def _meet_face(tree, at, ray, least, most):
    """t, u and v of a face, with twice the digits; t is NaN for a miss.

    From least to most the ray is within the face's box.
    """
    # In the order of the ray's axes, so that the bits do not depend on the names of the axes.
    axis = longest_axis(ray)
    p0, p1, p2 = _corner(tree, at, axis), _corner(tree, at + 12, axis), _corner(tree, at + 24, axis)
    o, d = turned(axis, ray.ox, ray.oy, ray.oz), turned(axis, ray.dx, ray.dy, ray.dz)
    l0, l1, l2 = length(sub(p2, p1)), length(sub(p0, p2)), length(sub(p1, p0))
    if l2 >= l0 and l2 >= l1:
        return _meet_side(p0, p1, p2, o, d, least, most)
    if l1 >= l0:
        t, second, apex = _meet_side(p2, p0, p1, o, d, least, most)
        return t, apex, maximum(1.0 - second - apex, 0.0)
    t, second, apex = _meet_side(p1, p2, p0, o, d, least, most)
    return t, maximum(1.0 - second - apex, 0.0), second


@kernel
def _meet_side(a, b, c, o, d, least, most):
    """t, clamped to least and most, and the weights of b and c of a face whose longest side is from a to b."""
    reach = largest_of_three(sub(a, o), sub(b, o), sub(c, o))
    far, d_unit, side = power_below(reach), power_below(largest_component(d)), power_below(largest_component(sub(b, a)))
    face = _Face(
        scaled_difference(a, o, 1.0 / far),
        scaled_difference(b, o, 1.0 / far),
        scaled_difference(b, a, 1.0 / side),
        scaled_difference(c, a, 1.0 / side),
        scale(sub(c, b), 1.0 / side),
        scale(d, 1.0 / d_unit),
        far / d_unit,
        far / side,
    )
    normal, low, high = cross_pairs(face.along, face.other), least / face.t_unit, most / face.t_unit
    if largest_component(heads(normal)) <= LINE:
        t, second, apex = _meet_line(face, low, high)
    else:
        t, second, apex = _meet_plane(face, normal, low, high)
    return t * face.t_unit, second, apex


@kernel
def _meet_plane(face, normal, low, high):
    """t and weights of a face that is no line: where the ray meets its plane, clamped to the face's outline."""
    d, n = face.direction, heads(normal)
    numerator, determinant = dot_pairs(normal, face.first), dot_pairs(normal, as_pairs(d))
    low, high = _within_outline(face, normalized(n), low, high)
    t = numerator[0] / determinant[0]
    t += minus(numerator, product(determinant, (t, 0.0)))[0] / determinant[0]
    # A ray in the plane meets the face where it comes to its outline.
    t = minimum(t, high) if t > low else low
    passed = minus(numerator, product(determinant, (t, 0.0)))[0]
    if not (low <= high and abs(passed) <= ROUNDING * length(n)):
        return np.nan, 0.0, 0.0
    second, apex = _weights(face, n, t)
    return t, second, apex


@kernel
def _within_outline(face, normal, low, high):
    """The part of [low, high] in which a ray is over the outline of a face, widened by ROUNDING."""
    d, first, second = face.direction, heads(face.first), heads(face.second)
    along, back, other = normalized(heads(face.along)), normalized(face.back), normalized(heads(face.other))
    low, high = _beyond(cross(normal, along), first, d, low, high)
    low, high = _beyond(cross(normal, back), second, d, low, high)
    low, high = _beyond(cross(other, normal), first, d, low, high)
    # Where two sides meet at a small angle, both widened reach far beyond the corner.
    low, high = _beyond(along, first, d, low, high)
    return _beyond(scale(along, -1.0), second, d, low, high)


@inlined
def _beyond(inward, corner, d, low, high):
    """[low, high] narrowed to where a ray is beyond a line through a corner, or ROUNDING before it."""
    least, rate = dot(inward, corner) - ROUNDING, dot(inward, d)
    if rate > 0.0:
        return maximum(low, least / rate), high
    if rate < 0.0:
        return low, minimum(high, least / rate)
    return low, (high if least <= 0.0 else -1.0)


@kernel
def _weights(face, normal, t):
    """The weights of the second corner and the apex for x, the point of the ray at t.

                      apex
                     . |  .
                  . x  |     .
               .    |  |        .
            first--------------second
                 along foot             both as shares of the longest side

    The apex's weight is the height of x over that of the apex. For thin faces it errs most, so it is clamped to the
    face's range above ``along``.
    """
    side, other = heads(face.along), heads(face.other)
    point = scale(sub(scale(face.direction, t), heads(face.first)), face.ratio)
    square = dot(side, side)
    along, foot = _clamped(dot(side, point) / square, 0.0, 1.0), dot(side, other) / square
    # The place errs by some roundings, which are much of it near the ends.
    room = _SLACK * maximum(face.ratio, 1.0)
    before, behind = along + room, 1.0 - along + room
    rising = before / foot if before < foot else 1.0
    falling = behind / (1.0 - foot) if behind < 1.0 - foot else 1.0
    height = dot(cross(normal, side), point) / dot(normal, normal)
    apex = _clamped(height, 0.0, minimum(rising, falling))
    return _clamped(along - apex * foot, 0.0, 1.0 - apex), apex


@inlined
def _clamped(x, low, high):
    return minimum(maximum(x, low), high)


@kernel
def _meet_line(face, low, high):
    """t and weights of a face whose corners lie on a line: where the ray passes its longest side."""
    d = face.direction
    # Where the ray is nearest to the line. Of a ray along the side every place is as near as another.
    across = cross_pairs(as_pairs(d), face.along)
    square = maximum(dot(heads(across), heads(across)), _LEAST)
    on_line = dot_pairs(cross_pairs(face.first, face.along), across)[0] / square
    # Where that is beyond an end of the side, or out of the box, the nearest there counts.
    nearest = _place(face, on_line)
    t = _clamped(dot(nearest, d) / dot(d, d), low, high)
    second = _second(face, t)
    # It is a hit within ROUNDING of the side; NaN is none.
    if not length(sub(_place(face, t), scale(d, t))) <= ROUNDING:
        return np.nan, 0.0, 0.0
    # rule: t-on-line
    return t, second, 0.0


@inlined
def _second(face, t):
    """The weight of the second corner at the point of the longest side nearest to the ray at t."""
    along = heads(face.along)
    way = dot(sub(scale(face.direction, t), heads(face.first)), along) / dot(along, along) * face.ratio
    return _clamped(way, 0.0, 1.0)


@inlined
def _place(face, t):
    """The point of the longest side nearest to the ray at t, relative to the origin."""
    return add(heads(face.first), scale(heads(face.along), _second(face, t) / face.ratio))
