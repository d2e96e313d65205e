"""trimesh's own ray caster and closest points as a contender: NumPy over an R-tree, float64. It needs ``rtree``."""

from typing import Any

import numpy as np
import rtree  # noqa: F401  # trimesh imports it late; a missing package must fail here
import trimesh
from trimesh import proximity
from trimesh.ray import ray_triangle

from validation.benchmark.peers.contender import Faces, Family, Floats, Peer, Points, Query, System


class TrimeshPeer(Peer):
    """trimesh's intersector with its R-tree."""

    def __init__(self, vertices: Floats, faces: Faces) -> None:
        untyped: Any = ray_triangle
        self._mesh = trimesh.Trimesh(vertices, faces, process=False, validate=False)
        self._caster = untyped.RayMeshIntersector(self._mesh)

    def closest(self, rays: Family) -> Query | None:
        """Closest hits: trimesh finds all hits and takes the first; ``read`` computes t from its location.

        None where faces may lie behind a ray's end, which trimesh does not know of.
        """
        if rays.beyond:
            return None
        o, d = rays.origins, rays.directions

        def t(found: tuple[Any, Any, Any]) -> Floats:
            _, row, point = found
            result = np.full(len(o), np.inf)
            result[row] = np.einsum("ij,ij->i", point - o[row], d[row]) / np.einsum("ij,ij->i", d[row], d[row])
            return result

        return Query(lambda: self._caster.intersects_id(o, d, return_locations=True, multiple_hits=False), t)

    def any(self, rays: Family) -> Query | None:
        """Any hits; None for rays with an end, which trimesh does not support."""
        if np.isfinite(rays.t_max):
            return None
        return Query(lambda: self._caster.intersects_any(rays.origins, rays.directions), lambda hit: np.asarray(hit))

    def nearest(self, points: Points) -> Query:
        """Closest point, distance and face; a k-d tree of the vertices is part of each call."""
        untyped: Any = proximity
        return Query(lambda: untyped.closest_point(self._mesh, points.points), lambda found: np.asarray(found[1]))

    def touch(self) -> None:
        """Trace one ray, which builds the R-tree."""
        self._caster.intersects_any(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))


def systems() -> list[System]:
    """The one contender of trimesh, with few rays and small meshes only: it takes about 0.1 ms a ray or point."""
    return [
        System("trimesh", "trimesh", 1, "float64", lambda v, f: lambda: TrimeshPeer(v, f),
               most_rays=1_000, most_faces=20_000, times_build=False)
    ]  # fmt: skip
