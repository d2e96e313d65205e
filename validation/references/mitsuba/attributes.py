"""Mitsuba's vertex attributes at hits as a reference for ours: colours and texture coordinates, in float32.

It has those of meshes alone: at hits on instances it takes the place in the world for one in the mesh's frame.
"""

from typing import NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

import validation.references.mitsuba.scene as mitsuba_scene  # selects the variant

Floats = NDArray[np.float64]


class Attributes(NamedTuple):
    """At the closest hits of n rays: t (n,), inf on a miss, and colours (n, 3) and texture coordinates (n, 2)."""

    t: Floats
    colors: Floats
    texcoords: Floats


def attributes(
    vertices: Floats, faces: NDArray[np.int64], colors: Floats, texcoords: Floats, origins: Floats, directions: Floats
) -> Attributes:
    """The attributes of a mesh whose vertices have these colours and texture coordinates."""
    mesh = mi.Mesh("mesh", len(vertices), len(faces), has_vertex_texcoords=True)
    mi.traverse(mesh)["vertex_texcoords"] = texcoords.astype(np.float32).ravel()
    mitsuba_scene.fill(mesh, vertices, faces)
    mesh.add_attribute("vertex_color", 3, colors.astype(np.float32).ravel())
    scene = mitsuba_scene.assemble({mesh: 0}, [])
    found = Attributes(np.full(len(origins), np.inf), np.zeros((len(origins), 3)), np.zeros((len(origins), 2)))
    for row, ray in enumerate(mitsuba_scene.mitsuba_rays((origins, directions))):
        si = scene.ray_intersect(ray)
        if si.is_valid():
            found.t[row] = si.t
            found.colors[row] = np.array(si.shape.eval_attribute_3("vertex_color", si))
            found.texcoords[row] = np.array(si.uv)
    return found
