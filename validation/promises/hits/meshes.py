"""Meshes whose arrays someone may write to: a tree keeps what it was built from."""

from typing import Any

import numpy as np

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.promises.row import row

_CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (5.0, 5.0, 5.0)]


def check_meshes() -> list[dict[str, Any]]:
    """Meshes whose vertices, faces or both were made writable before the build, and are changed after it."""
    kept = []
    for tracer in (Octree, BruteForce):
        for names in (("vertices",), ("faces",), ("vertices", "faces")):
            mesh = Mesh(_CORNERS, [[0, 1, 2]])
            for name in names:
                getattr(mesh, name).flags.writeable = True
            built = tracer.from_mesh(mesh)
            if "vertices" in names:
                mesh.vertices[:3, 2] = 5.0
            if "faces" in names:
                mesh.faces[0, 2] = 3
            found = built.closest_hit([0.125, 0.25, 1.0], [0.0, 0.0, -1.0])
            kept += [found.points.tolist() == [0.125, 0.25, 0.0], found.normals.tolist() == [0.0, 0.0, 1.0]]
    return [row("a tree does not change with arrays that were made writable", "a face by hand", np.array(kept))]
