"""A closed fan of many faces around a corner: two regions, told apart by the parity of crossings; exact.

It takes one pass over the faces for a direction, where the cells of ``cones.Regions`` are as many as the faces squared.
"""

from collections.abc import Iterable, Iterator, Sequence

from validation.oracle.cones import Cone, Piece
from validation.oracle.vectors import Whole, cross, dot, opposite, sign


class Fan:
    """As ``cones.Regions``, of cones that are sectors, each beside two others, in one cycle that does not cross itself.

    Raises ``ValueError`` for others; that the cycle does not cross itself is taken for granted.
    """

    def __init__(self, cones: Iterable[Cone]) -> None:
        self.cones = {cone.face: cone for cone in cones}
        above = self._turned()
        self.pieces = {face: [Piece(side, 1 - side, frozenset([face]))] for face, side in above.items()}

    def _turned(self) -> dict[int, int]:
        """The region above each face: 0 above the first, and so on from neighbour to neighbour."""
        at: dict[Whole, list[Cone]] = {}
        for cone in self.cones.values():
            if cone.first is None or cone.last is None or cone.first == opposite(cone.last):
                raise ValueError(f"cones: expected sectors at a corner, got another of face {cone.face}")
            for border in (cone.first, cone.last):
                at.setdefault(border, []).append(cone)
        if any(len(beside) != 2 for beside in at.values()):
            raise ValueError("cones: expected each beside two others")
        begin = next(iter(self.cones))
        above, waiting = {begin: 0}, [self.cones[begin]]
        while waiting:
            cone = waiting.pop()
            for side in (cone.first, cone.last):
                for other in at[side] if side is not None else []:
                    if other.face not in above:
                        # Along a border that both begin or both end with, they are wound against each other.
                        against = (cone.first == side) == (other.first == side)
                        above[other.face] = above[cone.face] ^ against
                        waiting.append(other)
        if len(above) != len(self.cones):
            raise ValueError("cones: expected one cycle")
        return above

    def around(self, direction: Sequence[int]) -> set[int]:
        """The regions in whose closure a direction lies."""
        if any(cone.side(direction) == 0 and cone.holds(direction) for cone in self.cones.values()):
            return {0, 1}
        target = next(cone for cone in self.cones.values() if cone.side(direction))
        for middle in _within(target):
            crossings = [_crossed(cone, direction, middle) for cone in self.cones.values() if cone is not target]
            if None not in crossings:
                piece = self.pieces[target.face][0]
                reached = piece.above if target.side(direction) > 0 else piece.below
                return {(reached + sum(map(bool, crossings))) % 2}
        raise AssertionError("there are infinitely many directions in a sector")


def _within(cone: Cone) -> Iterator[list[int]]:
    """Directions within a sector that no one would choose."""
    k = 1
    while True:
        yield [(101 + 7 * k) * a + (89 + k * k) * b for a, b in zip(cone.first or (), cone.last or (), strict=True)]
        k += 1


def _crossed(cone: Cone, start: Sequence[int], end: Sequence[int]) -> bool | None:
    """Whether the shorter arc between two directions crosses a sector; None where it meets the sector's border."""
    sides = cone.side(start), cone.side(end)
    if sides == (0, 0):
        return None
    # An arc that begins or ends in the cone's plane does so beside the cone: it begins in none and ends within another.
    if sides[0] != -sides[1] or 0 in sides:
        return False
    # Of the two directions in both planes, the one that is nearer to the arc: start weighs as much as end is off.
    off = abs(dot(cone.normal, start)), abs(dot(cone.normal, end))
    met = [off[1] * a + off[0] * b for a, b in zip(start, end, strict=True)]
    first, last = cone.first or (0, 0, 0), cone.last or (0, 0, 0)
    turns = sign(dot(cone.normal, cross(first, met))), sign(dot(cone.normal, cross(met, last)))
    if -1 in turns:
        return False
    return None if 0 in turns else True
