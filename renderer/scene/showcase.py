"""A scene for meshes alone: a camera that sees all of them, a sky, and a floor that has no end."""

import json
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.up import UP_AXES, turn_to
from renderer.mesh.mesh import Mesh
from renderer.scene.sky import Sky
from renderer.scene.vectors import unit

# The ball around the mesh, seen from a little above and to the right, fills the picture's height less a tenth.
_TOWARDS_EYE, _FOV, _MARGIN = (0.5, 0.4, 1.0), 40.0, 1.1
_GAP = 2.0**-10
# Half the side of the floor, in radii.
_FLOOR = 6.0
_MODEL, _FLOOR_GREY = (0.62, 0.56, 0.48), 0.75
# Of the sky: radiance straight up; of the sun: the way of its light with y up, and its irradiance.
_ZENITH, _SUN, _SUN_IRRADIANCE = (0.34, 0.39, 0.47), (-0.7, -1.0, -0.45), 0.65
# Edges whose faces part by more are sharp: chamfers of 45 degrees are, and few edges of scans, whose sharp ones show as
# teeth.
_CREASE = 40.0


def _studio(up: str) -> Sky:
    """A sky whose horizon has the radiance of the floor where nothing hides the sky, so that no edge of it shows.

    That radiance is linear in that of the horizon, as the sky lights the floor.
    """
    sun = turn_to(up) @ _SUN
    skies = [Sky(zenith=_ZENITH, horizon=h, sun=sun, sun_irradiance=_SUN_IRRADIANCE) for h in (0.0, 1.0)]
    dark, light = (_FLOOR_GREY * _irradiance(sky, up) for sky in skies)
    return skies[0].model_copy(update={"horizon": tuple((dark / (1.0 - (light - dark))).round(6).tolist())})


def _irradiance(sky: Sky, up: str) -> NDArray[np.float64]:
    """The light of a sky on level ground: red, green and blue."""
    lights = sky.directional(up)
    ways = np.array([unit(light.direction) for light in lights])
    return -ways[:, UP_AXES[up]] @ np.array([light.irradiance for light in lights])


def showcase_text(meshes: Sequence[Mesh], paths: Sequence[str], up: str) -> str:
    """The scene file, as TOML, that shows ``meshes``; ``paths`` are those of their files, as the scene file names them.

    Together they are moved to stand in the middle of the floor; ``up`` is the axis that points up.
    """
    bounds = np.array([mesh.bounds for mesh in meshes])
    lower, upper = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    extent = upper - lower
    radius = float(np.linalg.norm(extent)) / 2.0 or 1.0
    axis, turn, target = UP_AXES[up], turn_to(up), np.zeros(3)
    target[axis] = float(extent[axis]) / 2.0
    moved = -(lower + upper) / 2.0
    # Above the floor by so little that it does not show, so that parts that lie flat there do.
    moved[axis] = _GAP * radius - lower[axis]
    towards = turn @ _TOWARDS_EYE / np.linalg.norm(_TOWARDS_EYE)
    eye = target + towards * (_MARGIN * radius / math.sin(math.radians(_FOV) / 2.0))
    half, sky = _FLOOR * radius, _studio(up)
    quoted = [json.dumps(path).replace("\x7f", "\\u007f") for path in paths]  # as TOML has it
    return f"""# Made for {", ".join(quoted)}: change what you like.

up = "{up}"
ambient = 0.15

[camera]
eye = {_list(eye)}
target = {_list(target)}
fov = {_FOV}

[render]
samples = 4
glass_shadows = "clear"
terminator = "soft"

{"".join(_object(path, moved, _has_looks(mesh)) for path, mesh in zip(quoted, meshes, strict=True))}[floor]
min = {_list((-half, -half))}
max = {_list((half, half))}
materials = ["floor"]

[materials.model]
diffuse = {_list(_MODEL)}
specular = 0.05
shininess = 30.0

[materials.floor]
diffuse = {_FLOOR_GREY}
ambient = 0.0

# The horizon is as bright as the floor, so that no edge shows between them.
[sky]
zenith = {_list(sky.zenith)}
horizon = {_list(sky.horizon)}
sun = {_list(turn_to(up) @ _SUN)}
sun_irradiance = {_SUN_IRRADIANCE}
"""


def _has_looks(mesh: Mesh) -> bool:
    """Whether a mesh brings colours or materials, with which it is shown."""
    return mesh.colors is not None or bool(mesh.materials)


def _object(path: str, moved: Iterable[float], has_looks: bool) -> str:
    material = "" if has_looks else 'material = "model"\n'
    return f"""[[objects]]
mesh = {path}
{material}normals = "smooth"
crease = {_CREASE}
translate = {_list(moved)}

"""


def _list(values: Iterable[float]) -> str:
    # A zero without its sign.
    return repr([float(value) + 0.0 for value in values])
