"""Open3D's queries of points and all hits: Embree's rays in float32, on all threads. Open3D need not be installed."""

from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import ArrayLike, NDArray


class Open3dQueries:
    """A scene of one triangle mesh: ``vertices`` (V, 3), ``faces`` (F, 3); copied as float32.

    >>> corners, faces = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    >>> Open3dQueries(corners, faces).distance([[1.0, 1.0, -2.0]])
    array([2.])
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        self._scene = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(_tensor(vertices), o3d.core.Tensor(np.asarray(faces).astype(np.uint32)))

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point (n, 3) lies inside, (n,): the parity of the hits of one ray."""
        return np.asarray(self._scene.compute_occupancy(_tensor(points), nsamples=1).numpy() > 0.5, np.bool_)

    def count_hits(self, origins: ArrayLike, directions: ArrayLike) -> NDArray[np.int64]:
        """The number of faces that each ray hits, (n,)."""
        rays = np.hstack([np.asarray(origins), np.asarray(directions)])
        return np.asarray(self._scene.count_intersections(_tensor(rays)).numpy(), np.int64)

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """The distance of each point (n, 3) from the surface, (n,)."""
        return np.asarray(self._scene.compute_distance(_tensor(points)).numpy(), np.float64)


def _tensor(rows: ArrayLike) -> Any:
    with np.errstate(over="ignore", under="ignore"):  # what float32 cannot hold becomes inf or 0 there
        return o3d.core.Tensor(np.ascontiguousarray(rows, np.float32))
