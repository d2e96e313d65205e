"""A point as searches read it."""

from typing import NamedTuple


class Point(NamedTuple):
    """A point in the tree's units, and where a block has each axis, as ``load_corners`` wants it."""

    row_x: int
    row_y: int
    row_z: int
    x: float
    y: float
    z: float
