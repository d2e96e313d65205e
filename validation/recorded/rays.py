"""The rays of a record: three pictures along the axes, and rays in all directions, from the bounds of a mesh alone.

No random numbers and no functions of the C library: every machine computes the same bits.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# The only real root above 1 of x^7 = x + 1. Multiples of its powers, modulo 1, fill the cube of six dimensions evenly:
# M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
_ROOT = 1.1127756842787055


class View(NamedTuple):
    """A picture along an axis: from its upper end (``sign`` -1) or its lower one (1), and the axes of the picture."""

    axis: int
    sign: int
    across: int
    up: int


# From +x, from -y and from +z.
VIEWS = (View(0, -1, 1, 2), View(1, 1, 0, 2), View(2, -1, 0, 1))


class Rays(NamedTuple):
    """``origins`` and ``directions``, (n, 3): first the pixels of each view, row by row from above, then the others."""

    origins: Floats
    directions: Floats


def make_rays(lower: Floats, upper: Floats, side: int, others: int) -> Rays:
    """Three views of side x side pixels of the box from ``lower`` to ``upper``, and ``others`` in all directions."""
    parts = [_pixels(view, lower, upper, side) for view in VIEWS] + [_others(lower, upper, others)]
    return Rays(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _pixels(view: View, lower: Floats, upper: Floats, side: int) -> Rays:
    steps = (np.arange(side) + 0.5) / side
    origins = np.empty((side, side, 3))
    origins[..., view.across] = lower[view.across] + steps * (upper - lower)[view.across]
    origins[..., view.up] = (upper[view.up] - steps * (upper - lower)[view.up])[:, None]
    origins[..., view.axis] = (upper if view.sign < 0 else lower)[view.axis]
    directions = np.zeros((side * side, 3))
    directions[:, view.axis] = view.sign
    return Rays(origins.reshape(-1, 3), directions)


def _others(lower: Floats, upper: Floats, count: int) -> Rays:
    """Rays from the box of twice the size, so that some start within the mesh, to points of the box."""
    powers = np.cumprod(np.full(6, 1.0 / _ROOT))
    unit = (0.5 + np.arange(1, count + 1)[:, None] * powers) % 1.0
    size = upper - lower
    origins = lower + (2.0 * unit[:, :3] - 0.5) * size
    return Rays(origins, lower + unit[:, 3:] * size - origins)
