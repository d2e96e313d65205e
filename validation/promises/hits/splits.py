"""The rules of a build, written again in numpy: how faces are cut in two, and the cheapest nodes and leaves of that.

Costs are half the areas of boxes: of each node once, and of each leaf once for every four faces or part of four.
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
# A level of the tree is three cuts in two.
_CUTS_A_LEVEL = 3
# Up to so many faces are cut by the surface area heuristic under either rule, and by few planes.
_FEW, _FEW_BINS, _BINS = 32, 6, 16


class Rule(NamedTuple):
    """What a build is asked for."""

    split: Literal["midpoint", "sah"]
    leaf_size: int
    max_depth: int


class Part(NamedTuple):
    """Faces in their order, and the two halves into which they are cut, if they are."""

    faces: Indices
    halves: "tuple[Part, Part] | None"


class Choice(NamedTuple):
    """The cost of some nodes and leaves, and the faces of the leaves."""

    cost: float
    leaves: tuple[tuple[int, ...], ...]


class Build:
    """A build of triangles (n, 3 corners, 3)."""

    def __init__(self, triangles: Floats, rule: Rule) -> None:
        self.low, self.high, self.rule = triangles.min(axis=1), triangles.max(axis=1), rule
        self.centres = self.low + self.high
        self.whole = min(rule.leaf_size, 4)

    def cheapest(self) -> Choice:
        """The cheapest tree of nodes of up to eight octants; a leaf alone has a node above it."""
        every = np.arange(len(self.low))
        cost, leaves = self._choices(self._cut(every, 0))[0]
        return Choice(cost + self._area(every) * (len(leaves) == 1), leaves)

    def _area(self, faces: Indices) -> float:
        return float(half_area(self.low[faces].min(axis=0), self.high[faces].max(axis=0)))

    def _cut(self, faces: Indices, cuts: int) -> Part:
        """Faces that ``cuts`` cuts have cut off, cut until no part has more than four, or than a leaf may have."""
        if len(faces) <= self.whole:
            return Part(faces, None)
        if cuts < _CUTS_A_LEVEL * self.rule.max_depth:
            if self.rule.split == "midpoint" and len(faces) > _FEW:
                axes, middle = self._middle(faces)
                if middle is not None:
                    return self._octants(faces, axes, middle, cuts + _CUTS_A_LEVEL)
            else:
                first = self._cheapest_plane(faces)
                if first is not None:
                    return self._halves(faces, first, cuts + 1)
        return self._halves(faces, np.arange(len(faces)) < len(faces) // 2, cuts + 1)

    def _halves(self, faces: Indices, first: NDArray[np.bool_], cuts: int) -> Part:
        return Part(faces, (self._cut(faces[first], cuts), self._cut(faces[~first], cuts)))

    def _middle(self, faces: Indices) -> tuple[Indices, Floats | None]:
        """The axes, along the longest of the faces' box first, and the middle of the box, infinite along those less
        than half as long as the longest; of the centres where that separates none; None where that does not either.
        """
        low, high = self.low[faces].min(axis=0), self.high[faces].max(axis=0)
        axes, centres = np.argsort(low - high, kind="stable"), self.centres[faces]
        of_box = np.where(2 * (high - low) >= (high - low).max(), low + high, np.inf)
        for middle in (of_box, (centres.min(axis=0) + centres.max(axis=0)) / 2):
            above = centres > middle
            if (above != above[0]).any():
                return axes, middle
        return axes, None

    def _octants(self, faces: Indices, axes: Indices, middle: Floats, cuts: int) -> Part:
        """Halves along the first of the axes that separates any, and so on along the others."""
        if len(faces) <= self.whole:
            return Part(faces, None)
        for k, axis in enumerate(axes):
            above = self.centres[faces, axis] > middle[axis]
            if (above != above[0]).any():
                rest = axes[k + 1 :]
                first, second = (self._octants(faces[side], rest, middle, cuts) for side in (~above, above))
                return Part(faces, (first, second))
        return self._cut(faces, cuts)

    def _cheapest_plane(self, faces: Indices) -> NDArray[np.bool_] | None:
        """Which faces lie before the cheapest of the planes evenly between the centres, the first of equal ones."""
        centres, bins = self.centres[faces], _BINS if len(faces) > _FEW else _FEW_BINS
        low, extent = centres.min(axis=0), np.ptp(centres, axis=0)
        share = np.divide(centres - low, extent, out=np.zeros_like(centres), where=extent > 0.0)
        # before[p, f]: whether face f lies before plane p; planes of an axis follow each other.
        before = (share.T[:, None] * bins < np.arange(1, bins)[None, :, None]).reshape(-1, len(faces))
        before = before[before.any(axis=1) & ~before.all(axis=1)]
        if not len(before):
            return None
        costs = sum(
            half_area(
                np.where(side[:, :, None], self.low[faces], np.inf).min(axis=1),
                np.where(side[:, :, None], self.high[faces], -np.inf).max(axis=1),
            )
            * -(-side.sum(axis=1) // 4)
            for side in (before, ~before)
        )
        first: NDArray[np.bool_] = before[np.argmin(costs)]
        return first

    def _choices(self, part: Part) -> list[Choice]:
        """The cheapest choices of a part as at most one, two, ... eight octants of a node."""
        area, leaves = self._area(part.faces), (tuple(sorted(part.faces.tolist())),)
        leaf = Choice(area * -(-len(part.faces) // 4), leaves)
        if part.halves is None:
            return [leaf] * 8
        first, second = (self._choices(half) for half in part.halves)
        shared = [_cheapest_share(first, second, octants) for octants in range(2, 9)]
        found = [Choice(area + shared[-1].cost, shared[-1].leaves)]
        if len(part.faces) <= self.rule.leaf_size:
            found = [min(leaf, found[0], key=_cost)]
        for choice in shared:
            found.append(min(found[-1], choice, key=_cost))
        return found


def _cheapest_share(first: list[Choice], second: list[Choice], octants: int) -> Choice:
    ways = [(first[k - 1].cost + second[octants - k - 1].cost, k) for k in range(1, octants)]
    cost, k = min(ways)
    return Choice(cost, first[k - 1].leaves + second[octants - k - 1].leaves)


def _cost(choice: Choice) -> float:
    return choice.cost


def half_area(low: Floats, high: Floats) -> Floats:
    x, y, z = np.moveaxis(high - low, -1, 0)
    area: Floats = x * y + y * z + z * x
    return area
