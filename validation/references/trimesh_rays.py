"""trimesh's own ray caster as a reference for hits: NumPy in float64 over an R-tree. The package rtree is required.

It has its own tolerances: a hit may lie 1e-6 behind the origin and 1e-8 beside its face. A ray takes about 0.1 ms.
"""

from importlib import metadata
from typing import Any

import numpy as np
import rtree  # noqa: F401  # trimesh imports it late; a missing package must fail here
import trimesh
from numpy.typing import ArrayLike, NDArray
from trimesh.ray import ray_triangle


def version() -> str:
    """Version of the installed ``trimesh`` package."""
    return metadata.version("trimesh")


class TrimeshRays:
    """trimesh's intersector of one triangle mesh: ``vertices`` (V, 3), ``faces`` (F, 3); copied.

    >>> caster = TrimeshRays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> caster.closest_hit([[0.25, 0.25, 1], [2, 2, 1]], [[0, 0, -2], [0, 0, -2]])
    (array([0.5, inf]), array([ 0, -1]))
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
        triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
        self._faces = len(triangles)
        mesh = trimesh.Trimesh(points, triangles, process=False, validate=False)
        untyped: Any = ray_triangle
        self._caster = untyped.RayMeshIntersector(mesh)
        if self._faces:
            mesh.triangles_tree  # noqa: B018  # trimesh builds it on first use; built here, it slows no query

    def closest_hit(self, origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Closest hits of ``origins``, ``directions`` (n, 3): (t, face), t in units of |direction|.

        ``t`` is float64, taken from trimesh's hit point, inf on a miss; ``face`` is int64, -1 on a miss.
        """
        o = np.asarray(origins, dtype=np.float64).reshape(-1, 3)
        d = np.asarray(directions, dtype=np.float64).reshape(-1, 3)
        t, face = np.full(len(o), np.inf), np.full(len(o), -1, dtype=np.int64)
        if not self._faces or not len(o):
            return t, face
        named, row, points = self._caster.intersects_id(o, d, multiple_hits=False, return_locations=True)
        face[row] = named
        # Without any hit trimesh returns an empty array of another dimension.
        t[row] = ((np.reshape(points, (-1, 3)) - o[row]) * d[row]).sum(axis=1) / (d[row] ** 2).sum(axis=1)
        return t, face
