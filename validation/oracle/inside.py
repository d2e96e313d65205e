"""Winding numbers of closed meshes around points, in exact rational arithmetic: the judge of ``contains``."""

from collections.abc import Iterator, Sequence
from fractions import Fraction

from validation.oracle.distance import squared_distance
from validation.oracle.vectors import cross, difference, dot, relative, volume


def winding_number(point: Sequence[Fraction], triangles: Sequence[Sequence[Sequence[Fraction]]]) -> int | None:
    """The winding number of a closed mesh's triangles around a point, None where the point lies on one of them.

    By the signed crossings of a ray in a direction that meets no edge and no corner; others are tried until one does.
    """
    # In whole numbers, which change no sign, and are many times as fast.
    around, _ = relative(point, triangles)
    if any(volume(face) == 0 and squared_distance((0, 0, 0), face) == 0 for face in around):
        return None
    # Without faces that are lines or points: a ray that meets no edge crosses none of them.
    faces = [[a, b, c] for a, b, c in around if any(cross(difference(b, a), difference(c, a)))]
    for direction in _directions():
        crossings = [_crossing(triangle, direction) for triangle in faces]
        if None not in crossings:
            return sum(crossing for crossing in crossings if crossing is not None)
    raise AssertionError("there are infinitely many directions")


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
    # t = volume / sum of the sides.
    return 0 if (volume(triangle) > 0) != (sides[0] > 0) else (1 if sides[0] > 0 else -1)
