"""Arithmetic on 3-vectors held as tuples of float64, for kernels."""

import math

from renderer.jit import kernel


@kernel
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a, b):
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def add(a, b):
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def sub(a, b):
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def scale(a, s):
    """a times a number."""
    return (a[0] * s, a[1] * s, a[2] * s)


@kernel
def times(a, b):
    """Component by component, as weights multiply colours."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2])


@kernel
def normalized(a):
    """a / |a|, scaled first so that no square overflows or vanishes; the zero vector stays."""
    largest = max(abs(a[0]), max(abs(a[1]), abs(a[2])))
    if largest == 0.0:
        return a
    b = scale(a, 1.0 / largest)
    return scale(b, 1.0 / math.sqrt(dot(b, b)))


@kernel
def length(a):
    """|a|, scaled first so that no square overflows or vanishes."""
    largest = max(abs(a[0]), max(abs(a[1]), abs(a[2])))
    if largest == 0.0:
        return 0.0
    b = scale(a, 1.0 / largest)
    return largest * math.sqrt(dot(b, b))


@kernel
def row3(array, i):
    """Row i of an (n, 3) array."""
    return (array[i, 0], array[i, 1], array[i, 2])


@kernel
def columns3(array, i, k):
    """Three columns of row i, from column k."""
    return (array[i, k], array[i, k + 1], array[i, k + 2])


@kernel
def barycentric(a, b, c, u, v):
    """(1 - u - v) a + u b + v c."""
    return add(add(scale(a, 1.0 - u - v), scale(b, u)), scale(c, v))
