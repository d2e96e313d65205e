"""A scene for a mesh alone: a camera that sees all of it, a light, and a floor under it."""

import json
import math
from collections.abc import Iterable

import numpy as np

from renderer.arguments.up import UP_AXES, turn_to
from renderer.mesh.mesh import Mesh

# The ball around the mesh, seen from a little above and to the right, fills the picture's height less a tenth.
_TOWARDS_EYE, _FOV, _MARGIN = (0.5, 0.4, 1.0), 40.0, 1.1
# Half the side of the floor, in radii, and the number of its squares along a side.
_FLOOR, _SQUARES = 4.0, 16


def showcase_text(mesh: Mesh, path: str, up: str) -> str:
    """The scene file, as TOML, that shows ``mesh``; ``path`` is that of its file, as the scene file names it.

    The mesh is moved so that it stands in the middle of the floor; ``up`` is the axis that points up. It is smooth
    where its file has normals.
    """
    lower, upper = mesh.bounds
    radius = float(np.linalg.norm(mesh.extent)) / 2.0 or 1.0
    axis, turn, target = UP_AXES[up], turn_to(up), np.zeros(3)
    target[axis] = float(mesh.extent[axis]) / 2.0
    moved = -(lower + upper) / 2.0
    moved[axis] = -lower[axis]
    towards = turn @ _TOWARDS_EYE / np.linalg.norm(_TOWARDS_EYE)
    eye = target + towards * (_MARGIN * radius / math.sin(math.radians(_FOV) / 2.0))
    half = _FLOOR * radius
    quoted = json.dumps(path).replace("\x7f", "\\u007f")  # as TOML has it
    return f"""# Made for {quoted}: change what you like.

up = "{up}"

[camera]
eye = {_list(eye)}
target = {_list(target)}
fov = {_FOV}

[[objects]]
mesh = {quoted}
material = "model"
normals = "{"flat" if mesh.normals is None else "smooth"}"
translate = {_list(moved)}

[floor]
min = {_list((-half, -half))}
max = {_list((half, half))}
squares = [{_SQUARES}, {_SQUARES}]
materials = ["light", "dark"]

[materials.model]
diffuse = [0.72, 0.68, 0.62]
specular = 0.15
shininess = 40.0

[materials.light]
diffuse = 0.75

[materials.dark]
diffuse = 0.6

[[lights]]
type = "directional"
direction = {_list(turn @ (-0.6, -1.0, -0.5))}
irradiance = 0.75

[[lights]]
type = "directional"
direction = {_list(turn @ (1.0, -0.6, -0.8))}
irradiance = 0.25
"""


def _list(values: Iterable[float]) -> str:
    # A zero without its sign.
    return repr([float(value) + 0.0 for value in values])
