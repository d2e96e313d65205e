"""Winding numbers of closed meshes around points, in exact rational arithmetic: the judge of ``contains``."""

from collections.abc import Iterator, Sequence
from fractions import Fraction

from validation.oracle.distance import Vector, cross, difference, dot, squared_distance


def winding_number(point: Vector, triangles: Sequence[Sequence[Vector]]) -> int | None:
    """The winding number of a closed mesh's triangles around a point, None where the point lies on one of them.

    By the signed crossings of a ray in a direction that meets no edge and no corner; others are tried until one does.
    """
    relative = _relative(point, triangles)
    origin = [Fraction(0)] * 3
    flat = [triangle for triangle in relative if dot(triangle[0], cross(triangle[1], triangle[2])) == 0]
    if any(squared_distance(origin, [[Fraction(x) for x in corner] for corner in triangle]) == 0 for triangle in flat):
        return None
    # Without faces that are lines or points: a ray that meets no edge crosses none of them.
    faces = [[a, b, c] for a, b, c in relative if any(cross(difference(b, a), difference(c, a)))]
    for direction in _directions():
        crossings = [_crossing(triangle, direction) for triangle in faces]
        if None not in crossings:
            return sum(crossing for crossing in crossings if crossing is not None)
    raise AssertionError("there are infinitely many directions")


def _relative(point: Vector, triangles: Sequence[Sequence[Vector]]) -> list[list[list[int]]]:
    """Corners less the point, times a power of two that makes integers of them: it changes no sign, and these are many
    times as fast.
    """
    numbers = [x for triangle in triangles for corner in triangle for x in corner]
    unit = max(x.denominator for x in (*numbers, *point))

    def whole(vector: Vector) -> list[int]:
        return [x.numerator * (unit // x.denominator) for x in vector]

    own = whole(point)
    return [[difference(whole(corner), own) for corner in triangle] for triangle in triangles]


def _directions() -> Iterator[Sequence[int]]:
    """Directions that lie in no plane that anyone would choose."""
    k = 1
    while True:
        yield [127413 * k + 1, 28807 + k * k, 470881 - 17 * k]
        k += 1


def _crossing(triangle: Sequence[Sequence[int]], direction: Sequence[int]) -> int | None:
    """1 where the ray from 0 passes a triangle from back to front, -1 the other way, None at an edge, else 0."""
    a, b, c = triangle
    sides = [dot(direction, cross(p, q)) for p, q in ((a, b), (b, c), (c, a))]
    if min(sides) < 0 < max(sides):
        return 0
    if 0 in sides:
        return None
    volume = dot(a, cross(b, c))
    # t = volume / sum of the sides.
    return 0 if (volume > 0) != (sides[0] > 0) else (1 if sides[0] > 0 else -1)
