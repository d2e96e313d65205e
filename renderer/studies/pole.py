"""A direction, such as that which points up, given as an axis or a vector."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.arguments.up import up_axis
from renderer.errors import expect
from renderer.studies.share import check_directions


def pole_of(up: str | ArrayLike, argument: str = "up") -> NDArray[np.float64]:
    """The direction (3,) of the axis named 'x', 'y' or 'z', or the vector itself. Errors name ``argument``."""
    if isinstance(up, str):
        return np.eye(3)[up_axis(up, argument)]
    rows = check_directions(argument, np.reshape(up, (1, -1)) if np.ndim(up) == 1 else up)
    expect(len(rows) == 1, argument, "shape (3,)", f"shape {rows.shape}")
    return rows[0]
