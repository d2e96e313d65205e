"""3-vectors as tuples of float64, for kernels."""

import math

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load, maximum, store


@kernel
def dot(a, b):
    """Dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a, b):
    """Cross product."""
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
def _product(x, y):
    return x * y if x > 0.0 and y > 0.0 else 0.0


@kernel
def times(a, b):
    """Product by components, for weights and colours: no factor is negative, and 0 times infinite light is 0."""
    return (_product(a[0], b[0]), _product(a[1], b[1]), _product(a[2], b[2]))


@inlined
def largest_component(a):
    """The largest absolute value of three numbers."""
    return maximum(abs(a[0]), maximum(abs(a[1]), abs(a[2])))


@inlined
def largest_of_three(a, b, c):
    """The ``largest_component`` of three vectors."""
    return maximum(largest_component(a), maximum(largest_component(b), largest_component(c)))


# The reciprocal of a denormal number overflows.
_SMALL, _RAISE = 2.0**-1000, 2.0**100


@kernel
def unit_and_length(a):
    """a / |a| and |a|, scaled first so that no square overflows or underflows; the zero vector is unchanged."""
    largest, raised = largest_component(a), 1.0
    if largest == 0.0:
        return a, 0.0
    if largest < _SMALL:
        a, largest, raised = scale(a, _RAISE), largest * _RAISE, _RAISE
    b = scale(a, 1.0 / largest)
    root = math.sqrt(dot(b, b))
    return scale(b, 1.0 / root), largest * root / raised


@kernel
def normalized(a):
    """a / |a|; the zero vector is unchanged."""
    return unit_and_length(a)[0]


@kernel
def length(a):
    """|a|."""
    return unit_and_length(a)[1]


@inlined
def three(base, at):
    """Three numbers of a ``pointer``, from ``at``."""
    return (load(base, at), load(base, at + 1), load(base, at + 2))


@inlined
def least_axis(a):
    """The axis along which a vector has its least component."""
    x, y, z = abs(a[0]), abs(a[1]), abs(a[2])
    on_x, on_y = x <= y and x <= z, y <= z
    return (1.0 if on_x else 0.0), (0.0 if on_x or not on_y else 1.0), (0.0 if on_x or on_y else 1.0)


@inlined
def row3(base, i):
    """Row i of a ``pointer`` to rows of three."""
    return three(base, 3 * i)


@inlined
def put3(base, at, a):
    """Write three numbers to a ``pointer``, from ``at``."""
    store(base, at, a[0])
    store(base, at + 1, a[1])
    store(base, at + 2, a[2])


@kernel
def barycentric(a, b, c, u, v):
    """(1 - u - v) a + u b + v c."""
    return add(add(scale(a, 1.0 - u - v), scale(b, u)), scale(c, v))
