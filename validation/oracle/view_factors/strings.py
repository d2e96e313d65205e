"""Hottel's crossed strings: exact view factors of surfaces without end, also past a block between them.

Hottel and Sarofim, Radiative Transfer, 1967. Points are (x, z); a block stands on the ground, and what is above its
tips is free.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Point(NamedTuple):
    """A point of a street's section."""

    x: float
    z: float


class Segment(NamedTuple):
    """A surface in the section."""

    start: Point
    end: Point

    @property
    def length(self) -> float:
        """Its area for each unit of length."""
        return _straight(self.start, self.end)


def exchange(one: Segment, other: Segment, tips: Sequence[Point] = ()) -> float:
    """Area times F for each unit of length: half of the crossed strings less the others.

    Both segments face each other wholly, but for the block with these ``tips`` between them. Crossed strings are
    together no shorter than the others, so that the order of ends does not matter.

    >>> exchange(Segment(Point(0, 0), Point(0, 3)), Segment(Point(4, 0), Point(4, 3)))
    1.0
    >>> exchange(Segment(Point(0, 0), Point(0, 3)), Segment(Point(4, 0), Point(4, 3)), [Point(2, 1.5)])
    0.5
    """
    level = string(one.start, other.start, tips) + string(one.end, other.end, tips)
    crossed = string(one.start, other.end, tips) + string(one.end, other.start, tips)
    return abs(crossed - level) / 2.0


def string(start: Point, end: Point, tips: Sequence[Point] = ()) -> float:
    """The length of the shortest way that passes above those tips that lie between: the upper hull of all."""
    left, right = sorted((start, end))
    chain = [left]
    for point in [*sorted(tip for tip in tips if left.x <= tip.x <= right.x), right]:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) >= 0.0:
            chain.pop()
        chain.append(point)
    return float(sum(_straight(a, b) for a, b in itertools.pairwise(chain)))


def _turn(a: Point, b: Point, c: Point) -> float:
    """Positive where a, b, c turn to the left."""
    return (b.x - a.x) * (c.z - a.z) - (b.z - a.z) * (c.x - a.x)


def _straight(a: Point, b: Point) -> float:
    return float(np.hypot(b.x - a.x, b.z - a.z))
