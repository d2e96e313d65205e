"""Embree, through ``embreex``, as a reference for hits. The only file that imports it.

Embree works in float32: this adapter rounds vertices, origins and directions to float32, whatever their type. Compare
it only on numbers that float32 holds exactly, else it judges another scene. ``robust=False`` leaks at edges. Embree
drops faces with NaN, infinite or out-of-range corners silently, and at equal t its face is arbitrary.
"""

from importlib import metadata

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import ArrayLike, NDArray


def version() -> str:
    """Version of the installed ``embreex`` package."""
    return metadata.version("embreex")


class Embree:
    """An Embree scene of one triangle mesh: ``vertices`` (V, 3), ``faces`` (F, 3); copied, rounded to float32.

    >>> embree = Embree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> embree.closest_hit([[0.25, 0.25, 1], [2, 2, 1]], [[0, 0, -2], [0, 0, -2]])
    (array([0.5, inf]), array([ 0, -1]))
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, robust: bool = True) -> None:
        self._scene = EmbreeScene(robust=robust)
        points, triangles = _float32(vertices), np.ascontiguousarray(faces, dtype=np.int32).reshape(-1, 3)
        self._faces = len(triangles)
        if self._faces:
            TriangleMesh(self._scene, points, triangles)

    def closest_hit(self, origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Closest hits of ``origins``, ``directions`` (n, 3): (t, face), t in units of |direction|.

        ``t`` is Embree's float32 stored as float64, inf on a miss; ``face`` is int64, -1 on a miss.
        """
        o, d = _float32(origins), _float32(directions)
        if not self._faces or not len(o):
            return np.full(len(o), np.inf), np.full(len(o), -1, dtype=np.int64)
        found = self._scene.run(o, d, query="INTERSECT", output=True)
        face = found["primID"].astype(np.int64)
        # Embree leaves its start value 1e37 in t where nothing is hit; the face distinguishes hits from misses.
        return np.where(face >= 0, found["tfar"].astype(np.float64), np.inf), face

    def any_hit(self, origins: ArrayLike, directions: ArrayLike) -> NDArray[np.bool_]:
        """Whether each ray hits anything at t >= 0; bool (n,)."""
        o, d = _float32(origins), _float32(directions)
        if not self._faces or not len(o):
            return np.zeros(len(o), dtype=np.bool_)
        occluded: NDArray[np.bool_] = self._scene.run(o, d, query="OCCLUDED") >= 0
        return occluded


def _float32(values: ArrayLike) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype=np.float32).reshape(-1, 3)
