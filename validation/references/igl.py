"""libigl's ``AABB`` as a reference for hits. The only file that imports ``igl``.

It takes float64 vertices and rays, but returns t as float32: hit or miss and the face compare in float64, t to 2**-24.
"""

from importlib import metadata

import igl
import numpy as np
from numpy.typing import ArrayLike, NDArray


def version() -> str:
    """Version of the installed ``libigl`` package."""
    return metadata.version("libigl")


class Igl:
    """A libigl tree over one triangle mesh: ``vertices`` (V, 3), ``faces`` (F, 3); copied.

    >>> tree = Igl([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> tree.closest_hit([[0.25, 0.25, 1], [2, 2, 1]], [[0, 0, -2], [0, 0, -2]])
    (array([0.5, inf]), array([ 0, -1]))
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        self._vertices = np.array(vertices, dtype=np.float64, order="C").reshape(-1, 3)
        self._faces = np.array(faces, dtype=np.int64, order="C").reshape(-1, 3)
        self._tree = igl.AABB()
        if len(self._faces):
            self._tree.init(self._vertices, self._faces)

    def closest_hit(self, origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Closest hits of ``origins``, ``directions`` (n, 3): (t, face), t in units of |direction|.

        ``t`` is libigl's float32 stored as float64, inf on a miss; ``face`` is int64, -1 on a miss.
        """
        o = np.ascontiguousarray(origins, dtype=np.float64).reshape(-1, 3)
        d = np.ascontiguousarray(directions, dtype=np.float64).reshape(-1, 3)
        if not len(self._faces) or not len(o):
            return np.full(len(o), np.inf), np.full(len(o), -1, dtype=np.int64)
        face, t, _ = self._tree.intersect_ray_first(self._vertices, self._faces, o, d)
        face = np.asarray(face, dtype=np.int64).reshape(-1)
        return np.where(face >= 0, np.asarray(t, dtype=np.float64).reshape(-1), np.inf), face

    def winding_number(self, points: ArrayLike) -> NDArray[np.float64]:
        """Generalised winding numbers (n,) around ``points`` (n, 3), by libigl's hierarchy without approximation."""
        p = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
        return np.asarray(igl.winding_number(self._vertices, self._faces, p), np.float64).reshape(-1)

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether the winding number around each point (n, 3) is above 1/2, (n,)."""
        return np.asarray(self.winding_number(points) > 0.5, np.bool_)

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Distances (n,) of ``points`` (n, 3) from the surface."""
        p = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
        squares, _, _ = self._tree.squared_distance(self._vertices, self._faces, p)
        return np.sqrt(np.asarray(squares, np.float64).reshape(-1))
