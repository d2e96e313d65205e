"""``closest_point`` and ``signed_distance`` as ``trimesh.proximity`` has them, answered by the octree."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.trimesh_ray.facing import facing_faces
from renderer.trimesh_ray.intersector import RayMeshIntersector, as_rows
from renderer.trimesh_ray.trees import traced

Floats = NDArray[np.float64]


def closest_point(mesh: Any, points: ArrayLike) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return the nearest point of the mesh to each of some points, as ``trimesh.proximity.closest_point`` does.

    Of the faces that meet at the nearest point, the one that faces the query most is named, as in trimesh; of other
    faces that are as near, the lowest.

    Parameters
    ----------
    mesh : trimesh.Trimesh
    points : array_like, shape (n, 3)

    Returns
    -------
    nearest : ndarray of float64, shape (n, 3)
    distance : ndarray of float64, shape (n,)
    faces : ndarray of int64, shape (n,)
    """
    given, it = as_rows("points", points), traced(mesh)
    found = it.octree.closest_point(given)
    nearest = found.points
    weights = np.stack([1.0 - found.u - found.v, found.u, found.v], axis=1)
    return nearest, found.distance, facing_faces(it.rings, it.normals, given, nearest, it.named(found.face), weights)


def signed_distance(mesh: Any, points: ArrayLike) -> Floats:
    """Return the distance of each of some points from the mesh, as in trimesh: positive INSIDE.

    The sign is that of ``contains_points``, exact for closed meshes.

    Parameters
    ----------
    mesh : trimesh.Trimesh
    points : array_like, shape (n, 3)

    Returns
    -------
    ndarray of float64, shape (n,)
        0 on the surface.
    """
    given = as_rows("points", points)
    distance = traced(mesh).octree.closest_point(given).distance
    return np.where(RayMeshIntersector(mesh).contains_points(given), distance, -distance) + 0.0
