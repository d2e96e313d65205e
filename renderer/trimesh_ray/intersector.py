"""A ``RayMeshIntersector`` like trimesh's own two, answered by the octree."""

from collections.abc import Callable
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.trimesh_ray.trees import traced
from renderer.trimesh_ray.within import points_within

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
_NOWHERE = np.empty((0, 3))
_NO_ROWS = np.empty(0, np.int64)
# In place of a number of hits: the first alone, which is searched for otherwise.
_FIRST: Literal["first"] = "first"


class RayMeshIntersector:
    """The rays of one mesh, with the methods, arguments and results of trimesh's intersectors.

    Unlike those it lists each place where a ray passes the surface once, however close the places lie, also at edges
    and corners. t = 0 counts, to rounding. A ray in a face's plane misses that face. Of coinciding faces the first is
    named. Rows are sorted by ray, then by distance. A ray that is not finite or has no direction misses, and every ray
    misses a face with a corner that is not finite.

    Parameters
    ----------
    geometry : trimesh.Trimesh or RayScene
        The mesh, of a scene the ``merged`` one. The tree is built by the first query, and again after an edit.
    scale_to_box : bool, default True
        Ignored; nothing is scaled.

    Examples
    --------
    >>> import trimesh
    >>> from renderer.trimesh_ray import RayMeshIntersector
    >>> mesh = trimesh.creation.box()
    >>> mesh.ray = RayMeshIntersector(mesh)
    >>> mesh.ray.intersects_location([[0, 0, 2]], [[0, 0, -1]])[0]
    array([[ 0. ,  0. ,  0.5],
           [ 0. ,  0. , -0.5]])
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True) -> None:
        self.mesh = geometry
        self._scale_to_box = scale_to_box

    @overload
    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int = 100,
        return_locations: Literal[False] = False,
    ) -> tuple[Integers, Integers]: ...
    @overload
    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int = 100,
        *,
        return_locations: Literal[True],
    ) -> tuple[Integers, Integers, Floats]: ...
    @overload
    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int = 100,
        return_locations: bool = False,
    ) -> tuple[Integers, Integers] | tuple[Integers, Integers, Floats]: ...
    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int = 100,
        return_locations: bool = False,
    ) -> tuple[Integers, Integers] | tuple[Integers, Integers, Floats]:
        """Return the faces and rays of all hits, or of the first hit of each ray.

        Parameters
        ----------
        ray_origins, ray_directions : array_like, shape (n, 3)
        multiple_hits : bool, default True
            List all hits of a ray; if False, the first.
        max_hits : int, default 100
            List at most this many hits of a ray, the nearest.
        return_locations : bool, default False
            Return the hit points too.

        Returns
        -------
        faces : ndarray of int64, shape (m,)
        rays : ndarray of int64, shape (m,)
        locations : ndarray of float64, shape (m, 3)
            Only with ``return_locations``.
        """
        kept = max_hits if multiple_hits else _FIRST
        faces, rays, places = self._hits(ray_origins, ray_directions, kept, return_locations)
        return (faces, rays, places) if return_locations else (faces, rays)

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True
    ) -> tuple[Floats, Integers, Integers]:
        """Return the points, rays and faces of all hits, or of the first hit of each ray.

        Parameters
        ----------
        ray_origins, ray_directions : array_like, shape (n, 3)
        multiple_hits : bool, default True
            List all hits of a ray; if False, the first.

        Returns
        -------
        locations : ndarray of float64, shape (m, 3)
        rays : ndarray of int64, shape (m,)
        faces : ndarray of int64, shape (m,)
        """
        faces, rays, places = self._hits(ray_origins, ray_directions, None if multiple_hits else _FIRST, True)
        return places, rays, faces

    def _hits(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, max_hits: int | Literal["first"] | None, located: bool
    ) -> tuple[Integers, Integers, Floats]:
        """Faces, rays and, if ``located``, places of the nearest ``max_hits`` of each ray, None for all."""

        def ask(origins: Floats, directions: Floats) -> tuple[Integers, Integers, Floats]:
            it = traced(self.mesh)
            if max_hits == _FIRST:
                first = it.octree.closest_hit(origins, directions)
                rays = np.flatnonzero(first.hit)
                return it.named(first.face[rays]), rays, first.points[rays] if located else _NOWHERE
            if max_hits is not None and max_hits < 1:
                return _NO_ROWS, _NO_ROWS, _NOWHERE
            # rule: hits-of-drop-in
            found = it.octree.all_hits(origins, directions, max_hits=max_hits)
            return it.named(found.face), found.ray, found.points if located else _NOWHERE

        (faces, rays, places), good = _asked(ask, ray_origins, ray_directions)
        if good is not None:
            real = good[rays]
            faces, rays, places = faces[real], rays[real], places[real] if located else places
        return faces, rays, places

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Integers:
        """Return the first face that each ray hits.

        Parameters
        ----------
        ray_origins, ray_directions : array_like, shape (n, 3)

        Returns
        -------
        ndarray of int64, shape (n,)
            -1 on a miss.
        """

        def ask(origins: Floats, directions: Floats) -> Integers:
            it = traced(self.mesh)
            return it.named(it.octree.closest_hit(origins, directions).face)

        faces, good = _asked(ask, ray_origins, ray_directions)
        return faces if good is None else np.where(good, faces, -1)

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.bool_]:
        """Return whether each ray hits the mesh.

        Parameters
        ----------
        ray_origins, ray_directions : array_like, shape (n, 3)

        Returns
        -------
        ndarray of bool, shape (n,)
        """
        hit, good = _asked(lambda o, d: traced(self.mesh).octree.any_hit(o, d), ray_origins, ray_directions)
        return hit if good is None else hit & good

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return whether each point lies inside, by parity as in trimesh.

        Coinciding faces count once, as for a body that is there twice, but both walls of two bodies that touch count.
        For an open mesh with consistent winding, a point is inside if the winding number is above 1/2. For any other
        open mesh two opposite rays vote, as in trimesh, and two more if they differ.

        Parameters
        ----------
        points : array_like, shape (n, 3)

        Returns
        -------
        ndarray of bool, shape (n,)
            True on the surface; False for a point that is not finite.
        """
        given, it = as_rows("points", points), traced(self.mesh)
        if len(it.faces) == 0:
            return np.zeros(len(given), np.bool_)
        return points_within(it, given)

    def __copy__(self, *memo: Any) -> "RayMeshIntersector":
        """Of the same mesh, as trimesh's own."""
        return RayMeshIntersector(self.mesh, self._scale_to_box)

    __deepcopy__ = __copy__


