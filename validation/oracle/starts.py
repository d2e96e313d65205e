"""First hits of rays that start on a surface, in exact rational arithmetic: the judge of ``leaving``.

A start is a real point: an exact combination of a face's corners, or the face's point nearest to a given one. The rule:

- Nothing is named: a face that holds the start is hit at t = 0 by each ray that is not in its plane.
- A face is named: the faces that hold the start do not stop the ray.
- A face and a side are named: the faces that hold the start cut the directions into regions. The ray starts in the
  region on that side of the face. One that leads into its closure is not stopped. Another is stopped at t = 0 by the
  lowest face that holds the start and has the region on one side alone and the ray's direction on the other.
- ``through``: the ray came upon the face, and upon those that coincide with it there, and has gone through it to the
  named side. It passes them in the order of their numbers, the lowest after the highest, from the one that it came upon
  first; if it leads to the named side, the next one stops it at t = 0.

All other faces are met as ``exact`` says. Where faces cross at the start, the face's side may be several regions, and
each has its answer. A face without area is no face here.
"""

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import lcm
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from validation.oracle.cones import Regions, cone_at
from validation.oracle.distance import way_to
from validation.oracle.exact import determinant_bounds, ratio
from validation.oracle.fans import Fan
from validation.oracle.vectors import Whole, cross, difference, dot, rational, whole

Floats = NDArray[np.float64]
Place = tuple[Fraction, Fraction, Fraction]

# ``Regions`` makes some cells for each pair of faces: above this a corner has to be a closed fan.
MOST_CONES = 16
_RAYS_AT_ONCE = 1024


class Start(NamedTuple):
    """The start of a ray, and the face that it leaves; -1 where none is named.

    ``pile`` is the face at which it came upon those that coincide with ``face``: None where that is ``face``.
    """

    place: Place
    face: int = -1
    pile: int | None = None


class First(NamedTuple):
    """The first hit of a ray: t, None on a miss; the lowest face that is hit there, -1 on a miss; all of them."""

    t: Fraction | None
    face: int
    faces: tuple[int, ...]


_MISS = First(None, -1, ())


def start_on(corners: ArrayLike, u: float, v: float) -> Place:
    """(1 - u - v) p0 + u p1 + v p2, exactly; a weight that rounding made negative counts as 0, others as their shares.

    >>> [float(x) for x in start_on([[0, 0, 0], [4, 0, 0], [0, 4, 0]], 0.25, 0.5)]
    [1.0, 2.0, 0.0]
    """
    p0, p1, p2 = rational(np.asarray(corners, np.float64).tolist())
    b, c = Fraction(float(u)), Fraction(float(v))
    a, b, c = (max(weight, Fraction(0)) for weight in (1 - b - c, b, c))
    x, y, z = ((a * k0 + b * k1 + c * k2) / (a + b + c) for k0, k1, k2 in zip(p0, p1, p2, strict=True))
    return x, y, z


def start_near(corners: ArrayLike, point: ArrayLike) -> Place:
    """The point of a face that is nearest to ``point``, exactly.

    >>> [float(x) for x in start_near([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [1, -2, 3])]
    [1.0, 0.0, 0.0]
    """
    (given,) = rational([np.asarray(point, np.float64).tolist()])
    way = way_to(given, rational(np.asarray(corners, np.float64).tolist()))
    x, y, z = (k + w for k, w in zip(given, way, strict=True))
    return x, y, z


def first_hit(
    vertices: ArrayLike, faces: ArrayLike, start: Start, direction: ArrayLike, side: int = 0, through: bool = False
) -> tuple[Fraction | None, int]:
    """t and face of one ray's first hit, (None, -1) on a miss.

    >>> corners = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 2], [3, 1, 2], [1, 3, 2]]
    >>> first_hit(corners, [[0, 1, 2], [3, 4, 5]], Start(start_on(corners[:3], 0.25, 0.5), 0), [0, 0, 4], 1)
    (Fraction(1, 2), 1)
    """
    found = Surface(vertices, faces).first(start, direction, side, through)
    if len(found) > 1:
        raise ValueError(f"start: expected one region on the face's side, got hits {found}")
    return found[0].t, found[0].face


