"""A point prepared for searches."""

from typing import NamedTuple


class Point(NamedTuple):
    """A point in the tree's units, and the rows of a block for each axis, as ``load_corners`` takes them."""

    row_x: int
    row_y: int
    row_z: int
    x: float
    y: float
    z: float
