"""``closest_point`` and ``signed_distance`` as ``trimesh.proximity`` has them, answered by the octree."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.trimesh_ray.facing import facing_faces
from renderer.trimesh_ray.intersector import RayMeshIntersector, as_rows
from renderer.trimesh_ray.trees import traced

Floats = NDArray[np.float64]


def closest_point(mesh: Any, points: ArrayLike) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """The nearest point on the mesh (n, 3), its distance (n,) and its face (n,) for each of ``points`` (n, 3).

    Of the faces that meet at the nearest point it is the one least aslant to the query, as in trimesh; of others that
    are as near, the lowest.
    """
    given, it = as_rows("points", points), traced(mesh)
    found = it.octree.closest_point(given)
    nearest = found.points
    weights = np.stack([1.0 - found.u - found.v, found.u, found.v], axis=1)
    return nearest, found.distance, facing_faces(it.rings, it.normals, given, nearest, it.named(found.face), weights)


def signed_distance(mesh: Any, points: ArrayLike) -> Floats:
    """The distance (n,) of each of ``points`` (n, 3) from the mesh, as in trimesh: positive INSIDE, 0 on the surface.

    The sign is that of ``contains_points``, exact for closed meshes.
    """
    given = as_rows("points", points)
    distance = traced(mesh).octree.closest_point(given).distance
    return np.where(RayMeshIntersector(mesh).contains_points(given), distance, -distance) + 0.0
