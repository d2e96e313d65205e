"""Open3D's ``RaycastingScene`` as a contender: Embree on all threads. The only file that imports open3d."""

from typing import Any

import numpy as np
import open3d as o3d

from renderer.process.parallel import available_threads
from validation.benchmark.peers.contender import Faces, Family, Floats, Query, System


class Open3DPeer:
    """A scene of one mesh; its first query builds it."""

    def __init__(self, vertices: Any, faces: Any) -> None:
        self._scene = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(vertices, faces)
        self._ray = o3d.core.Tensor(np.array([[0, 0, 0, 0, 0, 1]], np.float32))

    def closest(self, rays: Family) -> Query:
        """t, u, v, normal and face of each ray; Open3D has no smaller query."""
        tensor = _native(rays)
        return Query(lambda: self._scene.cast_rays(tensor), lambda found: found["t_hit"].numpy().astype(np.float64))

    def any(self, rays: Family) -> Query:
        """Open3D's occlusion test."""
        tensor, far = _native(rays), float(rays.t_max)
        return Query(lambda: self._scene.test_occlusions(tensor, tfar=far), lambda found: found.numpy())

    def touch(self) -> None:
        """Trace one ray."""
        self._scene.test_occlusions(self._ray)


def systems() -> list[System]:
    """The one contender of Open3D, on all threads."""
    return [System("open3d", "Open3D", available_threads(), "float32", _builder)]


def _builder(vertices: Floats, faces: Faces) -> Any:
    points = o3d.core.Tensor(vertices.astype(np.float32))
    triangles = o3d.core.Tensor(faces.astype(np.uint32))
    return lambda: Open3DPeer(points, triangles)


def _native(rays: Family) -> Any:
    return o3d.core.Tensor(np.hstack([rays.origins, rays.directions]).astype(np.float32))
