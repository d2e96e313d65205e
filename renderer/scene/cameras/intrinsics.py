"""Intrinsics: where the plane one unit ahead of a camera is on its film."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Intrinsics(NamedTuple):
    """Focal lengths, principal point and skew in pixels of a film.

    Places on the plane are how far they lie to the right and down, in units of their distance along the axis.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    skew: float

    def film(self, right: Floats, down: Floats) -> tuple[Floats, Floats]:
        """The film positions of places on the plane."""
        return self.fx * right + self.skew * down + self.cx, self.fy * down + self.cy

    def plane(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """The places on the plane that appear at film positions."""
        down = (y - self.cy) / self.fy
        return (x - self.cx - self.skew * down) / self.fx, down