class Surface:
    """A mesh as whole numbers, and the regions at those of its points that have been asked for.

    ``largest`` is the largest size of a coordinate.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        points, self.faces = np.asarray(vertices, np.float64), np.asarray(faces, np.int64).reshape(-1, 3)
        self._corners = points[self.faces]
        self.largest = float(np.abs(self._corners).max(initial=0.0))
        self._low, self._high = self._corners.min(axis=1), self._corners.max(axis=1)
        self._whole, self._unit = whole(points.tolist())
        self._triangles = [(self._whole[i], self._whole[j], self._whole[k]) for i, j, k in self.faces.tolist()]
        self._normals = [cross(difference(b, a), difference(c, a)) for a, b, c in self._triangles]
        self._cut: dict[tuple[tuple[int, tuple[bool, ...]], ...], Regions | Fan] = {}

    def start_on(self, face: int, u: float, v: float) -> Start:
        """A start at a face's barycentrics, see ``start_on``."""
        return Start(start_on(self._corners[face], u, v), face)

    def start_near(self, face: int, point: ArrayLike) -> Start:
        """A start at a face's point nearest to another, see ``start_near``."""
        return Start(start_near(self._corners[face], point), face)

    def normal(self, face: int) -> list[int]:
        """A face's normal by its winding, not of length 1."""
        return self._normals[face]

    def corners(self, face: int) -> list[list[float]]:
        """A face's corners."""
        found: list[list[float]] = self._corners[face].tolist()
        return found

    @property
    def triangles(self) -> Floats:
        """The corners of all faces, (n, 3, 3)."""
        return self._corners

    def size(self, face: int) -> float:
        """A face's largest extent along an axis."""
        return float(np.ptp(self._corners[face], axis=0).max())

    def holding(self, place: Place) -> list[tuple[int, tuple[bool, ...]]]:
        """The faces, ascending, that hold a point, and on which of their sides 01, 12, 20 it lies."""
        origin, bottom = self._scaled(place)
        near = np.array([float(x) for x in place])
        # ``near`` is rounded: a box that holds the point reaches as far as its neighbours.
        beside = (self._low <= np.nextafter(near, np.inf)) & (self._high >= np.nextafter(near, -np.inf))
        found = []
        for face in np.flatnonzero(beside.all(axis=1)).tolist():
            normal = self._normals[face]
            a, b, c = self._relative(face, origin, bottom)
            if not any(normal) or dot(normal, a) != 0:
                continue
            turns = [dot(normal, cross(p, q)) for p, q in ((a, b), (b, c), (c, a))]
            if min(turns) >= 0:
                found.append((face, tuple(turn == 0 for turn in turns)))
        return found

    def regions(self, held: Iterable[tuple[int, tuple[bool, ...]]]) -> Regions | Fan:
        """The regions into which the faces that hold a point, as ``holding`` gives them, cut the directions there."""
        key = tuple(held)
        if key not in self._cut:
            cones = [cone_at(face, self._triangles[face], sides) for face, sides in key]
            self._cut[key] = Regions(cones) if len(cones) <= MOST_CONES else Fan(cones)
        return self._cut[key]

    def first(self, start: Start, direction: ArrayLike, side: int = 0, through: bool = False) -> list[First]:
        """The first hits of one ray: one, but for faces that cross at the start."""
        return self.each([start], np.asarray(direction, np.float64)[None], [side], [through])[0]

    def each(
        self, starts: Sequence[Start], directions: Floats, sides: Sequence[int], through: Sequence[bool]
    ) -> list[list[First]]:
        """The first hits of many rays, as ``first`` for each."""
        found = []
        for begin in range(0, len(starts), _RAYS_AT_ONCE):
            rows = range(begin, min(begin + _RAYS_AT_ONCE, len(starts)))
            kept = self.possible([starts[row].place for row in rows], directions[begin : rows.stop])
            for row, possible in zip(rows, kept, strict=True):
                (way,), unit = whole([directions[row].tolist()])
                found.append(self._first(starts[row], (way, unit), possible, (int(sides[row]), bool(through[row]))))
        return found

    def _first(
        self, start: Start, way: tuple[Whole, int], possible: NDArray[np.int64], at: tuple[int, bool]
    ) -> list[First]:
        """The first hits of a ray along ``way``, times its unit, at the ``possible`` faces; ``at``: side, through."""
        side, through = at
        if start.face < 0:
            return [self._nearest(start.place, way, possible.tolist())]
        held = self.holding(start.place)
        stops: set[int | None] = {None}
        if side and any(self._normals[start.face]):
            if start.face not in dict(held):
                raise ValueError(f"start: expected a point of face {start.face}, got {start.place}")
            stops = stopped(self.regions(held), start.face, way[0], side, through, start.pile)
        found = [First(Fraction(0), face, (face,)) for face in stops if face is not None]
        if None in stops:
            left = {face for face, _ in held}
            found.append(self._nearest(start.place, way, [f for f in possible.tolist() if f not in left]))
        return found

    def _scaled(self, place: Place) -> tuple[Whole, int]:
        """A point times the mesh's unit, as whole numbers over one more."""
        bottom = lcm(*(x.denominator for x in place))
        x, y, z = (int(k * bottom * self._unit) for k in place)
        return (x, y, z), bottom

    def _relative(self, face: int, origin: Whole, bottom: int) -> list[list[int]]:
        """A face's corners less a point, times the number that the point is over."""
        return [[bottom * x - o for x, o in zip(corner, origin, strict=True)] for corner in self._triangles[face]]

    def _nearest(self, place: Place, way: tuple[Whole, int], faces: Sequence[int]) -> First:
        """The first of some faces along a ray, t >= 0."""
        (origin, bottom), (d, d_unit) = self._scaled(place), way
        best, tied = (1, 0), list[int]()
        for face in faces:
            a, b, c = ((bottom * x, bottom * y, bottom * z) for x, y, z in self._triangles[face])
            found = ratio(a, b, c, origin, d)
            if found is None or found[0] < 0:
                continue
            later = found[0] * best[1] - best[0] * found[1]
            if later <= 0:
                best, tied = found, [*([] if later else tied), face]
        if not tied:
            return _MISS
        return First(Fraction(*best) * Fraction(d_unit, bottom * self._unit), tied[0], tuple(tied))

    def possible(self, places: Sequence[Place], directions: Floats) -> list[NDArray[np.int64]]:
        """For each ray the faces that float64 cannot prove to be missed.

        As ``exact`` does it, with what the rounding of the origin adds: |d|_inf |e|_1 (|b|_1 + |c|_1 + |e|_1) for an
        error e of b and of c, and so on.
        """
        count = len(self.faces)
        origins = np.array([[float(x) for x in place] for place in places]).reshape(-1, 3)
        error = np.spacing(np.abs(origins)).sum(axis=1)
        with np.errstate(over="ignore", invalid="ignore", under="ignore"):
            relative = (self._corners - origins[:, None, None]).reshape(-1, 3, 3)
            d = np.repeat(directions, count, axis=0)
            a, b, c = relative[:, 0], relative[:, 1], relative[:, 2]
            values = np.stack([(d * np.cross(p, q)).sum(axis=1) for p, q in ((b, c), (c, a), (a, b))], axis=1)
            size, e = np.abs(relative).sum(axis=2), np.repeat(error, count)[:, None]
            pairs = size[:, [1, 2, 0]] + size[:, [2, 0, 1]] + e
            moved = 1.01 * np.abs(d).max(axis=1)[:, None] * e * pairs
            bounds = determinant_bounds(relative, d) + moved
            missed = (values > bounds).any(axis=1) & (values < -bounds).any(axis=1)
        return [np.flatnonzero(row) for row in ~missed.reshape(-1, count)]


