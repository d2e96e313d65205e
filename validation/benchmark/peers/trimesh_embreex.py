"""trimesh's rays through embreex as a contender: Embree in float32 on one thread, and NumPy around it.

trimesh starts each ray anew behind each hit. Closest and any hits are embreex's own queries, which ``embree`` times.
"""

from typing import Any

import numpy as np
import trimesh
from trimesh.ray import ray_pyembree

from validation.benchmark.peers.contender import Faces, Family, Floats, HitLists, Peer, Points, Query, System


class TrimeshEmbreexPeer(Peer):
    """trimesh's intersector over an Embree scene; its first query builds it."""

    def __init__(self, vertices: Floats, faces: Faces) -> None:
        untyped: Any = ray_pyembree
        self._caster = untyped.RayMeshIntersector(trimesh.Trimesh(vertices, faces, process=False, validate=False))

    def all(self, rays: Family) -> Query | None:
        """Location, ray and face of all hits; None for rays with an end. ``read`` computes t from the location."""
        if np.isfinite(rays.t_max):
            return None
        o, d = rays.origins, rays.directions

        def read(found: tuple[Any, Any, Any]) -> HitLists:
            point, ray, face = found
            t = np.einsum("ij,ij->i", point - o[ray], d[ray]) / np.einsum("ij,ij->i", d[ray], d[ray])
            return HitLists.sorted(len(rays), ray, t, face)

        return Query(lambda: self._caster.intersects_location(o, d, multiple_hits=True), read)

    def contains(self, points: Points) -> Query:
        """The parity of the hits of two opposite rays a point."""
        return Query(lambda: self._caster.contains_points(points.points), lambda inside: np.asarray(inside))

    def touch(self) -> None:
        """Trace one ray."""
        self._caster.intersects_any(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))


def systems() -> list[System]:
    """The one contender; it takes about 2 us a ray or point in small meshes and 10 us in large ones."""
    return [
        System("trimesh_embreex", "trimesh, embreex", 1, "float32", lambda v, f: lambda: TrimeshEmbreexPeer(v, f),
               most_rays=100_000, times_build=False)
    ]  # fmt: skip
