"""Open3D's ``RaycastingScene`` as a contender: Embree on all threads."""

from collections.abc import Callable
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from renderer.system.threads import available_threads
from validation.benchmark.peers.contender import Faces, Family, Floats, HitLists, Peer, Points, Query, System


class Open3DPeer(Peer):
    """A scene of one mesh; its first query builds it."""

    def __init__(self, vertices: Any, faces: Any) -> None:
        self._scene = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(vertices, faces)
        self._ray = o3d.core.Tensor(np.array([[0, 0, 0, 0, 0, 1]], np.float32))

    def closest(self, rays: Family) -> Query | None:
        """t, u, v, normal and face of each ray, it has no smaller query; None where it would look behind an end."""
        if rays.beyond:
            return None
        tensor = _native(rays)
        return Query(lambda: self._scene.cast_rays(tensor), lambda found: found["t_hit"].numpy().astype(np.float64))

    def any(self, rays: Family) -> Query:
        """Open3D's occlusion test."""
        tensor, far = _native(rays), float(rays.t_max)
        return Query(lambda: self._scene.test_occlusions(tensor, tfar=far), lambda found: found.numpy())

    def all(self, rays: Family) -> Query | None:
        """t, u, v, ray and face of all hits; None for rays with an end, which Open3D has no argument for."""
        if np.isfinite(rays.t_max):
            return None
        tensor = _native(rays)

        def read(found: Any) -> HitLists:
            ray, t, face = (found[name].numpy() for name in ("ray_ids", "t_hit", "primitive_ids"))
            return HitLists.sorted(len(rays), ray, t, face)

        return Query(lambda: self._scene.list_intersections(tensor), read)

    def count(self, rays: Family) -> Query | None:
        """The number of hits; None for rays with an end."""
        if np.isfinite(rays.t_max):
            return None
        tensor = _native(rays)
        return Query(lambda: self._scene.count_intersections(tensor), lambda n: n.numpy().astype(np.int64))

    def contains(self, points: Points) -> Query:
        """Open3D's occupancy: the parity of the hits of one ray a point."""
        tensor = _tensor(points.points)
        return Query(lambda: self._scene.compute_occupancy(tensor, nsamples=1), lambda found: found.numpy() > 0.5)

    def nearest(self, points: Points) -> Query:
        """Closest point, face, u, v and normal; ``read`` computes the distance from the point."""
        tensor = _tensor(points.points)

        def read(found: Any) -> Floats:
            distance: Floats = np.linalg.norm(found["points"].numpy().astype(np.float64) - points.points, axis=1)
            return distance

        return Query(lambda: self._scene.compute_closest_points(tensor), read)

    def signed(self, points: Points) -> Query:
        """Open3D's signed distance, with one ray a point for the sign."""
        tensor = _tensor(points.points)
        return Query(
            lambda: self._scene.compute_signed_distance(tensor, nsamples=1), lambda found: found.numpy().astype(float)
        )

    def touch(self) -> None:
        """Trace one ray."""
        self._scene.test_occlusions(self._ray)


def occlusion_test(vertices: Floats, faces: Faces, threads: int) -> Callable[[NDArray[np.float32]], NDArray[np.bool_]]:
    """Open3D's occlusion test of rays (n, 6), origins and directions, on so many threads; its tree is built."""
    scene = o3d.t.geometry.RaycastingScene(nthreads=threads)
    scene.add_triangles(_tensor(vertices), o3d.core.Tensor(faces.astype(np.uint32)))
    scene.test_occlusions(o3d.core.Tensor(np.array([[0, 0, 0, 0, 0, 1]], np.float32)))

    def test(rays: NDArray[np.float32]) -> NDArray[np.bool_]:
        hit: NDArray[np.bool_] = scene.test_occlusions(o3d.core.Tensor.from_numpy(rays)).numpy()
        return hit

    return test


def systems() -> list[System]:
    """The one contender of Open3D, on all threads."""
    return [System("open3d", "Open3D", available_threads(), "float32", _builder)]


def _builder(vertices: Floats, faces: Faces) -> Any:
    points = _tensor(vertices)
    triangles = o3d.core.Tensor(faces.astype(np.uint32))
    return lambda: Open3DPeer(points, triangles)


def _native(rays: Family) -> Any:
    return _tensor(np.hstack([rays.origins, rays.directions]))


def _tensor(rows: Floats) -> Any:
    return o3d.core.Tensor(rows.astype(np.float32))
