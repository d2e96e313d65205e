"""Meshes that several sections judge: loose triangles, squares, and bodies with edges and corners of all kinds."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, lattice_faces

Floats = NDArray[np.float64]

# The direction in which meshes are moved: its three coordinates differ.
AWAY = np.array([1.0, -0.75, 0.375])
# An orthogonal matrix with no structure; its rounding moves vertices, but neighbours still share them.
TURN = np.linalg.qr(np.array([[2.0, 3.0, 1.0], [-1.0, 2.0, 5.0], [4.0, -1.0, 1.0]]))[0]


def loose(corners: ArrayLike) -> Mesh:
    """Triangles (F, 3 corners, 3) that share no vertices, even where corners are equal."""
    points = np.asarray(corners, dtype=np.float64).reshape(-1, 3)
    return Mesh(points, np.arange(len(points), dtype=np.int32).reshape(-1, 3))


def squares(corners: Floats) -> Mesh:
    """Squares (k, 4 corners, 3), counter-clockwise seen from outside; square i has the faces 2 i and 2 i + 1."""
    faces = np.arange(4 * len(corners), dtype=np.int32).reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]]
    return Mesh(corners.reshape(-1, 3), faces.reshape(-1, 3))


def turned(mesh: Mesh) -> Mesh:
    """The mesh turned about the origin: four corners of a square are then in no common plane."""
    return Mesh(mesh.vertices @ TURN.T, mesh.faces)


def tetrahedron() -> Mesh:
    """One without two equal angles."""
    corners = np.array([[0.1, 0.2, 0.3], [1.3, 0.1, 0.2], [0.4, 1.7, 0.1], [0.3, 0.4, 1.1]])
    return Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32))


def prism(degrees: float) -> Mesh:
    """A prism over an arc and its centre, so that its edge along z has the angle; above 180 degrees it is a notch."""
    parts = max(1, math.ceil(degrees / 75.0))
    angles = np.radians(degrees) * np.arange(parts + 1) / parts
    rim = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    outline = np.concatenate([[[0.0, 0.0]], rim])
    count = len(outline)
    low = np.concatenate([outline, np.zeros((count, 1))], axis=1)
    faces = []
    for k in range(count):
        other = (k + 1) % count
        faces += [[k, other, count + other], [k, count + other, count + k]]
    for k in range(1, count - 1):
        faces += [[0, k + 1, k], [count, count + k, count + k + 1]]
    return Mesh(np.concatenate([low, low + np.array([0.0, 0.0, 1.0])]), np.array(faces, np.int32))


def hilly(level: int) -> Mesh:
    """A sphere whose vertices are moved along their radius by up to 0.3: not convex, but star-shaped about its centre.

    ``level`` is that of ``icosphere``. Its corners have edges of both kinds.
    """
    ball = icosphere(level)
    x, y, z = 6.0 * ball.vertices.T
    factors = 1.0 + 0.3 * np.sin(x) * np.sin(y + 1.0) * np.sin(z + 2.0)
    return Mesh(ball.vertices * factors[:, None], ball.faces)


def integer_box(size: int = 8) -> Mesh:
    """The box [0, size]^3 of unit squares, two faces each; neighbours share vertices, every number is an integer."""
    row, column = np.divmod(np.arange((size + 1) ** 2), size + 1)
    lattice = lattice_faces(size + 1, size + 1)
    corners = []
    for axis in range(3):
        for side in ((column, row, np.full(row.shape, size)), (row, column, np.zeros(row.shape, int))):
            corners.append(np.roll(side, axis, axis=0).T[lattice])
    vertices, index = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    return Mesh(vertices.astype(np.float64), index.reshape(-1, 3).astype(np.int32), name="integer box")


def mirror_bodies() -> dict[str, Mesh]:
    """Convex bodies, to be seen from inside as mirrors."""
    return {
        "tetrahedron": tetrahedron(),
        "prism of 60 degrees": prism(60.0),
        "cube": box(),
        "turned box": turned(box((0, 0, 0), (1.0, 1.5, 0.75))),
    }
