"""Exact signs of edge functions, for those that rounding leaves 0.

Sheared, a corner's place depends on the ray and the corner alone. So the faces of a mesh are a planar map that the ray
passes at one point, and with exact signs it hits exactly the faces whose closed outlines contain that point.
"""

from typing import NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import exact_product, power_below
from renderer.numerics.simd import load

# Below this a number is scaled up before its exponent is read, as a denormal one has none.
_SMALL, _SCALE, _SCALE_BITS = 2.0**-900, 2.0**200, 200
# The bits of a float64's fraction, and the exponent of 1.
_FRACTION_BITS, _BIAS = 52, 1023


@inlined
def coordinate(tree, at):
    """One coordinate of a block, exactly."""
    return tree.ways.coordinate(tree, at)


@inlined
def coordinate_of_block(tree, at):
    """``coordinate`` of a mesh."""
    return load(tree.wide_blocks, at) if tree.wide != 0 else np.float64(load(tree.blocks, at))


@inlined
def corner(tree, at):
    """A corner (x, y, z) of a face, exactly."""
    return coordinate(tree, at), coordinate(tree, at + 4), coordinate(tree, at + 8)


@inlined
def corners_at(tree, at):
    """The three corners of the face at ``at``, exactly."""
    return corner(tree, at), corner(tree, at + 12), corner(tree, at + 24)


class EdgeSides(NamedTuple):
    """The side on which a ray passes each edge of a face: -1, 0 or 1, for the edge opposite to each corner."""

    opposite0: int
    opposite1: int
    opposite2: int


@kernel
def exact_sides(tree, at, shear):
    """The exact signs of the three edge functions of the face at ``at``, for its sheared corners as rounded."""
    x0, y0 = _sheared(tree, at, shear)
    x1, y1 = _sheared(tree, at + 12, shear)
    x2, y2 = _sheared(tree, at + 24, shear)
    return EdgeSides(
        products_sign(x2, y1, y2, x1), products_sign(x0, y2, y0, x2), products_sign(x1, y0, y1, x0)
    )  # fmt: skip


@kernel
def passes_within(sides):
    """Whether a ray that passes the edges on these sides hits the closed face; false for a ray in its plane."""
    a, b, c = sides.opposite0, sides.opposite1, sides.opposite2
    same = (a >= 0 and b >= 0 and c >= 0) or (a <= 0 and b <= 0 and c <= 0)
    return same and (a != 0 or b != 0 or c != 0)


@inlined
def _sheared(tree, at, shear):
    """x and y of a corner as ``see_triangles`` computes them."""
    z = coordinate(tree, at + shear.row_z) - shear.origin_z
    x = (coordinate(tree, at + shear.row_x) - shear.origin_x) - shear.shear_x * z
    y = (coordinate(tree, at + shear.row_y) - shear.origin_y) - shear.shear_y * z
    return x, y


@kernel
def products_sign(a, b, c, d):
    """The sign of a b - c d, exactly."""
    difference = a * b - c * d
    if difference != 0.0:
        # Rounding keeps the order of two products, unless it makes them one.
        return 1 if difference > 0.0 else -1
    left, right = _sign(a) * _sign(b), _sign(c) * _sign(d)
    if left != right or left == 0:
        return _sign(np.float64(left - right))
    # Products of one sign, as digits from 1 to 2 and exponents, so that none vanishes.
    (a, p), (b, q), (c, r), (d, s) = _parts(a), _parts(b), _parts(c), _parts(d)
    exponent = (p + q) - (r + s)
    if abs(exponent) > 1:
        return left if exponent > 0 else -left
    ratio = 2.0 if exponent > 0 else (0.5 if exponent < 0 else 1.0)
    one, other = exact_product(a * ratio, b), exact_product(c, d)
    heads = one[0] - other[0]
    # rule: product-tails
    return left * _sign(heads if heads != 0.0 else one[1] - other[1])


@inlined
def _sign(x):
    return 1 if x > 0.0 else (-1 if x < 0.0 else 0)


@kernel
def _parts(x):
    """|x| as a number from 1 to 2, and the power of two to multiply it by."""
    x, less = abs(x), 0
    if x < _SMALL:
        x, less = x * _SCALE, _SCALE_BITS
    power = power_below(x)
    return x / power, np.int64(np.float64(power).view(np.int64) >> _FRACTION_BITS) - _BIAS - less
