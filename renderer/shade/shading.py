"""Reflection and refraction, for kernels.

Vectors are tuples of float64. ``n`` is the unit normal on the side of the incoming ray, so d . n <= 0.
"""

import math

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.vec3 import dot, scale, sub


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
