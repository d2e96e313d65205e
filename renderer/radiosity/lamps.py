"""Direct light on faces: what lights of a scene send them, shadows included."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.queryable import Queries
from renderer.scene.light import DirectionalLight, Light
from renderer.scene.vectors import unit
from renderer.shade.lights import SHORT_OF_LIGHT
from renderer.system.terminal import progress_bar

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# The barycentrics of the points of a face: the middles of the four parts that its midlines cut. Shadows have five
# steps, which is finer than the step between patches.
POINTS = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0], [2.0, 2.0, 2.0]]) / 6.0
# Faces that are computed together: their rays take some 30 MB.
_TOGETHER = 1 << 16


def direct_light(octree: Queries, lights: Sequence[Light], faces: Ints, *, progress: bool = False) -> Floats:
    """The light that arrives at ``faces`` (n,) on their front sides, (n, 3), the mean over four points of each.

    In the unit of ``DirectionalLight.irradiance``: a white surface that faces a light of irradiance 1 has radiance 1.
    """
    found = np.zeros((len(faces), 3))
    normals, corners = octree.mesh.face_normals()[faces], octree.mesh.triangles[faces]
    starts = range(0, len(faces), _TOGETHER)
    with progress_bar(len(lights) * len(starts), "part", progress) as update:
        for light in lights:
            for start in starts:
                some = slice(start, start + _TOGETHER)
                found[some] += _light_of(octree, light, faces[some], normals[some], corners[some])
                if update is not None:
                    update(1)
    return found


def _light_of(octree: Queries, light: Light, faces: Ints, normals: Floats, corners: Floats) -> Floats:
    """The light of one light at faces with these unit normals (n, 3) and corners (n, 3, 3), (n, 3)."""
    points = np.einsum("pk,nkc->npc", POINTS, corners)
    falloff: Floats | float = 1.0
    if isinstance(light, DirectionalLight):
        towards: Floats = np.broadcast_to(-unit(light.direction), points.shape)
        farthest, color = np.inf, light.irradiance
    else:
        towards = np.array(light.position) - points
        falloff, farthest, color = _falloff(towards), SHORT_OF_LIGHT, light.intensity
    cosines = np.einsum("npc,nc->np", towards, normals) * falloff
    row, point = np.nonzero(cosines > 0.0)
    hidden = octree.any_hit(points[row, point], towards[row, point], t_max=farthest, leaving=faces[row], side=1)
    # rule: patch-shadows
    seen = np.bincount(row, np.where(hidden, 0.0, cosines[row, point]), len(faces)) / len(POINTS)
    return seen[:, None] * np.array(color)


def _falloff(towards: Floats) -> Floats:
    """The factor from the dot product of a normal and the way to a point light to light: 1 / r^3; 0 at the light."""
    squares = np.einsum("npc,npc->np", towards, towards)
    # rule: patch-inverse-square
    return np.divide(1.0, squares * np.sqrt(squares), out=np.zeros_like(squares), where=squares > 0.0)