def _asked(
    ask: Callable[[Floats, Floats], Any], origins: ArrayLike, directions: ArrayLike
) -> tuple[Any, NDArray[np.bool_] | None]:
    """The answer for the rays, and a mask of those that can hit anything; None for all.

    The mask is made only if ``ask`` refuses a ray, because most calls have none that is not finite or has no direction.
    Any other ray then takes the place of such a one.
    """
    o, d = as_rows("ray_origins", origins), as_rows("ray_directions", directions)
    expect(d.shape == o.shape, "ray_directions", f"the shape of ray_origins, {o.shape}", f"shape {d.shape}")
    try:
        return ask(o, d), None
    except ValueError:
        good = np.asarray((np.isfinite(o) & np.isfinite(d)).all(axis=1) & d.any(axis=1))
        if good.all():
            raise
        return ask(np.where(good[:, None], o, 0.0), np.where(good[:, None], d, 1.0)), good


def as_rows(argument: str, values: ArrayLike) -> Floats:
    """Vectors as an (n, 3) array; an empty list is one without rows."""
    array = np.asarray(values, np.float64)
    array = array.reshape(0, 3) if array.shape == (0,) else array
    expect(array.ndim == 2 and array.shape[1] == 3, argument, "shape (n, 3)", f"shape {array.shape}")
    return array
