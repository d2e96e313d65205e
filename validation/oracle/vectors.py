"""Vectors of whole, rational or decimal numbers: products, differences, signs, and floats as exact numbers."""

from collections.abc import Iterable, Sequence
from decimal import Decimal
from fractions import Fraction
from math import gcd
from typing import TypeVar

Whole = tuple[int, int, int]
Number = TypeVar("Number", int, Fraction, Decimal)


def rational(rows: Sequence[Sequence[float]]) -> list[list[Fraction]]:
    """Rows of finite numbers as fractions."""
    return [[Fraction(float(x)) for x in row] for row in rows]


def whole(rows: Sequence[Sequence[float | Fraction]]) -> tuple[list[Whole], int]:
    """Rows of three binary fractions, as floats are, as integers; and the power of two that they were multiplied by.

    >>> whole([[0.5, 3.0, -0.25]])
    ([(2, 12, -1)], 4)
    """
    ratios = [[x.as_integer_ratio() for x in row] for row in rows]
    unit = max((bottom for row in ratios for _, bottom in row), default=1)
    return [(x, y, z) for x, y, z in ([top * (unit // bottom) for top, bottom in row] for row in ratios)], unit


def whole_vector(vector: Iterable[float]) -> Whole:
    """A vector of floats times the power of two that makes it whole."""
    return whole([list(vector)])[0][0]


def relative(
    point: Sequence[float | Fraction], triangles: Sequence[Sequence[Sequence[float | Fraction]]]
) -> tuple[list[list[list[int]]], int]:
    """The corners of triangles less a point, times the power of two that makes them whole; and that."""
    (own, *corners), unit = whole([point, *(corner for triangle in triangles for corner in triangle)])
    moved = [difference(corner, own) for corner in corners]
    return [moved[k : k + 3] for k in range(0, len(moved), 3)], unit


def dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[Number], b: Sequence[Number]) -> list[Number]:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def volume(face: Sequence[Sequence[Number]]) -> Number:
    """The determinant of a face's corners: 0 where the origin lies in its plane."""
    a, b, c = face
    return dot(a, cross(b, c))


def difference(a: Sequence[Number], b: Sequence[Number]) -> list[Number]:
    """a - b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def shortest(vector: Iterable[int]) -> Whole:
    """A whole vector without the factor that its components share."""
    x, y, z = vector
    shared = gcd(x, y, z) or 1
    return x // shared, y // shared, z // shared


def opposite(vector: Whole) -> Whole:
    """The vector the other way."""
    return -vector[0], -vector[1], -vector[2]


def sign(number: int) -> int:
    """1, 0 or -1."""
    return (number > 0) - (number < 0)
