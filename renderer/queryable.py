"""The queries that ``Octree`` and ``BruteForce`` have in common."""

from __future__ import annotations  # so that help() shows ArrayLike by its name

import warnings
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.all_hits.all_hits import all_hits, count_hits
from renderer.arguments.arrays import flag_argument
from renderer.arguments.types import ArrayLike
from renderer.distance.closest import closest_point
from renderer.distance.signed import signed_distance
from renderer.distance.visible import visible
from renderer.errors import expect
from renderer.inside.contains import contains, is_inside_out
from renderer.inside.winding import winding_number
from renderer.mesh.mesh import Mesh, Repairs
from renderer.results.closest_points import ClosestPoints
from renderer.results.hits import AllHits, Hits, Passage
from renderer.results.steps import Steps
from renderer.system.threads import checked_threads
from renderer.trace.batch import RayBatch, are_plain, check_rays, offset_origins
from renderer.trace.closest import any_hits, closest_hits
from renderer.trace.error import add_errors
from renderer.trace.layout import Tree
from renderer.trace.leaving import check_leaving, shapes_of_starts
from renderer.trace.steps import count_steps


class Built(NamedTuple):
    """A mesh and the tree over it, which a refit replaces together."""

    mesh: Mesh
    tree: Tree


class Queries:
    """Queries of one mesh; safe to call from many threads at once.

    Attributes
    ----------
    repairs : Repairs or None
        What ``repair=True`` left out of the given arrays.
    threads : int
        Threads of queries.
    """

    def __init__(self, mesh: Mesh, tree: Tree, threads: int | None) -> None:
        # One reference, so that a refit on another thread changes both at once.
        self._built = Built(mesh, tree)
        self.repairs: Repairs | None = None
        self.threads = checked_threads(threads)

    @property
    def mesh(self) -> Mesh:
        """The mesh, to which ``face`` of a hit refers. After a ``refit`` it is the moved one.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree(box())
        >>> hit = octree.closest_hit([0.5, 0.25, 3], [0, 0, -1])
        >>> octree.mesh.faces[hit.face]
        array([4, 5, 7], dtype=int32)
        """
        return self._built.mesh

    @property
    def tree(self) -> Tree:
        """The arrays that rays are traced against."""
        return self._built.tree

    @tree.setter
    def tree(self, tree: Tree) -> None:
        self._built = Built(self.mesh, tree)

    def closest_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | Hits | Passage | None = None,
        *,
        side: ArrayLike | None = None,
        t_error: bool = False,
    ) -> Hits:
        """Return the nearest hit of each ray in the closed interval [t_min, t_max].

        Of equal t, the lowest face is hit. No face is culled. All arguments but ``t_error`` are broadcast together, and
        the answers have that shape (...).

        Parameters
        ----------
        origins : array_like, shape (..., 3)
            Where the rays start.
        directions : array_like, shape (..., 3)
            Of any length from 2^-300 to 2^700.
        t_min, t_max : array_like, shape (...), default 0 and inf
            The interval, in units of ``|direction|``; t_min >= 0.
        leaving : array_like of int, shape (...), or Hits, optional
            Where rays start on the surface: the face of each start, -1 for none; or the ``Hits`` at whose ``points``
            they start; or ``hits.through()``, to go on behind the surface. The faces that hold the start, also those at
            an edge or corner, do not stop the ray by rounding, so that no epsilon is needed.
        side : array_like of int, shape (...), optional
            The side of the faces in ``leaving`` that the rays start on: 1 that of the normal, -1 the other, 0 unknown.
            A ray that leads through the surface to the other side is stopped at once, at t = 0. ``Hits`` know theirs.
        t_error : bool, default False
            Also bound the rounding error of each t, in ``hits.t_error``.

        Returns
        -------
        Hits
            ``t`` inf, ``face`` -1 and nan on a miss.

        Raises
        ------
        ValueError
            For a bad argument. The message names it and the row.

        Notes
        -----
        A ray in a face's plane misses the face, unless rounding of its slopes lifts it out of the plane. A component of
        a direction below 2^-700 of the largest counts as 0. The bits are the same for any number of threads.

        Examples
        --------
        >>> from renderer import Octree
        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> hits = octree.closest_hit([[0.1, 0.2, 3.0], [2, 2, 2]], [0, 0, -1])
        >>> hits.t, hits.face
        (array([ 3., inf]), array([ 0, -1]))
        >>> octree.closest_hit([0.1, 0.2, 3.0], [0, 0, -1], t_max=[2.0, 4.0]).hit
        array([False,  True])
        >>> octree.closest_hit(hits.points[:1], [0, 0, -1], leaving=hits.face[:1]).hit
        array([False])
        """
        built = self._built
        # In one step, because a call with one ray would spend most of its time on the others.
        if leaving is side is None and t_error is False and are_plain(origins, directions, t_min, t_max):
            return closest_hits(built.tree, built.mesh, self.threads, origins, directions)  # type: ignore[arg-type]
        rays, shape = self._rays(built, origins, directions, t_min, t_max, leaving, side)
        hits = closest_hits(built.tree, built.mesh, self.threads, *rays)
        if t_error is not False and flag_argument("t_error", t_error):
            add_errors(hits, rays, None, built.tree.scale, self.threads)
        return hits.shaped(shape)

    def any_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | Hits | Passage | None = None,
        *,
        side: ArrayLike | None = None,
    ) -> NDArray[np.bool_]:
        """Return whether each ray hits anything in the closed interval [t_min, t_max].

        Parameters
        ----------
        origins, directions, t_min, t_max, leaving, side
            As for ``closest_hit``.

        Returns
        -------
        ndarray of bool, shape (...)

        Examples
        --------
        >>> from renderer import Octree
        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> octree.any_hit([[0.1, 0.2, 3.0]], [0, 0, -1], t_max=2.5)
        array([False])
        """
        built = self._built
        if leaving is side is None and are_plain(origins, directions, t_min, t_max):
            return any_hits(built.tree, self.threads, origins, directions)  # type: ignore[arg-type]
        rays, shape = self._rays(built, origins, directions, t_min, t_max, leaving, side)
        return any_hits(built.tree, self.threads, *rays).reshape(shape)

    def all_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | Hits | Passage | None = None,
        *,
        side: ArrayLike | None = None,
        contacts: bool = True,
        max_hits: int | None = None,
        t_error: bool = False,
    ) -> AllHits:
        """Return all hits of each ray in the closed interval [t_min, t_max], sorted by t, then by face.

        The first hit of a ray is its ``closest_hit``, bit for bit. Memory grows with the number of hits.

        Parameters
        ----------
        origins, directions, t_min, t_max, leaving, side
            As for ``closest_hit``.
        contacts : bool, default True
            Report hits of a ray at one edge or corner once, as the first of them. Edges with the same end positions
            are one edge. Thin walls and double faces stay two hits. If False, each face that is hit is reported.
        max_hits : int, optional
            Keep at most this many hits of each ray, the nearest.
        t_error : bool, default False
            Also bound the rounding error of each t, in ``hits.t_error``.

        Returns
        -------
        AllHits

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree(box())
        >>> hits = octree.all_hits([[0.5, 0.5, 3], [5, 5, 5]], [0, 0, -1])
        >>> hits.t, hits.offsets
        (array([2., 3.]), array([0, 2, 2]))
        >>> octree.all_hits([[0.5, 0.5, 3]], [0, 0, -1], contacts=False).t
        array([2., 2., 3., 3.])
        """
        built = self._built
        rays, shape = self._rays(built, origins, directions, t_min, t_max, leaving, side)
        hits = all_hits(built.tree, rays, built.mesh, contacts, max_hits, shape, self.threads)
        if flag_argument("t_error", t_error):
            add_errors(hits, rays, hits.ray, built.tree.scale, self.threads)
        return hits

    def count_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | Hits | Passage | None = None,
        *,
        side: ArrayLike | None = None,
        contacts: bool = True,
    ) -> NDArray[np.int64]:
        """Return the number of hits that ``all_hits`` has for each ray.

        Parameters
        ----------
        origins, directions, t_min, t_max, leaving, side, contacts
            As for ``all_hits``.

        Returns
        -------
        ndarray of int64, shape (...)

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).count_hits([[0.5, 0.5, 3], [5, 5, 5]], [0, 0, -1])
        array([2, 0])
        """
        built = self._built
        rays, shape = self._rays(built, origins, directions, t_min, t_max, leaving, side)
        return count_hits(built.tree, rays, contacts, self.threads).reshape(shape)

    def count_steps(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | Hits | Passage | None = None,
        *,
        side: ArrayLike | None = None,
    ) -> Steps:
        """Return how many nodes and triangles the search for each ray's closest hit tests, for heat maps.

        The counts are those of a ray that travels alone and comes to near boxes first. Rays of one direction are
        traced together: they test more, at less cost.

        Parameters
        ----------
        origins, directions, t_min, t_max, leaving, side
            As for ``closest_hit``.

        Returns
        -------
        Steps

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import icosphere
        >>> steps = Octree(icosphere(4)).count_steps([[0, 0, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, 1]])
        >>> steps.nodes > 1, steps.triangles > 0
        (array([ True, False]), array([ True, False]))
        """
        built = self._built
        rays, shape = self._rays(built, origins, directions, t_min, t_max, leaving, side)
        return count_steps(built.tree, rays, shape, self.threads)

    def _rays(
        self,
        built: Built,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike,
        t_max: ArrayLike,
        leaving: ArrayLike | Hits | Passage | None,
        side: ArrayLike | None,
    ) -> tuple[RayBatch, tuple[int, ...]]:
        """The arguments of a query, checked, and moved off the faces that the rays leave; and their dimensions."""
        if leaving is None:
            expect(side is None, "side", "None without leaving", repr(side)[:40])
            return check_rays(origins, directions, t_min, t_max)
        rays, shape = check_rays(origins, directions, t_min, t_max, shapes_of_starts(leaving, side))
        left = check_leaving(leaving, side, shape, len(built.mesh.faces))
        return offset_origins(rays, left, built.mesh, built.tree.scale, self.threads), shape

    def contains(
        self,
        points: ArrayLike,
        boundary: bool = True,
        rule: Literal["nonzero", "even-odd"] = "nonzero",
        *,
        winding: bool = False,
    ) -> NDArray[np.bool_]:
        """Return whether each point lies inside the closed mesh, exactly: without votes or tolerances.

        Parameters
        ----------
        points : array_like, shape (..., 3)
        boundary : bool, default True
            The answer for points exactly on the surface.
        rule : {"nonzero", "even-odd"}, default "nonzero"
            "nonzero": inside if the surface winds around the point; solids may overlap. "even-odd": inside if a way out
            crosses the surface an odd number of times, however its faces are wound.
        winding : bool, default False
            For a mesh with holes: inside if ``winding_number``, to rounding, is above 1/2. Faces have to be
            counter-clockwise seen from outside. Only with the default ``rule``.

        Returns
        -------
        ndarray of bool, shape (...)

        Raises
        ------
        ValueError
            For a bad argument; and for a mesh that is not closed, unless ``winding``. The mesh is closed if each edge
            is passed as often in one direction as in the other ("nonzero", see ``Mesh.is_closed``), or if an even
            number of faces has it ("even-odd").

        Notes
        -----
        The answer is that of real arithmetic for the given float64 coordinates.

        References
        ----------
        Shewchuk, Adaptive Precision Floating-Point Arithmetic, 1997.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree(box())
        >>> octree.contains([[0.5, 0.5, 0.5], [1, 0.5, 0.5], [2, 0, 0]])
        array([ True,  True, False])
        >>> octree.contains([[0.5, 0.5, 0.5], [1, 0.5, 0.5], [2, 0, 0]], boundary=False)
        array([ True, False, False])
        >>> lidless = Octree(box().vertices, box().faces[:-2])
        >>> lidless.contains([[0.5, 0.5, 0.5], [1, 0.5, 0.5], [2, 0, 0]], winding=True)
        array([ True,  True, False])
        """
        mesh, tree = self._built
        inside = contains(tree, mesh, points, boundary, rule, winding, self.threads)
        if winding and not inside.any() and is_inside_out(mesh):
            turned = (
                "the mesh is turned inside out, so that no point is inside: its faces are clockwise seen from outside"
            )
            warnings.warn(turned, UserWarning, stacklevel=2)
        return inside

    def winding_number(self, points: ArrayLike, tolerance: float = 1e-3) -> NDArray[np.float64]:
        """Return how often the surface winds around each point: its solid angles over 4 pi.

        Inside a closed mesh whose faces are counter-clockwise seen from outside it is 1, and outside 0. Where solids
        overlap it is their number. With holes it lies between. On a face it is the mean of both sides.

        Parameters
        ----------
        points : array_like, shape (..., 3)
        tolerance : float, default 1e-3
            A bound of the error, from 0. Looser is faster, because faces far away count together; 0 sums over all.
            Rounding adds at most 2^-44 for each face that counts alone.

        Returns
        -------
        ndarray of float64, shape (...)

        Raises
        ------
        ValueError
            For a bad argument. The message names it and the row.

        Notes
        -----
        The first call takes some time to sum up the faces of each octant.

        References
        ----------
        Jacobson et al., Robust Inside-Outside Segmentation, 2013; Barill et al., Fast Winding Numbers, 2018.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> lidless = Octree(box((-1, -1, -1), (1, 1, 1)).vertices, box().faces[:-2])
        >>> lidless.winding_number([[0, 0, 0], [0, 0, 3]], tolerance=1e-9).round(4)
        array([0.8333, 0.0641])
        """
        mesh, tree = self._built
        return winding_number(tree, mesh, points, tolerance, self.threads)

    def closest_point(self, points: ArrayLike, max_distance: ArrayLike = np.inf) -> ClosestPoints:
        """Return the nearest point of the surface to each point.

        Of equal distances, the lowest face is named. Points and ``max_distance`` are broadcast together.

        Parameters
        ----------
        points : array_like, shape (..., 3)
        max_distance : array_like, shape (...), default inf
            Nothing is found beyond it, and the search ends sooner.

        Returns
        -------
        ClosestPoints
            ``distance`` inf, ``face`` -1 and nan if nothing is within ``max_distance``.

        Raises
        ------
        ValueError
            For a bad argument, and for a mesh without faces.

        Notes
        -----
        The distance is within one ulp of the exact one, and 0 on the surface. For points nearer to the surface than
        2^-64 of the distance to the face's farthest corner, the error is at most 2^-90 of that.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> near = Octree(box()).closest_point([[0.5, 0.5, 3], [0.5, 0.5, 0.75]])
        >>> near.distance, near.points.tolist()
        (array([2.  , 0.25]), [[0.5, 0.5, 1.0], [0.5, 0.5, 1.0]])
        """
        mesh, tree = self._built
        return closest_point(tree, mesh, points, max_distance, self.threads)

    def signed_distance(
        self,
        points: ArrayLike,
        max_distance: ArrayLike = np.inf,
        rule: Literal["nonzero", "even-odd"] = "nonzero",
        *,
        winding: bool = False,
    ) -> NDArray[np.float64]:
        """Return the distance of each point from the surface of the closed mesh: positive OUTSIDE, negative inside.

        Open3D and libigl have the same sign, trimesh the other one. The distance is that of ``closest_point``, and the
        sign that of ``contains``, never that of the nearest normal.

        Parameters
        ----------
        points : array_like, shape (..., 3)
        max_distance : array_like, shape (...), default inf
            As for ``closest_point``.
        rule, winding
            As for ``contains``.

        Returns
        -------
        ndarray of float64, shape (...)
            0 exactly on the surface; inf or -inf beyond ``max_distance``.

        Raises
        ------
        ValueError
            As ``closest_point`` and ``contains`` do.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).signed_distance([[0.5, 0.5, 3], [0.5, 0.5, 0.75], [1, 1, 1]])
        array([ 2.  , -0.25,  0.  ])
        """
        mesh, tree = self._built
        return signed_distance(tree, mesh, points, max_distance, rule, winding, self.threads)

    def visible(
        self,
        points: ArrayLike,
        targets: ArrayLike,
        leaving: ArrayLike | None = None,
        reaching: ArrayLike | None = None,
    ) -> NDArray[np.bool_]:
        """Return whether nothing lies between each point and its target.

        All arguments are broadcast together. No end hides itself: the faces that hold it hide nothing. A surface that
        the segment only touches hides.

        Parameters
        ----------
        points, targets : array_like, shape (..., 3)
        leaving, reaching : array_like of int, shape (...), optional
            The faces that the points and the targets lie on; -1 or None if unknown, then it is found out.

        Returns
        -------
        ndarray of bool, shape (...)

        Raises
        ------
        ValueError
            For a bad argument. The message names it and the row.

        Notes
        -----
        Unless an end lies on the surface, hits within 2^-40 of it are ignored, relative to the largest coordinate of
        both ends.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).visible([0.5, 0.5, 3], [[0.5, 0.5, 1], [0.5, 0.5, 0], [3, 0.5, 3]])
        array([ True, False,  True])
        """
        mesh, tree = self._built
        return visible(tree, mesh, (points, targets), (leaving, reaching), self.threads)
