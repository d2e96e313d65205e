"""The faces at one point as cones of directions, and the regions into which they cut the directions: exact.

Near a point that it holds, a face is a plane, a half plane or a sector between two of its sides. The planes of all such
cones cut the sphere of directions into cells, each known by the signs of its directions on the planes' normals. Two
cells that share an arc of a plane lie in one region where some of the arc is in no cone. All numbers are whole.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cmp_to_key
from typing import NamedTuple

from validation.oracle.vectors import Whole, cross, difference, dot, opposite, shortest, sign

Signs = tuple[int, ...]


@dataclass(frozen=True)
class Cone:
    """A face near a point, seen along its ``normal`` from above: what lies left of ``first``, right of ``last``.

    Both are None inside a face; on a side ``last`` is opposite to ``first``.
    """

    face: int
    normal: Whole
    first: Whole | None
    last: Whole | None

    def holds(self, direction: Sequence[int], closed: bool = True) -> bool:
        """Whether a direction of the cone's plane lies in it; one along its border only where it is ``closed``."""
        if self.first is None or self.last is None:
            return True
        least = 0 if closed else 1
        left = dot(self.normal, cross(self.first, direction)) >= least
        return left and dot(self.normal, cross(direction, self.last)) >= least

    def side(self, direction: Sequence[int]) -> int:
        """The side of the cone's plane to which a direction leads: 1 that of the normal, -1 the other, 0 neither."""
        return sign(dot(self.normal, direction))


def cone_at(face: int, corners: Sequence[Whole], on_sides: Sequence[bool]) -> Cone:
    """The cone of a face with an area at a point that it holds and that lies on some sides: 01, 12, 20 of its corners.

    >>> cone_at(7, [(0, 0, 0), (4, 0, 0), (0, 4, 0)], [True, False, True])
    Cone(face=7, normal=(0, 0, 1), first=(1, 0, 0), last=(0, 1, 0))
    """
    normal = shortest(cross(difference(corners[1], corners[0]), difference(corners[2], corners[0])))
    along = [shortest(difference(corners[(k + 1) % 3], corners[k])) for k in range(3)]
    met = [k for k in range(3) if on_sides[k]]
    if not met:
        return Cone(face, normal, None, None)
    if len(met) == 1:
        return Cone(face, normal, along[met[0]], opposite(along[met[0]]))
    # At corner k the sides k and k - 1 meet.
    corner = next(k for k in range(3) if on_sides[k] and on_sides[k - 1])
    return Cone(face, normal, along[corner], opposite(along[corner - 1]))


class Piece(NamedTuple):
    """A part of a cone's arc that no plane and no other cone's border divides.

    ``above`` and ``below``, by the cone's normal, are the regions beside it; ``faces`` are all whose cones it is in.
    """

    above: int
    below: int
    faces: frozenset[int]


class Regions:
    """The regions of some cones: a number for each, the pieces of each cone, and where a direction lies."""

    def __init__(self, cones: Iterable[Cone]) -> None:
        self.cones = {cone.face: cone for cone in cones}
        planes: dict[Whole, list[Cone]] = {}
        for cone in self.cones.values():
            planes.setdefault(_upper(cone.normal), []).append(cone)
        self._normals = list(planes)

        # Each arc between neighbouring crossings of a plane: the cells above and below it, and the cones that it is in.
        arcs: list[tuple[Signs, Signs, list[Cone]]] = []
        for place, (normal, within) in enumerate(planes.items()):
            for middle in _middles(normal, self._crossings(place, within)):
                signs = [sign(dot(other, middle)) for other in self._normals]
                above, below = (tuple([*signs[:place], side, *signs[place + 1 :]]) for side in (1, -1))
                arcs.append((above, below, [cone for cone in within if cone.holds(middle, closed=False)]))

        self._region = _joined(arcs)
        self.pieces: dict[int, list[Piece]] = {face: [] for face in self.cones}
        for above, below, covering in arcs:
            faces = frozenset(cone.face for cone in covering)
            for cone in covering:
                ends = (above, below) if _upper(cone.normal) == cone.normal else (below, above)
                self.pieces[cone.face].append(Piece(self._region[ends[0]], self._region[ends[1]], faces))

    def around(self, direction: Sequence[int]) -> set[int]:
        """The regions in whose closure a direction lies."""
        signs = [sign(dot(normal, direction)) for normal in self._normals]
        return {
            region
            for cell, region in self._region.items()
            if all(own in (0, its) for own, its in zip(signs, cell, strict=True))
        }

    def _crossings(self, place: int, within: Sequence[Cone]) -> set[Whole]:
        """The directions in which one plane meets the others, and the borders of its own cones."""
        normal, found = self._normals[place], set[Whole]()
        for other in [*self._normals[:place], *self._normals[place + 1 :]]:
            line = shortest(cross(normal, other))
            found |= {line, opposite(line)}
        for cone in within:
            if cone.first is not None and cone.last is not None:
                found |= {cone.first, cone.last}
        return found


def _joined(arcs: Sequence[tuple[Signs, Signs, list[Cone]]]) -> dict[Signs, int]:
    """The region of each cell: those are in one that open arcs connect."""
    beside: dict[Signs, list[Signs]] = {}
    for above, below, covering in arcs:
        for cell, other in ((above, below), (below, above)):
            beside.setdefault(cell, []).extend([] if covering else [other])
    region: dict[Signs, int] = {}
    for begin in beside:
        if begin in region:
            continue
        number, waiting = len(set(region.values())), [begin]
        region[begin] = number
        while waiting:
            for cell in beside[waiting.pop()]:
                if cell not in region:
                    region[cell] = number
                    waiting.append(cell)
    return region


def _middles(normal: Whole, crossings: set[Whole]) -> list[Whole]:
    """A direction within each arc between neighbouring directions of a plane; one of the plane where there are none."""
    if not crossings:
        return [_across(normal)]
    start = min(crossings)

    def turned(a: Whole, b: Whole) -> int:
        halves = [_half(normal, start, x) for x in (a, b)]
        return halves[0] - halves[1] or -sign(dot(normal, cross(a, b)))

    ordered = sorted(crossings, key=cmp_to_key(turned))
    found = []
    for a, b in zip(ordered, [*ordered[1:], ordered[0]], strict=True):
        turn = sign(dot(normal, cross(a, b)))
        middle = tuple(cross(normal, a)) if turn == 0 else tuple(turn * (x + y) for x, y in zip(a, b, strict=True))
        found.append(shortest(middle))
    return found


def _half(normal: Whole, start: Whole, direction: Whole) -> int:
    """0 from ``start`` to less than half a turn to the left, 1 beyond."""
    turn = sign(dot(normal, cross(start, direction)))
    return 0 if turn > 0 or (turn == 0 and dot(start, direction) > 0) else 1


def _across(normal: Whole) -> Whole:
    x, y, z = normal
    return shortest((y, -x, 0) if x or y else (z, 0, -x))


def _upper(normal: Whole) -> Whole:
    """The one of a normal and its opposite by which a plane is known."""
    return max(normal, opposite(normal))
