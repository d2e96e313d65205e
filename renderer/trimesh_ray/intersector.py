"""A ``RayMeshIntersector`` like trimesh's own two, answered by the octree."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.errors import expect
from renderer.trimesh_ray.trees import octree_of

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
_NOWHERE = np.empty((0, 3))


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

        def ask(origins: Floats, directions: Floats) -> tuple[Integers, Integers, Floats]:
            octree = octree_of(self.mesh)
            if multiple_hits:
                found = octree.all_hits(origins, directions, max_hits=max_hits)
                return found.face, found.ray, found.points if return_locations else _NOWHERE
            first = octree.closest_hit(origins, directions)
            rays = np.flatnonzero(first.hit)
            return first.face[rays], rays, first.points[rays] if return_locations else _NOWHERE

        rows, (faces, rays, places) = _asked(ask, ray_origins, ray_directions)
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
        rows, faces = _asked(lambda o, d: octree_of(self.mesh).closest_hit(o, d).face, ray_origins, ray_directions)
        return faces if rows is None else _spread(faces, rows, np.shape(ray_origins)[0], -1)

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.bool_]:
        """Whether each ray hits the mesh, (n,)."""
        rows, hit = _asked(lambda o, d: octree_of(self.mesh).any_hit(o, d), ray_origins, ray_directions)
        return hit if rows is None else _spread(hit, rows, np.shape(ray_origins)[0], False)

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point (n, 3) lies inside, (n,): by parity as in trimesh; of an open mesh by its winding number.

        A point on the surface is inside; one that is not finite is outside, as is any beyond the mesh's box.
        """
        given = as_rows("points", points)
        if len(self.mesh.faces) == 0:
            return np.zeros(len(given), np.bool_)
        octree = octree_of(self.mesh)
        lower, upper = octree.mesh.bounds
        within = ((given >= lower) & (given <= upper)).all(axis=1)  # of NaN too
        if within.any():
            closed = len(octree.mesh.odd_edges) == 0
            how: Any = {"rule": "even-odd"} if closed else {"winding": True}
            within[within] = octree.contains(given[within], **how)
        return within


def _asked(ask: Callable[[Floats, Floats], Any], origins: ArrayLike, directions: ArrayLike) -> tuple[Any, Any]:
    """The answer for all rays, after None; or the rows of those that can hit something, and the answer for them.

    Rays that are not finite or have no direction are told only when some are refused: most calls have none.
    """
    o, d = as_rows("ray_origins", origins), as_rows("ray_directions", directions)
    expect(d.shape == o.shape, "ray_directions", f"the shape of ray_origins, {o.shape}", f"shape {d.shape}")
    try:
        return None, ask(o, d)
    except ValueError:
        good = (np.isfinite(o) & np.isfinite(d)).all(axis=1) & d.any(axis=1)
        if good.all():
            raise
        return np.flatnonzero(good), ask(o[good], d[good])


def as_rows(argument: str, values: ArrayLike) -> Floats:
    """Vectors as an (n, 3) array; an empty list is one without rows."""
    array = np.asarray(values, np.float64)
    array = array.reshape(0, 3) if array.shape == (0,) else array
    expect(array.ndim == 2 and array.shape[1] == 3, argument, "shape (n, 3)", f"shape {array.shape}")
    return array


def _spread(values: NDArray[Any], rows: Integers, count: int, other: Any) -> NDArray[Any]:
    """The values in their rows of ``count``, and ``other`` in the rest."""
    whole = np.full(count, other, values.dtype)
    whole[rows] = values
    return whole
