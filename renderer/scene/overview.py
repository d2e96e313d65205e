"""A camera that sees all of a mesh that stands on the ground."""

import math

import numpy as np

from renderer.arguments.up import turn_to, up_axis
from renderer.mesh.mesh import Mesh
from renderer.scene.camera import PerspectiveCamera

# From the south-west, and so far up that streets are seen between houses.
_TOWARDS_EYE, _FOV, _MARGIN = (-0.55, -0.75, 0.75), 40.0, 1.02


def from_above(mesh: Mesh, resolution: tuple[int, int], up: str = "z") -> PerspectiveCamera:
    """The camera so near that all vertices just fit into the picture; ``up`` is the axis that points up."""
    vertical, turn = np.eye(3)[up_axis(up)], turn_to(up) @ turn_to("z").T
    towards = turn @ _TOWARDS_EYE / np.linalg.norm(_TOWARDS_EYE)
    right = np.cross(vertical, towards)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    middle = (mesh.bounds[0] + mesh.bounds[1]) / 2.0
    x, y, z = axes @ (mesh.vertices - middle).T
    # A vertex is in the picture where |x - ex| <= wide * (ez - z), and so in y: each of the four sides bounds the eye.
    tall = math.tan(math.radians(_FOV) / 2.0) / _MARGIN
    wide = tall * resolution[0] / resolution[1]
    east, west = (float((side + wide * z).max()) for side in (x, -x))
    north, south = (float((side + tall * z).max()) for side in (y, -y))
    far = max((east + west) / (2.0 * wide), (north + south) / (2.0 * tall)) or 1.0
    eye = middle + np.array([(east - west) / 2.0, (north - south) / 2.0, far]) @ axes
    return PerspectiveCamera(eye=tuple(eye), target=tuple(eye - far * towards), up=vertical, fov=_FOV)
