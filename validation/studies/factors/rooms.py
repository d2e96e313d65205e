"""Rooms and streets of axis-parallel rectangles, with what two rectangles exchange where nothing hides them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from validation.meshes import squares
from validation.oracle.view_factors.rectangles import Span, parallel_exchange, perpendicular_exchange

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Room(NamedTuple):
    """A mesh, the surface that each of its faces belongs to, and of ``cells`` the plane of each surface."""

    mesh: Mesh
    groups: Ints
    planes: tuple["Plane", ...] = ()

    @property
    def areas(self) -> Floats:
        """The area of each surface, one side of it."""
        corners = self.mesh.triangles
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas: Floats = np.bincount(self.groups, np.linalg.norm(across, axis=1) / 2.0).astype(np.float64)
        return areas


class Plane(NamedTuple):
    """The plane across ``axis`` at ``at``, its front towards ``sign``."""

    axis: int
    sign: int
    at: float


class Plate(NamedTuple):
    """A rectangle across ``axis`` at ``at``, front towards ``sign``; ``spans`` along the other axes in their order."""

    axis: int
    sign: int
    at: float
    spans: tuple[Span, Span]

    @property
    def area(self) -> float:
        """Of one side."""
        return (self.spans[0].high - self.spans[0].low) * (self.spans[1].high - self.spans[1].low)

    def along(self, axis: int) -> Span:
        """Its span along another axis than its own."""
        return self.spans[[other for other in range(3) if other != self.axis].index(axis)]

    def corners(self) -> Floats:
        """(4, 3), counter-clockwise from its front."""
        u, v = self.spans
        flat = np.array([[u.low, v.low], [u.high, v.low], [u.high, v.high], [u.low, v.high]])
        # Of x, y and y, z the cross product is the axis left; of x, z it is -y.
        turned = flat if self.sign * (-1 if self.axis == 1 else 1) > 0 else flat[::-1]
        return np.insert(turned, self.axis, self.at, axis=1)


def between(one: Plate, other: Plate) -> float:
    """A1 F12 where nothing hides the part of each that is in front of the other."""
    if one.axis == other.axis:
        facing = one.sign != other.sign and (other.at - one.at) * one.sign > 0.0
        return parallel_exchange(one.spans, other.spans, abs(one.at - other.at)) if facing else 0.0
    common = 3 - one.axis - other.axis
    near, far = _before(one.along(other.axis), other), _before(other.along(one.axis), one)
    if near.high <= near.low or far.high <= far.low:
        return 0.0
    return perpendicular_exchange((near, one.along(common)), (other.along(common), far))


def _before(span: Span, plane: Plate) -> Span:
    """The distances of a span's points in front of a plane, without what is behind it."""
    low, high = sorted(max(0.0, (end - plane.at) * plane.sign) for end in span)
    return Span(low, high)


def box_plates(lower: Sequence[float], upper: Sequence[float], inward: bool) -> list[Plate]:
    """The six sides of a box, two for each axis."""
    spans = [Span(low, high) for low, high in zip(lower, upper, strict=True)]
    found = []
    for axis in range(3):
        u, v = (spans[other] for other in range(3) if other != axis)
        for at, out in ((lower[axis], -1), (upper[axis], 1)):
            found.append(Plate(axis, -out if inward else out, at, (u, v)))
    return found


def of_plates(plates: Sequence[Plate], groups: Sequence[int] | None = None) -> Room:
    """Two faces for each plate; a plate is a surface of its own unless ``groups`` has its number."""
    numbers = np.arange(len(plates)) if groups is None else np.asarray(groups)
    return Room(squares(np.stack([plate.corners() for plate in plates])), np.repeat(numbers, 2).astype(np.int64))


def cells(heights: Sequence[Sequence[int]], ceiling: int | None = None) -> Room:
    """Ground, roofs and walls over unit cells of these heights; what lies in one plane is one surface.

    With a ``ceiling`` it is a closed room, in which cells of that height are solid. Without one it is open at its
    border.
    """
    z = np.asarray(heights)
    found: list[Plate] = []
    for (i, j), height in np.ndenumerate(z):
        flat = (Span(i, i + 1), Span(j, j + 1))
        if ceiling is None or height < ceiling:
            found.append(Plate(2, 1, float(height), flat))
            found += [Plate(2, -1, float(ceiling), flat)] if ceiling is not None else []
    for axis in range(2):
        rows = z if axis == 0 else z.T
        if ceiling is not None:
            edge = np.full((1, rows.shape[1]), ceiling)
            rows = np.concatenate([edge, rows, edge])
        first = 0 if ceiling is not None else 1
        for (i, j), (low, high) in _pairs(rows):
            spans = (Span(j, j + 1), Span(min(low, high), max(low, high)))
            found.append(Plate(axis, 1 if low > high else -1, float(i + first), spans))
    planes = [Plane(plate.axis, plate.sign, plate.at) for plate in found]
    numbers = {plane: number for number, plane in enumerate(dict.fromkeys(planes))}
    return of_plates(found, [numbers[plane] for plane in planes])._replace(planes=tuple(numbers))


def _pairs(rows: NDArray[np.int64]) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Neighbours in the first direction whose heights differ, with their place."""
    steps = np.argwhere(rows[:-1] != rows[1:]).tolist()
    return [((i, j), (int(rows[i, j]), int(rows[i + 1, j]))) for i, j in steps]


def room_with_column(column: bool = True) -> Room:
    """A room 5 x 5 x 3 with a square column in its middle, or without."""
    heights = np.zeros((5, 5), np.int64)
    heights[2, 2] = 3 * column
    return cells(heights.tolist(), ceiling=3)


def l_room() -> Room:
    """A room in the shape of an L, 4 x 4 x 2."""
    heights = np.zeros((4, 4), np.int64)
    heights[2:, 2:] = 2
    return cells(heights.tolist(), ceiling=2)


def quarter() -> Room:
    """A street between houses of several heights, with a side street, under the sky."""
    return cells([[3, 3, 0, 2, 2, 2], [3, 3, 0, 2, 2, 2], [0] * 6, [0] * 6, [4, 4, 1, 0, 3, 3], [4, 4, 1, 0, 3, 3]])


def two_rooms() -> Room:
    """Two rooms beside each other: a wall two cells thick lies between them."""
    return cells([[0, 0], [2, 2], [2, 2], [0, 0]], ceiling=2)


ROOMS = {"room with a column": room_with_column, "room in the shape of an L": l_room, "street with houses": quarter}
