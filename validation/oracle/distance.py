"""Distances of points from triangles in exact rational arithmetic: squared, so that no root rounds them."""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import TypeVar

Vector = Sequence[Fraction]
Number = TypeVar("Number", int, Fraction)


def rational(rows: Sequence[Sequence[float]]) -> list[list[Fraction]]:
    """Rows of finite numbers as fractions."""
    return [[Fraction(float(x)) for x in row] for row in rows]


def squared_distance(point: Vector, triangle: Sequence[Vector]) -> Fraction:
    """The squared distance of a point from a closed triangle, which may be a side or a point.

    >>> squared_distance(*rational([[0.25, 0.25, 2.0]]), rational([[0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    Fraction(4, 1)
    """
    a, b, c = triangle
    normal = cross(difference(b, a), difference(c, a))
    sides = ((a, b), (b, c), (c, a))
    if any(normal) and all(dot(cross(normal, difference(q, p)), difference(point, p)) >= 0 for p, q in sides):
        return dot(normal, difference(point, a)) ** 2 / dot(normal, normal)
    return min(_from_side(point, p, q) for p, q in sides)


def _from_side(point: Vector, start: Vector, end: Vector) -> Fraction:
    """The squared distance from a side, which may be a point."""
    side, offset = difference(end, start), difference(point, start)
    square = dot(side, side)
    share = max(Fraction(0), min(Fraction(1), dot(side, offset) / square)) if square else Fraction(0)
    rest = [x - share * s for x, s in zip(offset, side, strict=True)]
    return dot(rest, rest)


def dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[Number], b: Sequence[Number]) -> list[Number]:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def difference(a: Sequence[Number], b: Sequence[Number]) -> list[Number]:
    """a - b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def nearest(point: Vector, triangles: Sequence[Sequence[Vector]]) -> tuple[Fraction, list[int]]:
    """The least squared distance of a point from some triangles, and those that have it, ascending."""
    squares = [squared_distance(point, triangle) for triangle in triangles]
    least = min(squares)
    return least, [i for i, square in enumerate(squares) if square == least]


def way_from(value: float, exact: Fraction) -> Fraction | float:
    """The way from a float64 to a rational number, exactly; inf where the float64 is not finite, as t of a lost hit.

    >>> way_from(0.75, Fraction(1)), way_from(math.inf, Fraction(1))
    (Fraction(1, 4), inf)
    """
    return abs(Fraction(value) - exact) if math.isfinite(value) else math.inf


def ulps_from_root(value: float, square: Fraction) -> float:
    """The way from a float64 to the root of a rational number, in units of the root's last place.

    It is inf for a NaN, and where one of them is 0 and the other is not.

    >>> ulps_from_root(2.0, Fraction(4)), ulps_from_root(1.0, Fraction(1) + Fraction(2) ** -51)
    (0.0, 1.0)
    """
    if square == 0 or value == 0.0 or not math.isfinite(value):
        return 0.0 if square == 0 and value == 0.0 else math.inf
    # Some 64 bits of the root beyond those of float64.
    shift = max(0, 130 - (square.numerator.bit_length() - square.denominator.bit_length()) // 2)
    root = Fraction(math.isqrt((square.numerator << 2 * shift) // square.denominator), 1 << shift)
    return abs(float((Fraction(value) - root) / Fraction(math.ulp(float(root)))))
