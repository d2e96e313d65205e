"""Distortion of a pinhole's picture by its lens: the model of Brown and Conrady, as OpenCV has it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.numerics.polynomials import least_positive_root, polynomial

Floats = NDArray[np.float64]

# Newton's steps with their halvings: ten of them reach all bits, unless a place is far outside the picture.
_STEPS = 64
# How far off a solution may be, in units of the place: many roundings, and far less than where there is none.
_SOLVED = 2.0**-40


class Distortion(NamedTuple):
    """Radial coefficients k and tangential ones p.

    Places (x, y) are on the plane one unit ahead of the camera, to the right and down. With r² = x² + y² they move to

        x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
        y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
    """

    k1: float
    k2: float
    p1: float
    p2: float
    k3: float

    def reach(self) -> float:
        """The radius within which no two places move to the same one.

        The Jacobian is symmetric. With p = 0 its eigenvalues are g = 1 + k1 r² + k2 r⁴ + k3 r⁶ and h = d(r g) / dr.
        Where h > 8 |p| r up to some radius, it is positive definite there, so the map of that disc is one to one.
        """
        return least_positive_root(
            (1.0, -8.0 * math.hypot(self.p1, self.p2), 3.0 * self.k1, 0.0, 5.0 * self.k2, 0.0, 7.0 * self.k3)
        )

    def bent(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """The distorted places."""
        square = x * x + y * y
        # rule: distortion
        scale = polynomial((1.0, self.k1, self.k2, self.k3), square) + 2.0 * (self.p1 * y + self.p2 * x)
        # rule: tangential-distortion
        return x * scale + self.p2 * square, y * scale + self.p1 * square

    def straight(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """The places within ``reach`` that move to (x, y), by damped Newton's method; NaN where there are none."""
        aims, reach = np.stack([np.ravel(x), np.ravel(y)]), self.reach()
        places, missed, shares = np.zeros_like(aims), aims.copy(), np.ones(aims.shape[1])
        left = np.flatnonzero(aims.any(axis=0))
        with np.errstate(all="ignore"):  # a step may lead too far, and is halved
            for _ in range(_STEPS):
                here, before = places[:, left], missed[:, left]
                tried = here + shares[left] * self._step(here, before)
                after = aims[:, left] - self.bent(*tried)
                better = (np.hypot(*after) < np.hypot(*before)) & (np.hypot(*tried) <= reach)
                places[:, left[better]], missed[:, left[better]] = tried[:, better], after[:, better]
                shares[left] = np.where(better, np.minimum(1.0, 2.0 * shares[left]), 0.5 * shares[left])
                left = left[(tried != here).any(axis=0) & missed[:, left].any(axis=0)]
                if not len(left):
                    break
            solved = np.hypot(*missed) <= _SOLVED * (np.hypot(*aims) + np.hypot(*places))
        x_of, y_of = np.where(solved, places, np.nan)
        return x_of.reshape(np.shape(x)), y_of.reshape(np.shape(y))

    def _step(self, places: Floats, missed: Floats) -> Floats:
        """Newton's step from places that move to points which miss their aims by so much."""
        (x, y), (off_x, off_y) = places, missed
        square = x * x + y * y
        scale = polynomial((1.0, self.k1, self.k2, self.k3), square) + 2.0 * (self.p1 * y + self.p2 * x)
        slope = 2.0 * polynomial((self.k1, 2.0 * self.k2, 3.0 * self.k3), square)
        xx = scale + slope * x * x + 4.0 * self.p2 * x
        yy = scale + slope * y * y + 4.0 * self.p1 * y
        xy = slope * x * y + 2.0 * (self.p1 * x + self.p2 * y)
        return np.stack([yy * off_x - xy * off_y, xx * off_y - xy * off_x]) / (xx * yy - xy * xy)
