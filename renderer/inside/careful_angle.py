"""The solid angle of a face from a point however near to its edges and plane, without cancellation.

With a corner a, A the angle there of the face as seen on a sphere, and (ab) and (ac) the angles at the point between
the corners, half the solid angle is the angle of the complex number e^(iA) + cot((ab)/2) cot((ac)/2). Its size is
cos((bc)/2) / (sin((ab)/2) sin((ac)/2)), at least cos((bc)/2). Choose the corner a for which (bc) is the smallest of the
three: at most a third of a turn, so the size is at least 1/2. An absolute error of 2^-50 then gives the angle to 2^-47.
Float64 is enough if e^(iA) is computed from the directions of a x b and a x c to 2^-50, however short these are.
Source: Todhunter, Spherical Trigonometry, 1886, the spherical excess from two sides and the angle between them.
"""

import math

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import cross_pairs, heads, power_below, scaled_difference
from renderer.numerics.expansions import OUT_OF_RANGE, expand_area, pair_of
from renderer.numerics.predicates import UNDECIDED, balance, stretched, volume_sign
from renderer.numerics.simd import maximum
from renderer.numerics.vec3 import cross, dot, largest_component, length, scale, sub

# The real part of a face's number, for directions of size one, above which float64 gives its angle: both parts err by
# 2^-49. Below it the largest angle between two corners is at least 108 degrees, and so the second at least 54.
PLAIN = 2.0**-5
# A vector product of pairs, at most 2 in each component, errs by 2^-98.
_LEAST_PRODUCT = 2.0**-46
# A sine of the corner's angle above it has its true sign.
_LEAST_SINE = 2.0**-40
# Nearer than this to a corner differences are scaled by its inverse: those of float64 are 2^-74 of it at least.
_TINIEST = 2.0**-1000
# Above it a product has all its digits.
_LEAST = 2.0**-900


@kernel
def careful_angle(a, b, c, p, parts):
    """Half the solid angle of a face from p, within 2^-47; NaN if products leave float64's range.

    It is 0 for a point on the face: the mean of its two sides.
    """
    if (
        largest_component(sub(a, p)) == 0.0
        or largest_component(sub(b, p)) == 0.0
        or largest_component(sub(c, p)) == 0.0
    ):
        return 0.0
    x, y, z = _direction(a, p), _direction(b, p), _direction(c, p)
    xy, yz, zx = dot(x, y), dot(y, z), dot(z, x)
    rest = (1.0 + xy) + (yz + zx)
    if rest > PLAIN:
        return math.atan2(dot(x, cross(y, z)), rest)
    if yz >= xy and yz >= zx:
        return _angle_at(a, b, c, p, x, y, z, parts)
    if zx >= xy:
        return _angle_at(b, c, a, p, y, z, x, parts)
    return _angle_at(c, a, b, p, z, x, y, parts)


@kernel
def _angle_at(a, b, c, p, x, y, z, parts):
    """The angle at its corner between the two sides longest from the point; x, y, z: directions to corners."""
    m, n = _normal(a, b, p, parts), _normal(a, c, p, parts)
    across = cross(m, n)
    sine, side = length(across), 1 if dot(across, x) > 0.0 else -1
    if not sine > _LEAST_SINE:
        side = volume_sign(a, b, c, p, parts)
        if side == 0 or side == UNDECIDED:
            return 0.0 if side == 0 else np.nan
    return math.atan2(side * sine, dot(m, n) + _cotangent(x, y) * _cotangent(x, z))


@kernel
def _cotangent(x, y):
    """The cotangent of half the angle between two directions; at most 2, as that angle is at least 54 degrees."""
    return length(cross(x, y)) / (1.0 - dot(x, y))


@kernel
def _normal(a, b, p, parts):
    """The direction of (a - p) x (b - p); NaN if that is 0 or products leave float64's range."""
    m = heads(cross_pairs(_near_one(a, p), _near_one(b, p)))
    if _largest(m) < _LEAST_PRODUCT:
        # Digits that cancel: their exact sum.
        m = _expand_normal(a, b, p, (1.0, 1.0, 1.0), parts)
        if not _largest(m) > _LEAST:
            s = balance(a[0], b[0], b[0], p[0]), balance(a[1], b[1], b[1], p[1]), balance(a[2], b[2], b[2], p[2])
            m = _expand_normal(stretched(a, s), stretched(b, s), stretched(p, s), s, parts)
            if not _largest(m) > _LEAST:
                return np.nan, np.nan, np.nan
    m = scale(m, 1.0 / power_below(_largest(m)))
    return scale(m, 1.0 / length(m))


@kernel
def _expand_normal(a, b, p, s, parts):
    """(a - p) x (b - p) times a positive number, for points whose axes were stretched by s; NaN out of range."""
    most = maximum(maximum(s[0], s[1]), s[2])
    x = _expand((a[1], a[2]), (b[1], b[2]), (p[1], p[2]), parts) * (s[0] / most)
    y = _expand((a[2], a[0]), (b[2], b[0]), (p[2], p[0]), parts) * (s[1] / most)
    z = _expand((a[0], a[1]), (b[0], b[1]), (p[0], p[1]), parts) * (s[2] / most)
    return x, y, z


@kernel
def _expand(a, b, p, parts):
    count = expand_area(a, b, p, parts)
    return np.nan if count == OUT_OF_RANGE else pair_of(parts, count)[0]


@inlined
def _largest(v):
    """The largest component without its sign; NaN if one is NaN or infinite."""
    return maximum(maximum(abs(v[0]), abs(v[1])), abs(v[2])) + 0.0 * (v[0] + v[1] + v[2])


@kernel
def _direction(a, p):
    """The unit vector from p to a."""
    x = heads(_near_one(a, p))
    return scale(x, 1.0 / length(x))


@inlined
def _near_one(a, p):
    """a - p times a power of two, with a largest component near 1; this changes no angle."""
    return scaled_difference(a, p, 1.0 / power_below(maximum(largest_component(sub(a, p)), _TINIEST)))
