"""trimesh's two intersectors, its own and the one over embreex, with the methods that ``renderer.trimesh_ray`` has."""

from typing import Any

import rtree  # noqa: F401  # trimesh imports it late; a missing package must fail here
from trimesh.ray import ray_pyembree, ray_triangle

ALONE, EMBREEX = "trimesh alone", "trimesh + embreex"


def intersectors() -> dict[str, Any]:
    """By name the class of each, made of a ``trimesh.Trimesh``. Raises ``ImportError`` where embreex is absent."""
    untyped: Any = (ray_triangle, ray_pyembree)
    alone, over = untyped
    if not isinstance(over.RayMeshIntersector, type):
        raise ImportError("trimesh found no embreex")
    return {ALONE: alone.RayMeshIntersector, EMBREEX: over.RayMeshIntersector}
