"""A ``RayMeshIntersector`` like trimesh's own two, answered by the octree."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    """Rays of one mesh, with the methods, arguments and results of trimesh's intersectors.

    Unlike those it lists each place where a ray passes the surface once, however close the places lie, at edges and
    corners too; t = 0 counts, to rounding, and a ray in a face's plane misses that face. Of faces at one place, as in a
    body that is there twice, the first is named. Rows come by ray, then by distance. A ray whose origin or direction is
    not finite, or whose direction is 0, misses, and every ray misses a face with a corner that is not finite.

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

        kept = max_hits if multiple_hits else _FIRST
        faces, rays, places = self._hits(ray_origins, ray_directions, kept, return_locations)
        return (faces, rays, places) if return_locations else (faces, rays)

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True
    ) -> tuple[Floats, Integers, Integers]:
        """Places (m, 3), rays (m,) and faces (m,) of all hits, or of the first of each ray."""
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
        """The first face that each ray hits, (n,); -1 for none."""

        def ask(origins: Floats, directions: Floats) -> Integers:
            it = traced(self.mesh)
            return it.named(it.octree.closest_hit(origins, directions).face)

        faces, good = _asked(ask, ray_origins, ray_directions)
        return faces if good is None else np.where(good, faces, -1)

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.bool_]:
        """Whether each ray hits the mesh, (n,)."""
        hit, good = _asked(lambda o, d: traced(self.mesh).octree.any_hit(o, d), ray_origins, ray_directions)
        return hit if good is None else hit & good

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point (n, 3) lies inside, (n,): by parity as in trimesh.

        Faces at one place count once, as for a body that is there twice; but both walls of two bodies that touch count.
        Of an open mesh whose faces are turned one way it is whether the surface winds around the point by more than a
        half; of any other it is a vote of two opposite rays, as in trimesh, and of two more where they differ. A point
        on the surface is inside; one that is not finite is outside, as is any beyond the mesh's box.
        """
        given = as_rows("points", points)
        if len(self.mesh.faces) == 0:
            return np.zeros(len(given), np.bool_)
        return points_within(traced(self.mesh), given)

    def __copy__(self, *memo: Any) -> "RayMeshIntersector":
        """Of the same mesh, as trimesh's own."""
        return RayMeshIntersector(self.mesh, self._scale_to_box)

    __deepcopy__ = __copy__


def _asked(
    ask: Callable[[Floats, Floats], Any], origins: ArrayLike, directions: ArrayLike
) -> tuple[Any, NDArray[np.bool_] | None]:
    """The answer for the rays, and which of them can hit anything; None for all.

    That is told only where some ray is refused: most calls have none that is not finite or has no direction. In place
    of these any other rays are asked.
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
