"""Meshes of squares, or of parallelograms, of two faces each."""

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh


def squares(corners: NDArray[np.float64]) -> Mesh:
    """Squares (k, 4 corners, 3), counter-clockwise seen from outside; square i has the faces 2 i and 2 i + 1."""
    faces = np.arange(4 * len(corners), dtype=np.int32).reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]]
    return Mesh(corners.reshape(-1, 3), faces.reshape(-1, 3))
