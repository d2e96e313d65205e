"""Exact signs of areas and volumes: the side of a line or plane of a point, and whether it lies on a face."""

import numpy as np

from renderer.jit.decorators import apart, inlined, kernel
from renderer.numerics.double_double import power_below
from renderer.numerics.expansions import OUT_OF_RANGE, expand_area, expand_slope, expand_volume, sign_of
from renderer.numerics.simd import maximum, minimum

# What all functions here say where products would vanish or overflow.
UNDECIDED = 2
# An axis is stretched by that at most, so that none becomes infinite.
_MOST = 2.0**1000


@apart
def area_sign(a, b, p, parts):
    """The sign of (a - p) x (b - p) of points (x, y), 1, 0, -1, or UNDECIDED; ``parts`` is memory for an expansion."""
    count = expand_area(a, b, p, parts)
    if count == OUT_OF_RANGE:
        x, y = balance(a[0], b[0], b[0], p[0]), balance(a[1], b[1], b[1], p[1])
        count = expand_area((a[0] * x, a[1] * y), (b[0] * x, b[1] * y), (p[0] * x, p[1] * y), parts)
    return UNDECIDED if count == OUT_OF_RANGE else sign_of(parts, count)


@apart
def volume_sign(a, b, c, p, parts):
    """The sign of (a - p) . ((b - p) x (c - p)), like ``area_sign``."""
    return _sign_in_range(expand_volume, a, b, c, p, parts)


@apart
def slope_sign(a, b, c, d, parts):
    """The sign of ((b - a) x (c - a)) . d, like ``area_sign``."""
    return _sign_in_range(expand_slope, a, b, c, d, parts)


@inlined
def _sign_in_range(expand, a, b, c, d, parts):
    """The sign of the expansion ``expand`` of four points, which are stretched if products are out of range."""
    count = expand(a, b, c, d, parts)
    if count == OUT_OF_RANGE:
        s = balance(a[0], b[0], c[0], d[0]), balance(a[1], b[1], c[1], d[1]), balance(a[2], b[2], c[2], d[2])
        count = expand(stretched(a, s), stretched(b, s), stretched(c, s), stretched(d, s), parts)
    return UNDECIDED if count == OUT_OF_RANGE else sign_of(parts, count)


@kernel
def balance(a, b, c, d):
    """The power of two by which to stretch an axis so that its least and largest coordinates are equally far from 1. It
    changes no sign, and brings products such as 1e-310 times 1 into range.
    """
    least, most = np.inf, 0.0
    for x in (abs(a), abs(b), abs(c), abs(d)):
        least, most = (minimum(least, x) if x != 0.0 else least), maximum(most, x)
    return power_below(minimum(1.0 / (np.sqrt(least) * np.sqrt(most)), _MOST)) if most != 0.0 else 1.0


@inlined
def stretched(a, s):
    """A point whose axes are stretched."""
    return a[0] * s[0], a[1] * s[1], a[2] * s[2]


@inlined
def differ(s0, s1, s2):
    """Whether signs contradict each other; 0 contradicts none."""
    return (s0 > 0 or s1 > 0 or s2 > 0) and (s0 < 0 or s1 < 0 or s2 < 0)


@kernel
def lies_within(a, b, c, p, parts):
    """Whether a point in the plane of a face lies on the face, or UNDECIDED.

    Seen along each axis, the point must lie within the face's outline. A face that looks like a line along every axis
    is one; then coordinates alone decide.
    """
    informed = False
    for _ in range(3):
        a, b, c, p = (a[1], a[2], a[0]), (b[1], b[2], b[0]), (c[1], c[2], c[0]), (p[1], p[2], p[0])
        s0, s1, s2 = area_sign(b, c, p, parts), area_sign(c, a, p, parts), area_sign(a, b, p, parts)
        if s0 == UNDECIDED or s1 == UNDECIDED or s2 == UNDECIDED:
            return UNDECIDED
        if differ(s0, s1, s2):
            return 0
        informed = informed or s0 != 0 or s1 != 0 or s2 != 0
    if informed:
        return 1
    for k in range(3):
        if p[k] < min(a[k], b[k], c[k]) or p[k] > max(a[k], b[k], c[k]):
            return 0
    return 1
