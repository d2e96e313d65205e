"""Double-double numbers: a pair (head, tail) is the sum of two float64; the tail is at most a rounding of the head.

Sums and products of float64 are exact as pairs; those of pairs err by less than 2^-100 of their terms. No product may
overflow or underflow: scale by ``power_below`` first. Sources: Dekker, A Floating-Point Technique for Extending the
Available Precision, Numerische Mathematik 18, 1971; Shewchuk, Adaptive Precision Floating-Point Arithmetic, 1997.
"""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import maximum

LEAST_NORMAL = 2.0**-1022
_SPLITTER = 2.0**27 + 1.0
_EXPONENT = 0x7FF0000000000000


@inlined
def power_below(x):
    """The largest power of two not above a positive normal float64."""
    return np.int64(np.float64(x).view(np.int64) & _EXPONENT).view(np.float64)


@inlined
def difference(a, b):
    """a - b of two float64, exactly."""
    return exact_sum(a, -b)


@inlined
def exact_sum(a, b):
    """a + b of two float64, exactly."""
    head = a + b
    back = head - a
    return head, (a - (head - back)) + (b - back)


@inlined
def _halves(a):
    """Two float64 of 26 digits each with the sum a."""
    c = _SPLITTER * a
    high = c - (c - a)
    return high, a - high


@inlined
def exact_product(a, b):
    """a b of two float64, exactly."""
    head = a * b
    (a1, a2), (b1, b2) = _halves(a), _halves(b)
    return head, a2 * b2 - (((head - a1 * b1) - a2 * b1) - a1 * b2)


@kernel
def plus(a, b):
    """a + b of two pairs."""
    s, t = exact_sum(a[0], b[0]), exact_sum(a[1], b[1])
    s = exact_sum(s[0], s[1] + t[0])
    return exact_sum(s[0], s[1] + t[1])


@kernel
def minus(a, b):
    """a - b of two pairs."""
    return plus(a, (-b[0], -b[1]))


@kernel
def product(a, b):
    """a b of two pairs."""
    head, tail = exact_product(a[0], b[0])
    return exact_sum(head, tail + (a[0] * b[1] + a[1] * b[0]))


@kernel
def quotient(a, b):
    """a / b of two pairs."""
    head = a[0] / b[0]
    rest = minus(a, product(b, (head, 0.0)))
    return exact_sum(head, rest[0] / b[0])


@kernel
def dot_pairs(a, b):
    """Scalar product of two vectors of pairs."""
    return plus(plus(product(a[0], b[0]), product(a[1], b[1])), product(a[2], b[2]))


@kernel
def cross_pairs(a, b):
    """Cross product of two vectors of pairs."""
    return (
        minus(product(a[1], b[2]), product(a[2], b[1])),
        minus(product(a[2], b[0]), product(a[0], b[2])),
        minus(product(a[0], b[1]), product(a[1], b[0])),
    )


@kernel
def scaled_difference(a, b, factor):
    """(a - b) times a power of two, exactly, of two vectors of float64."""
    x, y, z = difference(a[0], b[0]), difference(a[1], b[1]), difference(a[2], b[2])
    return (x[0] * factor, x[1] * factor), (y[0] * factor, y[1] * factor), (z[0] * factor, z[1] * factor)


@kernel
def length_pair(a):
    """The length of a vector of pairs, as a pair."""
    largest = maximum(maximum(abs(a[0][0]), abs(a[1][0])), abs(a[2][0]))
    if largest == 0.0:
        return 0.0, 0.0
    # Scaled, so that no square vanishes.
    unit = power_below(maximum(largest, LEAST_NORMAL))
    x, y, z = a
    b = (x[0] / unit, x[1] / unit), (y[0] / unit, y[1] / unit), (z[0] / unit, z[1] / unit)
    square = dot_pairs(b, b)
    head = np.sqrt(square[0])
    rest = minus(square, exact_product(head, head))
    head, tail = exact_sum(head, rest[0] / (2.0 * head))
    return head * unit, tail * unit


@kernel
def negative(a):
    """The negative of a vector of pairs."""
    return (-a[0][0], -a[0][1]), (-a[1][0], -a[1][1]), (-a[2][0], -a[2][1])


@kernel
def heads(a):
    """A vector of pairs, rounded to float64."""
    return a[0][0], a[1][0], a[2][0]


@kernel
def as_pairs(a):
    """A vector of float64 as a vector of pairs."""
    return (a[0], 0.0), (a[1], 0.0), (a[2], 0.0)
