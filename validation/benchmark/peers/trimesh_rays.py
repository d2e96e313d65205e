"""trimesh's own ray caster as a contender: NumPy over an R-tree, float64. It needs the package rtree."""

from typing import Any

import numpy as np
import rtree  # noqa: F401  # trimesh imports it late; its absence must show here
import trimesh
from trimesh.ray import ray_triangle

from validation.benchmark.peers.contender import Faces, Family, Floats, Query, System


class TrimeshPeer:
    """The intersector with its R-tree."""

    def __init__(self, vertices: Floats, faces: Faces) -> None:
        untyped: Any = ray_triangle
        self._caster = untyped.RayMeshIntersector(trimesh.Trimesh(vertices, faces, process=False, validate=False))

    def closest(self, rays: Family) -> Query:
        """All hits: trimesh takes the first of them; ours are its locations, from which ``read`` has t."""
        o, d = rays.origins, rays.directions

        def t(found: tuple[Any, Any, Any]) -> Floats:
            _, row, point = found
            result = np.full(len(o), np.inf)
            result[row] = np.einsum("ij,ij->i", point - o[row], d[row]) / np.einsum("ij,ij->i", d[row], d[row])
            return result

        return Query(lambda: self._caster.intersects_id(o, d, return_locations=True, multiple_hits=False), t)

    def any(self, rays: Family) -> Query | None:
        """None for rays that end: trimesh's have no end."""
        if np.isfinite(rays.t_max):
            return None
        return Query(lambda: self._caster.intersects_any(rays.origins, rays.directions), lambda hit: np.asarray(hit))

    def touch(self) -> None:
        """One ray; the R-tree is built by the first."""
        self._caster.intersects_any(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))


def systems() -> list[System]:
    """Few rays and small meshes only: it takes about 0.1 ms a ray."""
    return [
        System("trimesh", "trimesh", 1, "float64", lambda v, f: lambda: TrimeshPeer(v, f),
               most_rays=1_000, most_faces=20_000, times_build=False)
    ]  # fmt: skip
