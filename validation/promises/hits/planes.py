"""A plane of many faces is met wherever a ray aims, from near and from where its leaves are as thin as rounding."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import lattice_faces
from renderer.octree import Octree
from validation.promises.row import row

_SIDE, _PIXELS = 400, 128
_EYES = ((1000.3, 500.2, 2000.7), (30.3, -10.2, 50.7), (-3.3, 2.2, 5.7), (7.3e4, 2.2e4, 1e5))


def check_planes() -> list[dict[str, Any]]:
    """The unit square of 318,402 faces; rays of each eye four by four, which travel in packets."""
    across = np.linspace(0.0, 1.0, _SIDE)
    x, y = np.meshgrid(across, across)
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    octree = Octree.from_mesh(Mesh(vertices, lattice_faces(_SIDE, _SIDE).reshape(-1, 3)))
    kept: list[NDArray[np.bool_]] = []
    for eye in _EYES:
        directions = _targets() - eye
        kept += [octree.any_hit(eye, directions), octree.closest_hit(eye, directions).hit]
    return [row("no ray from afar passes through a plane of many faces", "closed form", np.concatenate(kept))]


def _targets() -> NDArray[np.float64]:
    """Points of the square, by tiles of four by four."""
    across = np.linspace(0.01, 0.99, _PIXELS)
    grid = np.stack([*np.meshgrid(across, across), np.zeros((_PIXELS, _PIXELS))], axis=-1)
    tiles = grid.reshape(_PIXELS // 4, 4, _PIXELS // 4, 4, 3).transpose(0, 2, 1, 3, 4)
    return np.ascontiguousarray(tiles.reshape(-1, 3))
