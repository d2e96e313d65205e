"""Rays that leave faces, thin ones too, from points that rounding has put above or below them."""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.meshes import loose
from validation.promises.row import row

_FACES, _POINTS = 300, 60


def check_starts(rng: Generator) -> list[dict[str, Any]]:
    """Needles of all heights down to 2^-45 of their length; other faces may be met, the one that is left may not."""
    height = 2.0 ** -rng.integers(1, 46, (_FACES, 1))
    a, side, across = rng.normal(size=(3, _FACES, 3))
    corners = np.stack([a, a + side, a + 0.4 * side + height * across], 1)
    mesh = loose(corners)
    face = np.repeat(np.arange(_FACES), _POINTS)
    points = np.einsum("nk,nkx->nx", rng.dirichlet([1.0, 1.0, 1.0], len(face)), corners[face])
    directions = rng.normal(size=points.shape)
    kept = []
    for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        found = tracer.all_hits(points, directions, leaving=face, contacts=False)
        again = found.ray[found.face == face[found.ray]]
        kept.append(~np.isin(np.arange(len(face)), again))
    return [
        row("a ray does not hit the face that it leaves, however thin", "known answer", np.concatenate(kept)),
        row("each query leaves the face named by leaving", "known answer", _alone()),
        row("a ray from the foot of a wall through the wall is stopped at once", "known answer", _feet(rng)),
    ]


def _feet(rng: Generator) -> NDArray[np.bool_]:
    """Rays from the foot of a wall, which stands within a face, off the side that they lead away from."""
    ground = Mesh([[-10, -10, 0], [30, -10, 0], [-10, 30, 0]], [[0, 1, 2]])
    wall = Mesh([[0, -2, 0], [0, 2, 0], [0, 2, 4], [0, -2, 4]], [[0, 1, 2], [0, 2, 3]])
    feet, kept = np.zeros((_POINTS, 3)), []
    feet[:, 1] = rng.uniform(-2.0, 2.0, _POINTS)
    for first, parts in ((1, [ground, wall]), (0, [wall, ground])):
        mesh = Mesh.concatenate(parts)
        for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
            for side in (1, -1):
                through = tracer.closest_hit(feet, [-side, 0.0, 1.0], leaving=first, side=side)
                off = tracer.closest_hit(feet, [side, 0.0, 1.0], leaving=first, side=side)
                kept += [(through.t == 0.0) & np.isin(through.face, [first, first + 1]), ~off.hit]
    return np.concatenate(kept)


def _alone() -> NDArray[np.bool_]:
    """Rays off a triangle's own points, up and down, of which none meets anything; and -1 leaves nothing."""
    corners = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    points, kept = np.full((40, 3), 0.25) * [1.0, 1.0, 0.0], []
    directions = np.tile([[0.125, 0.25, 1.0], [0.5, 0.0, -1.0]], (20, 1))
    for tracer in (Octree(corners, [[0, 1, 2]]), BruteForce(corners, [[0, 1, 2]])):
        for count, leaving in ((1, 0), (40, 0), (1, -1), (40, -1)):
            rays, met = (points[:count], directions[:count]), leaving < 0
            kept += [
                (tracer.closest_hit(*rays, leaving=leaving).hit == met).all(),
                (tracer.any_hit(*rays, leaving=leaving) == met).all(),
                (tracer.count_hits(*rays, leaving=leaving) == met).all(),
                len(tracer.all_hits(*rays, leaving=leaving).t) == count * met,
            ]
    return np.array(kept)
