"""Rays that leave faces, thin ones too, from points that rounding has put above or below them."""

from typing import Any

import numpy as np
from numpy.random import Generator

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.promises.row import row

_FACES, _POINTS = 300, 60


def check_starts(rng: Generator) -> list[dict[str, Any]]:
    """Needles of all heights down to 2^-45 of their length; other faces may be met, the one that is left may not."""
    height = 2.0 ** -rng.integers(1, 46, (_FACES, 1))
    a, side, across = rng.normal(size=(3, _FACES, 3))
    corners = np.stack([a, a + side, a + 0.4 * side + height * across], 1)
    mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * _FACES, dtype=np.int32).reshape(-1, 3))
    face = np.repeat(np.arange(_FACES), _POINTS)
    points = np.einsum("nk,nkx->nx", rng.dirichlet([1.0, 1.0, 1.0], len(face)), corners[face])
    directions = rng.normal(size=points.shape)
    kept = []
    for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        found = tracer.all_hits(points, directions, leaving=face, contacts=False)
        again = found.ray[found.face == face[found.ray]]
        kept.append(~np.isin(np.arange(len(face)), again))
    return [row("a ray does not meet the face that it leaves, however thin", "which face it is", np.concatenate(kept))]
