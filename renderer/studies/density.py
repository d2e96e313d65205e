"""Whether points lie about as densely as the faces around them, by a sample of the faces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh

Floats = NDArray[np.float64]

# Faces at most for each point where they count as dense: with 1 a beam around the rays of a tile gains 12 to 26 %,
# with 30 and more it loses 3 to 58 %.
_FACES = 2
# Faces that are looked at: of a part of 1/36 of a mesh about a hundred, so its faces are known within a tenth or two.
_SAMPLE = 4096
# Cells along the longest side of the points' box: at most, and so few that points on a surface are some in each.
_CELLS, _IN_CELL = 32, 8


def are_dense(points: Floats, mesh: Mesh) -> bool:
    """Whether finite points (n, 3) have at most two faces of the mesh for each of them where they lie.

    The faces are those in the cells of a grid over the points' box that have points in them, counted by a sample and
    rounded up. So a part of a study, whose points lie together, is as dense as all of it; a small one that the curve
    tears apart may be taken for less. Answers do not depend on it, only how soon they come.
    """
    count, faces = len(points), len(mesh.faces)
    if _FACES * count >= faces:
        return True
    step = max(1, faces // _SAMPLE)
    if _FACES * count < step:  # fewer than what one face of the sample stands for
        return False
    lower, upper = points.min(axis=0), points.max(axis=0)
    with np.errstate(divide="ignore", over="ignore"):
        cells = min(_CELLS, max(1, int((count / _IN_CELL) ** 0.5)))
        rate = cells / (upper - lower).max()
        if not 0.0 < rate < np.inf:  # all in one place, or farther apart than float64 holds
            return False
        taken = np.zeros((cells + 1,) * 3, bool)
        taken[tuple(((points - lower) * rate).astype(np.int64).T)] = True
        places = (mesh.vertices[mesh.faces[::step, 0]] - lower) * rate
    # Half a cell more, for points on a face that reaches into the box.
    places = places[((places > -0.5) & (places < cells + 0.5)).all(axis=1)]
    near = np.clip(places, 0.0, cells).astype(np.int64)
    return _FACES * count >= step * (1 + int(np.count_nonzero(taken[tuple(near.T)])))
