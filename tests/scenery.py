"""A mesh of which studies can tell something: a ball over a plate, z up."""

import numpy as np

from renderer import Mesh
from renderer.mesh.shapes import box, icosphere


def scenery() -> Mesh:
    """12 faces of the plate, 20 of the ball, and one without an area, whose vertex has no other face."""
    plate, ball = box((-2, -2, -1), (2, 2, 0)), icosphere(0)
    vertices = np.concatenate([plate.vertices, 0.6 * ball.vertices + [0.1, 0.2, 0.9], [[0.5, 0.5, 3.0]]])
    faces = np.concatenate([plate.faces, ball.faces + len(plate.vertices), [[20, 20, 20]]])
    return Mesh(vertices, faces.astype(np.int32))
