"""Rectangles in parallel or perpendicular planes, sides parallel to the axes.

Numbers such as C-11 are those of Howell, A Catalog of Radiation Heat Transfer Configuration Factors.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class Span(NamedTuple):
    """The side of a rectangle along one axis, from ``low`` to ``high``."""

    low: float
    high: float


def parallel(a: float, b: float, distance: float) -> float:
    """F of equal rectangles a x b that face each other (C-11).

    >>> parallel(1.0, 1.0, 1.0)
    0.199824895698387...
    """
    x, y = a / distance, b / distance
    p, q = np.sqrt(1.0 + x * x), np.sqrt(1.0 + y * y)
    logarithm = 0.5 * np.log(p * p * (q * q) / (1.0 + x * x + y * y))
    arcs = x * q * np.arctan(x / q) + y * p * np.arctan(y / p) - x * np.arctan(x) - y * np.arctan(y)
    return float(2.0 / (np.pi * x * y) * (logarithm + arcs))


def perpendicular(width: float, height: float, common: float) -> float:
    """F from a rectangle width x common to one of height x common, which share an edge of length ``common`` (C-14).

    >>> perpendicular(1.0, 1.0, 1.0)
    0.200043776075403...
    """
    w, h = width / common, height / common
    w2, h2 = w * w, h * h
    both = 1.0 + w2 + h2
    diagonal = np.sqrt(w2 + h2)
    arcs = w * np.arctan(1.0 / w) + h * np.arctan(1.0 / h) - diagonal * np.arctan(1.0 / diagonal)
    logarithms = (
        np.log((1.0 + w2) * (1.0 + h2) / both)
        + w2 * np.log(w2 * both / ((1.0 + w2) * (w2 + h2)))
        + h2 * np.log(h2 * both / ((1.0 + h2) * (w2 + h2)))
    )
    return float((arcs + logarithms / 4.0) / (np.pi * w))


def parallel_exchange(first: tuple[Span, Span], second: tuple[Span, Span], distance: float) -> float:
    """A1 F12 of rectangles in planes z = 0 and z = distance, given by their spans in x and y (C-13).

    With u = x1 - x2 and v = y1 - y2 the kernel z^2 / (pi (u^2 + v^2 + z^2)^2) is the derivative of ``primitive``, twice
    by u and twice by v.

    >>> parallel_exchange((Span(0, 1), Span(0, 1)), (Span(0, 1), Span(0, 1)), 1.0)
    0.19982489569838...
    """
    z2 = distance * distance

    def primitive(u: float, v: float) -> float:
        p, q = np.sqrt(u * u + z2), np.sqrt(v * v + z2)
        arcs = v * p * np.arctan(v / p) + u * q * np.arctan(u / q)
        return float(arcs - z2 / 2.0 * np.log(u * u + v * v + z2)) / (2.0 * np.pi)

    return _twice(lambda u: _twice(lambda v: primitive(u, v), first[1], second[1]), first[0], second[0])


def perpendicular_exchange(floor: tuple[Span, Span], wall: tuple[Span, Span]) -> float:
    """A1 F12 of a rectangle of the plane z = 0, x >= 0 and y, and one of the plane x = 0, y and z >= 0 (C-15).

    The kernel is x z / (pi (x^2 + v^2 + z^2)^2) with v = y1 - y2. Its integral over x and z is -log(x^2 + v^2 + z^2)
    / (4 pi) at the spans' ends; ``primitive`` is the integral of that, twice by v, without terms that cancel.

    >>> perpendicular_exchange((Span(0, 1), Span(0, 1)), (Span(0, 1), Span(0, 1)))
    0.200043776075403...
    """

    def primitive(k2: float, v: float) -> float:
        square = v * v + k2
        logarithm = 0.5 * (v * v - k2) * np.log(square) if square > 0.0 else 0.0
        k = np.sqrt(k2)
        return float(logarithm + 2.0 * k * v * np.arctan2(v, k)) / (-4.0 * np.pi)

    def at_heights(k2: float) -> float:
        return _twice(lambda v: primitive(k2, v), floor[1], wall[0])

    (near, far), (low, high) = floor[0], wall[1]
    ends = [(far, high, 1.0), (near, low, 1.0), (far, low, -1.0), (near, high, -1.0)]
    return sum(sign * at_heights(x * x + z * z) for x, z, sign in ends)


def _twice(primitive: Callable[[float], float], one: Span, other: Span) -> float:
    """The integral of the second derivative of ``primitive`` at s - t, s over ``one`` and t over ``other``."""
    return (
        primitive(one.high - other.low) + primitive(one.low - other.high)
        - primitive(one.high - other.high) - primitive(one.low - other.low)
    )  # fmt: skip
