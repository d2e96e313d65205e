"""The queries of a scene: those of ``Octree``, with what each ray may hit."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderer.all_hits.all_hits import all_hits, count_hits
from renderer.arguments.arrays import flag_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.distance.closest import closest_point
from renderer.distance.signed import signed_distance
from renderer.inside.contains import contains
from renderer.rayscene.built import BuiltScene
from renderer.rayscene.hits import SceneAllHits, SceneClosestPoints, SceneHits
from renderer.rayscene.starting import Choice, Leaving, rays_of
from renderer.results.hits import AllHits, Hits
from renderer.results.steps import Steps
from renderer.trace.batch import RayBatch
from renderer.trace.closest import any_hits, closest_hits
from renderer.trace.error import errors_of
from renderer.trace.layout import MASK_BITS
from renderer.trace.steps import count_steps

Sides = Literal["both", "front", "back"]


class SceneQueries:
    """Queries of a scene; safe to call from many threads at once."""

    threads: int

    @property
    def _built(self) -> BuiltScene:
        raise NotImplementedError

    def closest_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: Leaving = None,
        *,
        mask: ArrayLike = MASK_BITS,
        ignore: SceneHits | None = None,
        faces: Sides = "both",
        t_error: bool = False,
    ) -> SceneHits:
        """Return the nearest hit of each ray in the closed interval [t_min, t_max].

        Of equal t, the lowest object is hit, then the lowest instance, then the lowest face. All arguments but
        ``t_error`` are broadcast together, and the answers have that shape (...).

        Parameters
        ----------
        origins, directions, t_min, t_max
            As for ``Octree.closest_hit``.
        leaving : SceneHits, or what ``SceneHits.through`` returns, optional
            Where rays start on the surface, as for ``Octree.closest_hit``.
        mask : array_like of int, shape (...), default all bits
            32 bits: a ray meets an instance if the instance's mask has one of them too.
        ignore : SceneHits, shape (...), optional
            Each ray passes through the instance that was hit there, such as the body that a sensor is part of.
        faces : {"both", "front", "back"}, default "both"
            The sides of faces that rays hit: "front" that of the normal, by the right-hand rule. Not with ``leaving``.
        t_error : bool, default False
            Also bound the rounding error of each t, in ``hits.t_error``.

        Returns
        -------
        SceneHits

        Raises
        ------
        ValueError
            For a bad argument. The message names it and the row.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube, glass = scene.add(box(), mask=1), scene.add(box((0, 0, 2), (1, 1, 3)), mask=2)
        >>> hits = scene.closest_hit([0.5, 0.25, 9], [0, 0, -1], mask=[1, 2, 3])
        >>> hits.object, hits.t
        (array([0, 1, 1]), array([8., 6., 6.]))
        >>> scene.closest_hit([0.5, 0.25, 9], [0, 0, -1], ignore=hits).object
        array([1, 0, 0])
        """
        built = self._built
        rays, shape = rays_of(built, origins, directions, t_min, t_max, Choice(leaving, mask, ignore, faces))
        hits = closest_hits(built.tree_for(rays, faces), built.mesh, self.threads, *rays)
        if flag_argument("t_error", t_error):
            _add_errors(built, hits, rays, None, self.threads)
        return SceneHits(hits.shaped(shape), built)

    def any_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: Leaving = None,
        *,
        mask: ArrayLike = MASK_BITS,
        ignore: SceneHits | None = None,
        faces: Sides = "both",
    ) -> NDArray[np.bool_]:
        """Return whether each ray hits anything in the closed interval [t_min, t_max].

        Parameters
        ----------
        origins, directions, t_min, t_max, leaving, mask, ignore, faces
            As for ``closest_hit``.

        Returns
        -------
        ndarray of bool, shape (...)

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.any_hit([[0.5, 0.25, 9], [5, 5, 5]], [0, 0, -1])
        array([ True, False])
        """
        built = self._built
        rays, shape = rays_of(built, origins, directions, t_min, t_max, Choice(leaving, mask, ignore, faces))
        return any_hits(built.tree_for(rays, faces), self.threads, *rays).reshape(shape)

    def all_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: Leaving = None,
        *,
        mask: ArrayLike = MASK_BITS,
        ignore: SceneHits | None = None,
        faces: Sides = "both",
        contacts: bool = True,
        max_hits: int | None = None,
        t_error: bool = False,
    ) -> SceneAllHits:
        """Return all hits of each ray in the closed interval [t_min, t_max], sorted by t, object, instance and face.

        Parameters
        ----------
        origins, directions, t_min, t_max, leaving, mask, ignore, faces
            As for ``closest_hit``.
        contacts, max_hits, t_error
            As for ``Octree.all_hits``.

        Returns
        -------
        SceneAllHits

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.all_hits([0.5, 0.25, 9], [0, 0, -1]).t
        array([8., 9.])
        """
        built = self._built
        rays, shape = rays_of(built, origins, directions, t_min, t_max, Choice(leaving, mask, ignore, faces))
        hits = all_hits(built.tree_for(rays, faces), rays, built.mesh, contacts, max_hits, shape, self.threads)
        if flag_argument("t_error", t_error):
            _add_errors(built, hits, rays, hits.ray, self.threads)
        return SceneAllHits(hits, built)

    def count_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: Leaving = None,
        *,
        mask: ArrayLike = MASK_BITS,
        ignore: SceneHits | None = None,
        faces: Sides = "both",
        contacts: bool = True,
    ) -> NDArray[np.int64]:
        """Return the number of hits that ``all_hits`` has for each ray.

        Parameters
        ----------
        origins, directions, t_min, t_max, leaving, mask, ignore, faces, contacts
            As for ``all_hits``.

        Returns
        -------
        ndarray of int64, shape (...)

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.count_hits([[0.5, 0.25, 9], [5, 5, 5]], [0, 0, -1])
        array([2, 0])
        """
        built = self._built
        rays, shape = rays_of(built, origins, directions, t_min, t_max, Choice(leaving, mask, ignore, faces))
        return count_hits(built.tree_for(rays, faces), rays, contacts, self.threads).reshape(shape)

    def count_steps(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: Leaving = None,
        *,
        mask: ArrayLike = MASK_BITS,
        ignore: SceneHits | None = None,
        faces: Sides = "both",
    ) -> Steps:
        """Return how many nodes and triangles the search for each ray's closest hit tests, as ``Octree.count_steps``.

        Parameters
        ----------
        origins, directions, t_min, t_max, leaving, mask, ignore, faces
            As for ``closest_hit``.

        Returns
        -------
        Steps

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.count_steps([[0.5, 0.25, 9], [5, 5, 5]], [0, 0, -1]).nodes.tolist()
        [1, 1]
        """
        built = self._built
        rays, shape = rays_of(built, origins, directions, t_min, t_max, Choice(leaving, mask, ignore, faces))
        return count_steps(built.tree_for(rays, faces), rays, shape, self.threads)

    def contains(
        self,
        points: ArrayLike,
        boundary: bool = True,
        rule: Literal["nonzero", "even-odd"] = "nonzero",
        *,
        winding: bool = False,
    ) -> NDArray[np.bool_]:
        """Return whether each point lies inside, as ``Octree.contains``. Hidden instances and masks do not count.

        Parameters
        ----------
        points, boundary, rule, winding
            As for ``Octree.contains``.

        Returns
        -------
        ndarray of bool, shape (...)

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), transforms=[[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0]])
        >>> scene.contains([[1.5, 1.5, 1.5], [2.5, 0, 0]])
        array([ True, False])
        """
        built = self._built
        if winding:
            return built.merged.contains(points, boundary, rule, winding=winding)
        return contains(built.tree, built.mesh, points, boundary, rule, False, self.threads)

    def winding_number(self, points: ArrayLike, tolerance: float = 1e-3) -> NDArray[np.float64]:
        """Return how often the surfaces wind around each point, as ``Octree.winding_number``.

        Parameters
        ----------
        points, tolerance
            As for ``Octree.winding_number``.

        Returns
        -------
        ndarray of float64, shape (...)

        Notes
        -----
        It is computed on ``merged``, in memory that copies need too.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.winding_number([[0.5, 0.5, 0.5]]).round(9)
        array([1.])
        """
        return self._built.merged.winding_number(points, tolerance)

    def closest_point(
        self, points: ArrayLike, max_distance: ArrayLike = np.inf, *, mask: int | None = None
    ) -> SceneClosestPoints:
        """Return the nearest point of the surfaces to each point, as ``Octree.closest_point``.

        Of equal distances, the lowest object is named, then the lowest instance, then the lowest face.

        Parameters
        ----------
        points, max_distance
            As for ``Octree.closest_point``.
        mask : int, optional
            32 bits: instances count whose mask has one of them too; None for all instances.

        Returns
        -------
        SceneClosestPoints

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 3)])
        >>> near = scene.closest_point([3.5, 0.5, 2])
        >>> near.distance, near.instance
        (array(1.), array(1))
        """
        built = self._built
        counted = built.counted(None if mask is None else count_argument("mask", mask, 0, MASK_BITS, " or None"))
        found = closest_point(built.tree, built.mesh, points, max_distance, self.threads, counted)
        return SceneClosestPoints(found, built)

    def signed_distance(
        self,
        points: ArrayLike,
        max_distance: ArrayLike = np.inf,
        rule: Literal["nonzero", "even-odd"] = "nonzero",
        *,
        winding: bool = False,
    ) -> NDArray[np.float64]:
        """Return the distance of each point from the surfaces: positive OUTSIDE, negative inside.

        Parameters
        ----------
        points, max_distance, rule, winding
            As for ``Octree.signed_distance``.

        Returns
        -------
        ndarray of float64, shape (...)

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.signed_distance([[0.5, 0.5, 3], [0.5, 0.5, 0.75]])
        array([ 2.  , -0.25])
        """
        built = self._built
        if winding:
            return built.merged.signed_distance(points, max_distance, rule, winding=winding)
        return signed_distance(built.tree, built.mesh, points, max_distance, rule, False, self.threads)

    def visible(self, points: ArrayLike, targets: ArrayLike) -> NDArray[np.bool_]:
        """Return whether nothing lies between each point and its target, as ``Octree.visible``.

        Parameters
        ----------
        points, targets : array_like, shape (..., 3)

        Returns
        -------
        ndarray of bool, shape (...)

        Notes
        -----
        It is computed on ``merged``, in memory that copies need too.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.visible([0.5, 0.5, 3], [[0.5, 0.5, 1], [0.5, 0.5, 0]])
        array([ True, False])
        """
        return self._built.merged.visible(points, targets)


def _add_errors(
    scene: BuiltScene, hits: Hits | AllHits, rays: RayBatch, rows: NDArray[np.int64] | None, threads: int
) -> None:
    """Set ``hits.t_error``."""
    own, faces = scene.mesh_of(hits.face)
    hits.t_error = errors_of(own, faces, hits.t, rays, rows, 1.0, threads)
