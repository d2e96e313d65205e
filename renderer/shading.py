"""Phong, Fresnel, reflection, refraction, and the offset of spawned rays, for kernels.

Vectors are tuples of float64. ``n`` is the unit normal on the side of the incoming ray, so d . n <= 0.
"""

import math

import numpy as np

from renderer.jit import inlined, kernel
from renderer.simd import larger
from renderer.vec3 import add, cross, dot, largest_component, length, scale, sub

_ROUNDOFF = 2.0**-53
# gamma(7) = 7 u / (1 - 7 u): the barycentric point's rounding (Pharr, Jakob, Humphreys, PBRT 4, section 6.8.4).
_GAMMA7 = 7.0 * _ROUNDOFF / (1.0 - 7.0 * _ROUNDOFF)
# The next ray's test of the same triangle errs too. With L the largest component of a vertex relative to the origin and
# every shear at most 1: a sheared coordinate is at most 2 L and errs by 5 u L; an edge function is at most 8 L^2 and
# errs by 56 u L^2; the sum of the three e z errs by 3 (56 + 8 + 24) u L^3. Divided by the determinant, which is
# |cross(p1 - p0, p2 - p0) . d| / |d_z|, and projected onto the normal, the direction drops out: 264 u L^3 / |cross|.
_GAMMA264 = 264.0 * _ROUNDOFF / (1.0 - 264.0 * _ROUNDOFF)
_SMALLEST = 2.0**-1074
# Mitsuba 3's RayEpsilon: 1500 times the unit roundoff of float32.
MITSUBA_EPSILON = 1500.0 * 2.0**-24
# ``offset`` below 0 asks for the error-bounded rule.
BOUNDED = -1.0


@inlined
def reflect(d, n):
    """The mirror image of the unit direction d."""
    return sub(d, scale(n, 2.0 * dot(d, n)))


@kernel
def refract(d, n, n1, n2):
    """Snell's n1 sin i = n2 sin t: (cos t, unit direction), with cos t < 0 for total internal reflection.

    Stable on both sides of the critical angle: 1 - eta^2 s^2 is never formed as a difference of near-equal
    numbers. With c = |d . n|, q = d - (d . n) n, s = |q| it is (1 - eta s)(1 + eta s) for s^2 < 1/2, and
    (eta c)^2 + (1 - eta)(1 + eta) with 1 - eta = (n2 - n1) / n2 otherwise.
    """
    eta = n1 / n2
    dn = dot(d, n)
    q = sub(d, scale(n, dn))
    s2 = dot(q, q)
    if s2 < 0.5:
        s = math.sqrt(s2)
        cos2 = (1.0 - eta * s) * (1.0 + eta * s)
    else:
        cos2 = (eta * dn) * (eta * dn) + ((n2 - n1) / n2) * (1.0 + eta)
    if cos2 < 0.0:
        return -1.0, d
    cos_t = math.sqrt(cos2)
    return cos_t, sub(scale(q, eta), scale(n, cos_t))


@kernel
def fresnel(cos_i, cos_t, n1, n2):
    """Unpolarised reflectance of a dielectric boundary."""
    if n1 == n2:
        return 0.0  # also where both cosines are 0
    s = (n1 * cos_i - n2 * cos_t) / (n1 * cos_i + n2 * cos_t)
    p = (n1 * cos_t - n2 * cos_i) / (n1 * cos_t + n2 * cos_i)
    return 0.5 * (s * s + p * p)


@kernel
def specular(d, n, light, shininess):
    """(R . V)^shininess with R = 2 N (N . L) - L and V = -d, 0 where R . V <= 0.

    exp(n log1p(-|R - V|^2 / 2)) keeps its accuracy where R . V is close to 1 and the exponent large.
    """
    r = sub(scale(n, 2.0 * dot(n, light)), light)
    if -dot(r, d) <= 0.0:
        return 0.0
    difference = add(r, d)
    short = 0.5 * dot(difference, difference)
    return math.exp(shininess * math.log1p(-short)) if short < 1.0 else 0.0


@inlined
def offset_distance(p, p0, p1, p2, u, v, n_g):
    """How far p = (1 - u - v) p0 + u p1 + v p2 must move along n_g to be off the plane for certain.

    The bound of p's own rounding (PBRT 4, 6.8.6), and that of the next ray's test against the same triangle, which
    matters where the first vanishes (on a plane through the origin) and for slivers.
    """
    w, distance, reach = 1.0 - u - v, 0.0, 0.0
    for k in range(3):
        distance += abs(n_g[k]) * (abs(w * p0[k]) + abs(u * p1[k]) + abs(v * p2[k]))
        reach = larger(reach, largest_component((p0[k] - p[k], p1[k] - p[k], p2[k] - p[k])))
    # In this order nothing overflows or vanishes before the result does: a hit triangle has reach^2 near its area.
    double_area = length(cross(sub(p1, p0), sub(p2, p0)))
    return _GAMMA7 * distance + _GAMMA264 * reach * (reach / double_area * reach)


@inlined
def _away(x, step):
    """x + step, rounded at least one float64 further in the direction of ``step``."""
    y = x + step
    if step == 0.0 or not math.isfinite(y):
        return y
    # nextafter without its call: the bits of a float64 count up away from 0.
    if y == 0.0:
        return math.copysign(_SMALLEST, step)
    away = 1 if (y > 0.0) == (step > 0.0) else -1
    return np.int64(np.float64(y).view(np.int64) + away).view(np.float64)


@inlined
def spawn_origin(p, error, n_g, w, offset):
    """Where a ray from the surface point p in direction w starts, so that it does not meet that surface again.

    ``offset`` < 0: moved along n_g by ``error``, the bound of ``offset_distance``, and rounded away.
    Otherwise Mitsuba's rule, (1 + max|p|) ``offset`` along n_g.
    """
    side = 1.0 if dot(n_g, w) >= 0.0 else -1.0
    if offset >= 0.0:
        distance = (1.0 + largest_component(p)) * offset
        return add(p, scale(n_g, side * distance))
    step = scale(n_g, side * error)
    return (_away(p[0], step[0]), _away(p[1], step[1]), _away(p[2], step[2]))
