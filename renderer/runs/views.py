"""A camera that sees all of a mesh that stands on the ground, z up."""

import math

import numpy as np

from renderer.mesh.mesh import Mesh
from renderer.scene.camera import PerspectiveCamera

# From the south-west, and so far up that streets are seen between houses.
_TOWARDS_EYE, _FOV, _MARGIN = (-0.55, -0.75, 0.75), 40.0, 1.02


def from_above(mesh: Mesh, resolution: tuple[int, int]) -> PerspectiveCamera:
    """The camera from which the ball around the mesh fills the smaller side of the picture."""
    lower, upper = mesh.bounds
    radius = float(np.linalg.norm(mesh.extent)) / 2.0 or 1.0
    target = (lower + upper) / 2.0
    half = math.tan(math.radians(_FOV) / 2.0) * min(1.0, resolution[0] / resolution[1])
    towards = np.array(_TOWARDS_EYE) / np.linalg.norm(_TOWARDS_EYE)
    eye = target + towards * (_MARGIN * radius / math.sin(math.atan(half)))
    return PerspectiveCamera(eye=tuple(eye), target=tuple(target), up=(0.0, 0.0, 1.0), fov=_FOV)
