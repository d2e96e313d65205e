"""Meshes that stand at matrices, with the corners that float64 gives them: what the hits of a scene are judged on."""

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from validation.oracle.vectors import volume

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Body(NamedTuple):
    """A mesh, ``vertices`` (V, 3) and ``faces`` (F, 3), that stands at each of ``matrices`` (k, 3, 4)."""

    vertices: Floats
    faces: Ints
    matrices: Floats


def mirrors(matrix: Floats) -> bool:
    """Whether the linear part of a matrix (3, 4) has a determinant below 0, exactly."""
    return volume([[Fraction(x) for x in row[:3]] for row in matrix.tolist()]) < 0


def placed(bodies: list[Body]) -> tuple[Floats, Ints]:
    """The vertices and faces of all bodies together, in the order of bodies, matrices and faces.

    A coordinate is ((x a + y b) + z c) + d: three products and three sums, each rounded by itself. A matrix that
    mirrors exchanges the second and third corner of each face, so that faces look the same way as before.
    """
    vertices: list[Floats] = [np.zeros((0, 3))]
    faces: list[Ints] = [np.zeros((0, 3), np.int64)]
    count = 0
    for body in bodies:
        x, y, z = np.asarray(body.vertices, np.float64).T
        for matrix in body.matrices:
            order = [0, 2, 1] if mirrors(matrix) else [0, 1, 2]
            vertices.append(np.stack([((x * a + y * b) + z * c) + d for a, b, c, d in matrix], axis=1))
            faces.append(np.asarray(body.faces, np.int64)[:, order] + count)
            count += len(x)
    return np.concatenate(vertices), np.concatenate(faces)
