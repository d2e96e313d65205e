"""One ray has the same bits alone and in any batch: the choices that a ray makes for itself are not its neighbours'."""

from itertools import permutations, product
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.shapes import icosphere
from renderer.octree import Octree
from validation.meshes import loose
from validation.promises.row import row

_RAYS = 16
# How much less the components that are not equal are: by as much as rays of one packet may differ, and by an ulp.
_LESS = (2.0**-9, 2.0**-40, 2.0**-53)
# Heaps of triangles, and rays from each place where one passes through another, a few a call.
_HEAPS, _TRIANGLES, _FROM_EACH, _FEW = 4, 12, 12, 7


def check_alone(rng: Generator) -> list[dict[str, Any]]:
    """Sixteen rays alike at a small ball far away: most have two or three equal components, some nearly so."""
    ball, kept = icosphere(3), []
    cases = product(permutations(range(3)), (0.0, 0.3, 1.0), (1.0, -1.0), _LESS, range(3))
    for order, third, sign, less, first in cases:
        towards = np.array([1.0, sign, third])[list(order)]
        octree = Octree(0.02 * ball.vertices + 30.0 * towards, ball.faces)
        directions = np.tile(towards, (_RAYS, 1))
        directions[0, first] *= 1.0 - less  # the first ray's largest component is the packet's axis
        other = rng.integers(1, _RAYS, rng.integers(0, 4))
        directions[other, rng.integers(0, 3, len(other))] *= 1.0 - less
        origins = 0.005 * rng.normal(size=(_RAYS, 3))
        together, hidden = octree.closest_hit(origins, directions), octree.any_hit(origins, directions)
        for k in range(_RAYS):
            alone = octree.closest_hit(origins[k], directions[k])
            same = [_equal(getattr(alone, name), getattr(together, name)[k]) for name in ("t", "face", "u", "v")]
            kept.append(all(same) and hidden[k] == alone.hit)
    leaving = np.concatenate([_leaving(rng) for _ in range(_HEAPS)])
    return [
        row("a ray gives the same bits in any batch", "single ray", np.array(kept)),
        row("a ray from where an edge passes through a face gives the same bits in any batch", "few rays", leaving),
    ]


def _leaving(rng: Generator) -> NDArray[np.bool_]:
    """Rays that leave a face, to either side, where rounding puts the edge of another on either side of their start."""
    mesh = loose(rng.normal(size=(_TRIANGLES, 3, 3)))
    places, faces = _pierced(mesh.triangles)
    origins, left = np.repeat(places, _FROM_EACH, axis=0), np.repeat(faces, _FROM_EACH)
    directions, side = rng.normal(size=origins.shape), rng.choice([-1, 1], len(left))
    octree, kept = Octree.from_mesh(mesh), []
    together = octree.closest_hit(origins, directions, leaving=left, side=side)
    for k in range(0, len(left), _FEW):
        some = slice(k, k + _FEW)
        few = octree.closest_hit(origins[some], directions[some], leaving=left[some], side=side[some])
        kept.append((few.t == together.t[some]) & (few.face == together.face[some]))
    return np.concatenate(kept)


def _pierced(triangles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The places where edges of triangles (n, 3, 3) pass through others, and the faces that have these."""
    start, end = triangles.reshape(-1, 3), np.roll(triangles, -1, axis=1).reshape(-1, 3)
    places, faces = [], []
    for face, (a, b, c) in enumerate(triangles):
        normal = np.cross(b - a, c - a)
        first, last = (start - a) @ normal, (end - a) @ normal
        crosses = (first * last < 0.0) & (np.arange(len(start)) // 3 != face)
        share = first[crosses] / (first - last)[crosses]
        points = start[crosses] + share[:, None] * (end - start)[crosses]
        sides = [np.cross(q - p, points - p) @ normal for p, q in ((a, b), (b, c), (c, a))]
        within = np.min(sides, axis=0) > 0.0
        places.append(points[within])
        faces += [face] * int(within.sum())
    return np.concatenate(places), np.array(faces)


def _equal(one: NDArray[Any], other: NDArray[Any]) -> bool:
    """Whether two numbers are the same to the last bit, or both are no number."""
    return bool(np.array_equal(one, other, equal_nan=True))
