"""The axis that points up: that of a mesh file which does not say, or of a scene."""

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect

UP_AXES = {"x": 0, "y": 1, "z": 2}
# Quarter turns that take vectors with y up to vectors with this axis up.
_TURNS = {
    "x": ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "y": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "z": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
}


def up_axis(value: object, argument: str = "up") -> int:
    """The place of the axis named 'x', 'y' or 'z': 0, 1 or 2. Raises ``ValueError`` naming ``argument``."""
    known = isinstance(value, str) and value in UP_AXES
    expect(known, argument, "'x', 'y' or 'z'", repr(value))
    return UP_AXES[str(value)]


def turn_to(up: str) -> NDArray[np.float64]:
    """The rotation, (3, 3), that takes the y axis to the axis ``up``."""
    return np.array(_TURNS[up])
