"""Points in, on and beside closed solids whose coordinates are of all sizes: each solid alone, in whole numbers."""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.meshes import integer_box, loose
from validation.oracle.vectors import cross, dot, relative, volume
from validation.promises.queries.heaps import heaps
from validation.promises.row import row

Floats = NDArray[np.float64]
# Squares along each side of a box, and points beside its sides.
_SQUARES, _BESIDE = 20, 400


def check_inside(rng: Generator) -> list[dict[str, Any]]:
    """Tetrahedra that overlap, turned either way, some of them flat, by both rules, with and without surface."""
    found = []
    for faces, points in heaps(rng):
        mesh = loose(faces)
        told = [_told(relative(point, faces.tolist())[0]) for point in points.tolist()]
        winding, on = (np.array(one) for one in zip(*told, strict=True))
        for asked in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
            found += [
                asked.contains(points) == ((winding != 0) | on),
                asked.contains(points, boundary=False) == ((winding != 0) & ~on),
                asked.contains(points, boundary=False, rule="even-odd") == ((winding % 2 == 1) & ~on),
            ]
    promise = "inside is exact, whatever the sizes of coordinates"
    return [
        row(promise, "integer arithmetic", np.concatenate(found)),
        row("points a float32 step or less beside a flat side are distinguished", "closed form", _slabs(rng)),
    ]


def _slabs(rng: Generator) -> NDArray[np.bool_]:
    """Boxes of which each side is a grid, so that nodes of the tree are flat, and points beside their sides."""
    kept = []
    for axis, turn in product(range(3), (1.0, -1.0)):
        mesh = integer_box(_SQUARES)
        size = np.roll([8.25, _SQUARES, _SQUARES], axis) / _SQUARES
        start = np.roll([1.75, 0.0, 0.0], axis)
        vertices = turn * (mesh.vertices * size + start)
        octree = Octree.from_mesh(Mesh(vertices, mesh.faces if turn > 0 else mesh.faces[:, ::-1]))
        points = start + size * rng.uniform(0.15, 0.85, (_BESIDE, 3)) * _SQUARES
        off = 2.0 ** -rng.uniform(22.0, 50.0, _BESIDE) * rng.choice([-1.0, 1.0], _BESIDE)
        end = rng.integers(0, 2, _BESIDE)
        points[:, axis] = np.where(end, 10.0, 1.75) + off
        kept.append(octree.contains(turn * points) == (off > 0.0) ^ (end == 1))
    return np.concatenate(kept)


def _told(faces: list[list[list[int]]]) -> tuple[int, bool]:
    """The winding number of tetrahedra around the origin, and whether it lies on a face of one."""
    winding, on = 0, False
    for k in range(0, len(faces), 4):
        volumes = [volume(face) for face in faces[k : k + 4]]
        # Outwards, all are above 0 where the origin lies inside.
        winding += all(x > 0 for x in volumes) - all(x < 0 for x in volumes)
        on = on or any(lies_on(face) for face, x in zip(faces[k : k + 4], volumes, strict=True) if x == 0)
    return winding, on


def lies_on(face: Sequence[Sequence[int]]) -> bool:
    """Whether the origin, in a face's plane, lies on the face, which may be a line or a point.

    Within, it is to the left of all sides or to the right of all. On the line of such a face, coordinates tell.
    """
    a, b, c = face
    sides = [cross(a, b), cross(b, c), cross(c, a)]
    if any(any(side) for side in sides):
        return all(dot(sides[i], sides[i - 1]) >= 0 for i in range(3))
    return all(min(x) <= 0 <= max(x) for x in zip(a, b, c, strict=True))
