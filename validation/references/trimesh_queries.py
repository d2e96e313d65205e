"""trimesh's queries of points and all hits, its rays traced by embreex: what most users of Python ask today."""

from typing import Any

import numpy as np
import rtree  # noqa: F401  # trimesh imports it late; a missing package must fail here
import trimesh
from numpy.typing import ArrayLike, NDArray


class TrimeshQueries:
    """A trimesh of one triangle mesh: ``vertices`` (V, 3), ``faces`` (F, 3); copied.

    >>> corners, faces = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    >>> TrimeshQueries(corners, faces).distance([[1.0, 1.0, -2.0]])
    array([2.])
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
        triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
        self._mesh: Any = trimesh.Trimesh(points, triangles, process=False, validate=False)
        if "pyembree" not in type(self._mesh.ray).__module__:
            raise ImportError("trimesh found no embreex, which its users' rays are traced by")

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point (n, 3) lies inside, (n,)."""
        return np.asarray(self._mesh.ray.contains_points(np.asarray(points, np.float64)), np.bool_)

    def count_hits(self, origins: ArrayLike, directions: ArrayLike) -> NDArray[np.int64]:
        """The number of places where each ray passes the surface, (n,)."""
        o = np.asarray(origins, np.float64)
        _, rays, _ = self._mesh.ray.intersects_location(o, np.asarray(directions, np.float64), multiple_hits=True)
        return np.bincount(np.asarray(rays, np.int64), minlength=len(o))

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """The distance of each point (n, 3) from the surface, (n,)."""
        with np.errstate(all="ignore"):  # its squares of large coordinates
            untyped: Any = trimesh.proximity
            _, distance, _ = untyped.closest_point(self._mesh, np.asarray(points, np.float64))
        return np.asarray(distance, np.float64)
