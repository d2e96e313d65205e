"""The questions that rays and points ask of a mesh: what ``Octree`` and ``BruteForce`` have in common."""

from __future__ import annotations  # so that help() shows ArrayLike by its name

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.all_hits.all_hits import all_hits, count_hits
from renderer.arguments.arrays import flag_argument
from renderer.distance.closest import closest_point
from renderer.distance.signed import signed_distance
from renderer.distance.visible import visible
from renderer.errors import expect
from renderer.inside.contains import contains
from renderer.inside.winding import winding_number
from renderer.mesh.mesh import Mesh, Repairs
from renderer.results.closest_points import ClosestPoints
from renderer.results.hits import AllHits, Hits, Passage
from renderer.results.steps import Steps
from renderer.system.threads import checked_threads
from renderer.trace.batch import RayBatch, check_rays, offset_origins
from renderer.trace.closest import any_hits, closest_hits
from renderer.trace.error import add_errors
from renderer.trace.layout import Tree
from renderer.trace.leaving import check_leaving
from renderer.trace.steps import count_steps


class Built(NamedTuple):
    """A mesh and the tree over it, which a refit replaces together."""

    mesh: Mesh
    tree: Tree


class Queries:
    """Queries of one mesh; safe to call from many threads at once.

    ``mesh`` is the mesh that was built over, to which a hit's ``face`` refers. ``repairs`` says what ``repair=True``
    left out of the given arrays, and is None without it.
    """

    def __init__(self, mesh: Mesh, tree: Tree, threads: int | None) -> None:
        # One reference, so that a refit on another thread changes both at once.
        self._built = Built(mesh, tree)
        self.repairs: Repairs | None = None
        self.threads = checked_threads(threads)

    @property
    def mesh(self) -> Mesh:
        """The mesh that was built over, and after a ``refit`` the moved one.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree.from_mesh(box())
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
        """The nearest hit of each ray in the closed interval [t_min, t_max]; equal t: the lowest face.

        origins, directions  (..., 3), finite; their leading dimensions are broadcast, and the answers have these;
                             directions are not zero, from 2^-300 to 2^700 long
        t_min, t_max         >= 0, one number or (...), in units of |direction|
        leaving              where the rays start on the surface: faces, one or (...), -1 for none; or the ``Hits`` at
                             whose ``points`` they start, or these hits' ``through()``. No epsilon is needed. A ray
                             starts exactly at the hit, or at the point of the face that is nearest to its origin. The
                             faces that hold this point, those at an edge or corner too, do not stop it by rounding
        side                 which side of the named faces the rays start on, one or (...): 1 that of the normal by
                             winding, -1 the other one, 0 unknown. ``Hits`` know their own. A ray whose direction leads
                             through the surface to another side is then stopped at once: t = 0. Where no side is known
                             nothing stops it at its start
        t_error              whether the hits have bounds of the errors of t: how far it may be from where the ray, as
                             it was started, meets the face, or passes it, if only rounding makes it hit

        No face is culled. A ray in a face's plane misses it, unless the rounding of its slopes lifts it out of the
        plane. The same bits for any number of threads. Raises ``ValueError`` naming argument and row.

        >>> from renderer import Octree
        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> hits = octree.closest_hit([[0.1, 0.2, 3.0], [2, 2, 2]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.t, hits.face
        (array([ 3., inf]), array([ 0, -1]))
        >>> octree.closest_hit(hits.points[:1], [[0, 0, -1]], leaving=hits.face[:1]).hit
        array([False])
        """
        built = self._built
        rays, shape = self._rays(built, origins, directions, t_min, t_max, leaving, side)
        hits = closest_hits(built.tree, rays, built.mesh, self.threads)
        if flag_argument("t_error", t_error):
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
        """Whether each ray hits anything in the closed interval [t_min, t_max], (...) bool.

        Arguments as for ``closest_hit``, but for ``t_error``.

        >>> from renderer import Octree
        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> octree.any_hit([[0.1, 0.2, 3.0]], [[0, 0, -1]], t_max=[2.5])
        array([False])
        """
        built = self._built
        rays, shape = self._rays(built, origins, directions, t_min, t_max, leaving, side)
        return any_hits(built.tree, rays, self.threads).reshape(shape)

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
        """All hits of each ray in the closed interval [t_min, t_max], sorted by t, then face.

        Arguments as for ``closest_hit``, and:

        contacts  True: the hits of a ray at one edge or corner of the surface, told apart by position, are one contact,
                  which is reported as the first of them. Thin walls and double faces stay two. False: each face that is
                  hit has its row
        max_hits  keep at most so many of each ray, the nearest

        The first row of a ray is its ``closest_hit``, bit for bit, and a ray has rows where ``any_hit`` is true. The
        tree is not searched anew for each hit, and none is told from another by its distance. Memory grows with what is
        found.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree.from_mesh(box())
        >>> hits = octree.all_hits([[0.5, 0.5, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.t, hits.offsets
        (array([2., 3.]), array([0, 2, 2]))
        >>> octree.all_hits([[0.5, 0.5, 3]], [[0, 0, -1]], contacts=False).t
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
        """The number of rows that ``all_hits`` has for each ray, (...) int64.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree.from_mesh(box()).count_hits([[0.5, 0.5, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
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
        """The nodes and triangles that the search for each ray's closest hit tests, for heat maps.

        Arguments as for ``closest_hit``, but for ``t_error``. The counts are those of a ray that travels alone and goes
        to the nearest boxes first. Rays of one direction are traced together and test some more, at less cost.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import icosphere
        >>> steps = Octree.from_mesh(icosphere(4)).count_steps([[0, 0, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, 1]])
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
        rays, shape = check_rays(origins, directions, t_min, t_max)
        if leaving is None:
            expect(side is None, "side", "None without leaving", repr(side)[:40])
            return rays, shape
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
        """Whether each point lies inside the closed mesh, (...,) bool, exactly: no votes and no tolerance.

        points    (..., 3), finite
        boundary  the answer for points on the surface itself, which is told exactly too
        rule      "nonzero": inside where the surface winds around the point, so solids may overlap. "even-odd": inside
                  where a way out crosses the surface an odd number of times, however its faces are turned
        winding   for a mesh with holes: inside where ``winding_number``, to rounding, is above 1/2, so faces are to be
                  counter-clockwise seen from outside. ``rule`` stays as it is

        The mesh is closed where each edge is passed as often in one direction as in the other ("nonzero") or an even
        number of faces has it ("even-odd"), vertices told apart by position. The answer is that of real arithmetic for
        the float64 coordinates given, and the same bits for any number of threads. Raises ``ValueError`` for points
        that are not finite, with the row, and for a mesh that is not closed, with its open edges, unless ``winding``.

        Source: Shewchuk, Adaptive Precision Floating-Point Arithmetic, 1997, for the signs.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree.from_mesh(box())
        >>> octree.contains([[0.5, 0.5, 0.5], [1, 0.5, 0.5], [2, 0, 0]])
        array([ True,  True, False])
        >>> octree.contains([[0.5, 0.5, 0.5], [1, 0.5, 0.5], [2, 0, 0]], boundary=False)
        array([ True, False, False])
        >>> lidless = Octree(box().vertices, box().faces[:-2])
        >>> lidless.contains([[0.5, 0.5, 0.5], [1, 0.5, 0.5], [2, 0, 0]], winding=True)
        array([ True,  True, False])
        """
        mesh, tree = self._built
        return contains(tree, mesh, points, boundary, rule, winding, self.threads)

    def winding_number(self, points: ArrayLike, tolerance: float = 1e-3) -> NDArray[np.float64]:
        """The number of times that the surface winds around each point, (...,) float64: its solid angles over 4 pi.

        points     (..., 3), finite
        tolerance  the largest error, from 0, which sums over all faces. Looser is faster

        Inside a closed mesh whose faces are counter-clockwise seen from outside it is 1, outside 0, and where solids
        overlap their number. With holes it is a number between, and it falls from side to side of each face by 1. On a
        face it is the mean of both sides. The error is bounded, not estimated: faces far away count together, as long
        as what that may leave out stays below the tolerance. Rounding adds 2^-44 at most for each face that counts
        alone. The same bits for any number of threads; those of ``BruteForce``, which sums over all faces, differ by
        the tolerance. Raises ``ValueError`` naming argument and row. The first call takes some time to sum up the faces
        of each octant, and a point some milliseconds whose coordinates, or the mesh's, are as unlike as 1 and 2^-300.

        Sources: Jacobson et al., Robust Inside-Outside Segmentation, 2013; Barill et al., Fast Winding Numbers, 2018.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> lidless = Octree(box((-1, -1, -1), (1, 1, 1)).vertices, box().faces[:-2])
        >>> lidless.winding_number([[0, 0, 0], [0, 0, 3]], tolerance=1e-9).round(4)
        array([0.8333, 0.0641])
        """
        mesh, tree = self._built
        return winding_number(tree, mesh, points, tolerance, self.threads)

    def closest_point(self, points: ArrayLike, max_distance: ArrayLike = np.inf) -> ClosestPoints:
        """The point of the surface that is nearest to each point; equal distances: the lowest face.

        points        (..., 3), finite
        max_distance  >= 0, one number or (...): nothing is found beyond it, and the search ends sooner

        The distance is the exact one, rounded: within an ulp of it. Nearer to the surface than 2^-64 of the distance to
        the face's farthest corner it is within 2^-90 of that. It is 0 on the surface, and else only nearer to it than
        2^-900 of that. The same bits for any number of threads. Raises ``ValueError`` naming argument and row, and for
        a mesh without faces.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> near = Octree.from_mesh(box()).closest_point([[0.5, 0.5, 3], [0.5, 0.5, 0.75]])
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
        """The distance of each point from the surface of the closed mesh, (...) float64: positive OUTSIDE, negative
        inside, exactly 0 on it.

        As Open3D and libigl have it; trimesh has the other sign. The distance is that of ``closest_point``, the sign
        that of ``contains``, never that of the nearest normal. Arguments and errors as for these; beyond
        ``max_distance`` it is inf or -inf.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree.from_mesh(box()).signed_distance([[0.5, 0.5, 3], [0.5, 0.5, 0.75], [1, 1, 1]])
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
        """Whether nothing lies between each point and its target, (...) bool; the shapes of both are broadcast.

        points, targets    (..., 3), finite
        leaving, reaching  the faces that the points and the targets lie on, one or (...), -1 where that is not known:
                           then it is found out

        No end hides itself: the faces that hold it, those at an edge or corner too, hide nothing. What is nearer to an
        end, along the way, than 2^-40 of the largest coordinate of both is not looked at, unless the end lies on the
        surface. A surface that the way only touches hides. Raises ``ValueError`` naming argument and row.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree.from_mesh(box())
        >>> octree.visible([0.5, 0.5, 3], [[0.5, 0.5, 1], [0.5, 0.5, 0], [3, 0.5, 3]])
        array([ True, False,  True])
        """
        mesh, tree = self._built
        return visible(tree, mesh, (points, targets), (leaving, reaching), self.threads)
