"""Distances of points from triangles in exact rational arithmetic: squared, so that no root rounds them."""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import TypeVar

from validation.oracle.vectors import cross, difference, dot

Number = TypeVar("Number", int, Fraction)


def way_to(point: Sequence[Number], triangle: Sequence[Sequence[Number]]) -> list[Fraction]:
    """The way from a point to the nearest point of a closed triangle, which may be a side or a point."""
    a, b, c = triangle
    normal = cross(difference(b, a), difference(c, a))
    sides = ((a, b), (b, c), (c, a))
    if any(normal) and all(dot(cross(normal, difference(q, p)), difference(point, p)) >= 0 for p, q in sides):
        share = Fraction(dot(normal, difference(a, point)), dot(normal, normal))
        return [share * x for x in normal]
    return min((_way_to_side(point, p, q) for p, q in sides), key=lambda way: dot(way, way))


def _way_to_side(point: Sequence[Number], start: Sequence[Number], end: Sequence[Number]) -> list[Fraction]:
    """The way from a point to the nearest point of a side, which may be a point."""
    side, offset = difference(end, start), difference(start, point)
    square = dot(side, side)
    share = max(Fraction(0), min(Fraction(1), Fraction(-dot(side, offset), square))) if square else Fraction(0)
    return [x + share * s for x, s in zip(offset, side, strict=True)]


def squared_distance(point: Sequence[Number], triangle: Sequence[Sequence[Number]]) -> Fraction:
    """The squared distance of a point from a closed triangle, which may be a side or a point.

    >>> squared_distance([0, 0, 2], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    Fraction(4, 1)
    """
    way = way_to(point, triangle)
    return dot(way, way)


def nearest(point: Sequence[Number], triangles: Sequence[Sequence[Sequence[Number]]]) -> tuple[Fraction, list[int]]:
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