def stopped(
    regions: Regions | Fan, face: int, way: Whole, side: int, through: bool, pile: int | None = None
) -> set[int | None]:
    """The faces that may stop a ray at once; None where none does. More than one only where faces cross there."""

    def rank(other: int) -> tuple[bool, int]:
        return other < (face if pile is None else pile), other

    around, ahead = regions.around(way), through and regions.cones[face].side(way) == side
    found: set[int | None] = set()
    for piece in regions.pieces[face]:
        later = sorted((other for other in piece.faces if rank(other) > rank(face)), key=rank) if ahead else []
        here = piece.above if side > 0 else piece.below
        if later:
            found.add(later[0])
        elif here in around:
            found.add(None)
        else:
            found |= _behind(regions, here, way)
    return found


def _behind(regions: Regions | Fan, region: int, way: Whole) -> set[int]:
    """The lowest face that lies between a region and a direction: more than one where only parts of a face do.

    A face with the region on both sides, as a fin has, is not between.
    """
    some: set[int] = set()
    for face in sorted(regions.cones):
        leads = regions.cones[face].side(way)
        ends = [(p.below, p.above) if leads > 0 else (p.above, p.below) for p in regions.pieces[face]]
        between = [leads != 0 and here == region and beyond != region for here, beyond in ends]
        if any(between):
            some.add(face)
        if all(between):
            break
    if not some:
        raise AssertionError("a direction outside a region is beyond a face of its border")
    return some
