"""The meshes of the section on studies: streets, shafts and walls with closed forms, and towns, terrains and soups."""

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, lattice_faces
from validation.meshes import loose

Floats = NDArray[np.float64]
# What stands for endless: beyond so many units lies less than 1e-10 of a hemisphere by cosine, 1e-5 by solid angle.
FAR = 1e5
# The sides of a round shaft: its area is that of a circle but for 1.3e-5.
_SIDES = 720
_SEED = 2043


def street(width: float, depth: float) -> Mesh:
    """A floor, face 0 and 1, at z = 0 between two walls along y; the middle is x = 0."""
    x, y, z = width / 2.0, FAR, depth
    corners = [[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0], [-x, -y, z], [-x, y, z], [x, -y, z], [x, y, z]]
    return Mesh(corners, [[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4], [1, 6, 7], [1, 7, 2]])


def shaft(radius: float, depth: float) -> Mesh:
    """The wall of a round shaft about z, from z = 0 up."""
    angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    corners = np.concatenate([np.insert(ring, 2, 0.0, axis=1), np.insert(ring, 2, depth, axis=1)])
    a, b = np.arange(_SIDES), np.roll(np.arange(_SIDES), -1)
    return Mesh(corners, np.concatenate([np.stack([a, b, _SIDES + b], 1), np.stack([a, _SIDES + b, _SIDES + a], 1)]))


def awning(radius: float, height: float) -> Mesh:
    """A level disc about z, in faces around its middle."""
    angle, numbers = 2.0 * np.pi * np.arange(_SIDES) / _SIDES, np.arange(_SIDES)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(_SIDES, height)], axis=1)
    corners = np.append(ring, [[0.0, 0.0, height]], axis=0)
    return Mesh(corners, np.stack([numbers, np.roll(numbers, -1), np.full(_SIDES, _SIDES)], axis=1))


def walls(planes: str) -> Mesh:
    """A large triangle across each of the named axes at 0: of "xz" a wall and a floor."""
    far = 1e7
    corners = {
        "x": [[0, -far, -far], [0, far, -far], [0, 0, far]],
        "y": [[-far, 0, -far], [far, 0, -far], [0, 0, far]],
        "z": [[-far, -far, 0], [far, -far, 0], [0, far, 0]],
    }
    return loose([corners[plane] for plane in planes])


def town(houses: int = 5, ground: int = 24) -> Mesh:
    """Houses apart from each other on level ground, z up, all corners at whole multiples of 2^-10."""
    rng = np.random.default_rng(_SEED)
    pieces = [_plate((-0.5, -0.5, 0.0), (houses, 0, 0), (0, houses, 0), ground)]
    for x, y in np.ndindex(houses, houses):
        low = np.array([x, y]) + rng.integers(-80, 80, 2) / 1024.0 - 0.25
        w, d, h = np.append(rng.integers(400, 620, 2), rng.integers(400, 2600)) / 1024.0
        a, b = np.array([*low, 0.0]), np.array([*(low + np.array([w, d])), h])
        for corner, along, up in (
            (a, (w, 0, 0), (0, 0, h)), ((b[0], a[1], 0.0), (0, d, 0), (0, 0, h)),
            ((b[0], b[1], 0.0), (-w, 0, 0), (0, 0, h)), ((a[0], b[1], 0.0), (0, -d, 0), (0, 0, h)),
            ((a[0], a[1], h), (w, 0, 0), (0, d, 0)),
        ):  # fmt: skip
            pieces.append(_plate(corner, along, up, 4))
    return Mesh.concatenate(pieces)


def _plate(corner: object, along: object, up: object, cells: int) -> Mesh:
    """A rectangle cut into cells^2 cells, seen from where its sides turn to the left."""
    j, i = (grid.ravel()[:, None] for grid in np.meshgrid(*[np.arange(cells + 1) / cells] * 2, indexing="ij"))
    points = np.asarray(corner, np.float64) + i * np.asarray(along, np.float64) + j * np.asarray(up, np.float64)
    return Mesh(np.round(points * 2.0**14) / 2.0**14, lattice_faces(cells + 1, cells + 1))


def terrain(cells: int = 48) -> Mesh:
    """Hills over a square of side 1, z up, all corners at whole multiples of 2^-14."""
    s, t = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1))
    height = 0.1 * np.sin(9.0 * s + 2.0 * t) * np.cos(7.0 * t) + 0.04 * np.sin(31.0 * s) * np.sin(27.0 * t + s)
    points = np.stack([s, t, height], axis=-1).reshape(-1, 3)
    return Mesh(np.round(points * 2.0**14) / 2.0**14, lattice_faces(cells + 1, cells + 1))


def soup(faces: int = 1500) -> Mesh:
    """Loose triangles of all sizes, which cross each other."""
    rng = np.random.default_rng(_SEED + 1)
    size = 0.3 * rng.random((faces, 1, 1)) ** 3 + 0.01
    return loose(rng.random((faces, 1, 3)) + rng.normal(size=(faces, 3, 3)) * size)


def slivers(faces: int = 400) -> Mesh:
    """Long triangles a thousandth as wide, on top of each other at distances of a ten thousandth."""
    rng = np.random.default_rng(_SEED + 2)
    start, way = rng.random((faces, 3)), rng.normal(size=(faces, 3))
    across = 1e-3 * np.cross(way, rng.normal(size=(faces, 3)))
    pairs = np.repeat(np.stack([start, start + way, start + way / 2.0 + across], axis=1), 2, axis=0)
    pairs[1::2] += 1e-4
    return loose(pairs)


def bodies() -> dict[str, Mesh]:
    """The meshes on which every bit is judged."""
    balls = [
        icosphere(3).vertices * r + c for r, c in ((1.0, (0, 0, 0)), (0.5, (1.2, 0.3, 0.9)), (0.7, (-1, 1.1, 0.2)))
    ]
    return {
        "town": town(),
        "terrain": terrain(),
        "balls": Mesh.concatenate([Mesh(ball, icosphere(3).faces) for ball in balls]),
        "loose triangles": soup(),
        "slivers": slivers(),
    }


def touching() -> Mesh:
    """Four houses of equal height wall to wall: their walls lie on each other, and their roofs are one plane."""
    return Mesh.concatenate([box((x, y, 0.0), (x + 1.0, y + 1.0, 2.0)) for x in (0.0, 1.0) for y in (0.0, 1.0)])
