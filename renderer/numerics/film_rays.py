"""Rays of an affine film map in NumPy, with the bits that the kernel of pictures computes.

The film position (x, y) is in pixels: (0, 0) is the top left corner of the film and (0.5, 0.5) the centre of its first
pixel.

    origin(x, y)    = rows[0] + x rows[1] + y rows[2]
    direction(x, y) = rows[3] + x rows[4] + y rows[5]      (not normalised)
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def affine_rays(rows: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Origins and unit directions (..., 3) of the rays through film positions ``x`` and ``y`` (...)."""
    origins, directions = affine_map(rows, x, y)
    return origins, unit_rows(directions)


def affine_map(rows: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Origins and directions (..., 3), not normalised, as the map above has them."""
    x, y = x[..., None], y[..., None]
    # The kernel adds in this order.
    return rows[0] + (rows[1] * x + rows[2] * y), rows[3] + (rows[4] * x + rows[5] * y)


def unit_rows(vectors: Floats) -> Floats:
    """``vec3.normalized`` of vectors (..., 3) that are not zero, with its bits."""
    scaled = vectors * (1.0 / np.abs(vectors).max(axis=-1, keepdims=True))
    x, y, z = (scaled[..., k : k + 1] for k in range(3))
    return scaled * (1.0 / np.sqrt(x * x + y * y + z * z))


def along(vectors: Floats, axis: Floats) -> Floats:
    """The components of vectors (..., 3) along ``axis``; each has the same bits however many there are."""
    return vectors[..., 0] * axis[0] + vectors[..., 1] * axis[1] + vectors[..., 2] * axis[2]
