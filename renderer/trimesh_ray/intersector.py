"""A ``RayMeshIntersector`` like trimesh's own two, answered by the octree."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.errors import expect
from renderer.trimesh_ray.trees import octree_of

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class RayMeshIntersector:
    """Rays of one mesh, with the methods, arguments and results of trimesh's intersectors.

    Unlike those it lists each place where a ray passes the surface once, however close the places lie, at edges and
    corners too; t = 0 counts, and a ray in a face's plane misses that face. Rows come by ray, then by distance. A ray
    whose origin or direction is not finite, or whose direction is 0, misses.

    >>> import trimesh
    >>> from renderer.trimesh_ray import RayMeshIntersector
    >>> mesh = trimesh.creation.box()
    >>> mesh.ray = RayMeshIntersector(mesh)
    >>> mesh.ray.intersects_location([[0, 0, 2]], [[0, 0, -1]])[0]
    array([[ 0. ,  0. ,  0.5],
           [ 0. ,  0. , -0.5]])
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True) -> None:
        """``scale_to_box`` is taken and not needed: nothing is scaled."""
        self.mesh = geometry
        self._scale_to_box = scale_to_box

    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int = 100,
        return_locations: bool = False,
    ) -> tuple[Integers, Integers] | tuple[Integers, Integers, Floats]:
        """Faces (m,) and rays (m,) of all hits, or of the first of each ray; with their places (m, 3) if asked for.

        ray_origins, ray_directions  (n, 3)
        multiple_hits                whether all hits of a ray are listed, at most the nearest ``max_hits``
        """
        rows, origins, directions = _checked(ray_origins, ray_directions)
        faces, rays, places = np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 3))
        if len(origins) and len(self.mesh.faces):
            octree = octree_of(self.mesh)
            found: Any
            if multiple_hits:
                found = octree.all_hits(origins, directions, max_hits=max_hits)
                faces, rays = found.face, found.ray
            else:
                found = octree.closest_hit(origins, directions)
                rays = np.flatnonzero(found.hit)
                faces = found.face[rays]
            if return_locations:
                places = found.points if multiple_hits else found.points[rays]
        rays = rays if rows is None else rows[rays]
        return (faces, rays, places) if return_locations else (faces, rays)

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True
    ) -> tuple[Floats, Integers, Integers]:
        """Places (m, 3), rays (m,) and faces (m,) of all hits, or of the first of each ray."""
        found: Any = self.intersects_id(ray_origins, ray_directions, multiple_hits, return_locations=True)
        faces, rays, places = found
        return places, rays, faces

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Integers:
        """The first face that each ray hits, (n,); -1 for none."""
        rows, origins, directions = _checked(ray_origins, ray_directions)
        faces = np.full(len(np.asarray(ray_origins)), -1, np.int64)
        if len(origins) and len(self.mesh.faces):
            faces[slice(None) if rows is None else rows] = octree_of(self.mesh).closest_hit(origins, directions).face
        return faces

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.bool_]:
        """Whether each ray hits the mesh, (n,)."""
        rows, origins, directions = _checked(ray_origins, ray_directions)
        hit = np.zeros(len(np.asarray(ray_origins)), np.bool_)
        if len(origins) and len(self.mesh.faces):
            hit[slice(None) if rows is None else rows] = octree_of(self.mesh).any_hit(origins, directions)
        return hit

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point (n, 3) lies inside, (n,): by parity as in trimesh; of an open mesh by its winding number.

        A point on the surface is inside; one that is not finite is outside.
        """
        given = checked_points(points)
        inside, finite = np.zeros(len(given), np.bool_), np.isfinite(given).all(axis=1)
        if finite.any() and len(self.mesh.faces):
            octree = octree_of(self.mesh)
            closed = len(octree.mesh.odd_edges) == 0
            how: Any = {"rule": "even-odd"} if closed else {"winding": True}
            inside[finite] = octree.contains(given[finite], **how)
        return inside


def checked_points(points: ArrayLike) -> Floats:
    """Points as an (n, 3) array; ``ValueError`` for another shape."""
    array = np.asarray(points, np.float64)
    array = array.reshape(0, 3) if array.size == 0 else array
    expect(array.ndim == 2 and array.shape[1] == 3, "points", "shape (n, 3)", f"shape {array.shape}")
    return array


def _checked(origins: ArrayLike, directions: ArrayLike) -> tuple[Integers | None, Floats, Floats]:
    """The rows of the rays that can hit something, None for all, and their origins and directions."""
    o, d = np.asarray(origins, np.float64), np.asarray(directions, np.float64)
    if o.size == d.size == 0:
        return None, np.empty((0, 3)), np.empty((0, 3))
    expect(o.ndim == 2 and o.shape[1] == 3, "ray_origins", "shape (n, 3)", f"shape {o.shape}")
    expect(d.shape == o.shape, "ray_directions", f"the shape of ray_origins, {o.shape}", f"shape {d.shape}")
    good = (np.isfinite(o) & np.isfinite(d)).all(axis=1) & d.any(axis=1)
    if good.all():
        return None, o, d
    rows = np.flatnonzero(good)
    return rows, o[rows], d[rows]
