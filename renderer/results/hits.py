"""The answers of queries: closest hits, a row per ray, and all hits, in compressed rows."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh, face_normals


class Passage(NamedTuple):
    """Where rays have gone through faces: ``Hits.through`` makes it, ``leaving`` takes it.

    face  (...) int64
    u, v  (...) float64, the place on the face
    side  (...) int64, the side that the rays are on now; None where it is not known
    pile  (...) int64, the face at which they came upon those that coincide there
    """

    face: NDArray[np.int64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    side: NDArray[np.int64] | None
    pile: NDArray[np.int64]


# Slots and not frozen: a call with one ray spends a third of its time on making objects.
@dataclass(eq=False, slots=True)
class Hits:
    """Closest hits; their dimensions are those of the rays.

    t     (...) float64, in units of |direction|; inf on a miss
    face  (...) int64; -1 on a miss
    u, v  (...) float64, P = (1 - u - v) p0 + u p1 + v p2; nan on a miss

    side  (...) int64, the side of the face that the ray came from: 1 that of its normal by winding, -1 the other one; 0
          on a miss; None for hits that no query made

    t_error  (...) float64, how far rounding may have moved t, nan on a miss; None unless it was asked for

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> hits = Octree.from_mesh(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
    >>> hits.t, hits.face, hits.u
    (array([ 2., inf]), array([10, -1]), array([0.25,  nan]))
    """

    t: NDArray[np.float64]
    face: NDArray[np.int64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    _mesh: Mesh = field(repr=False)
    t_error: NDArray[np.float64] | None = None
    side: NDArray[np.int64] | None = None
    _pile: NDArray[np.int64] | None = field(default=None, repr=False)

    def through(self) -> "Passage":
        """The same places, for rays that go on through the faces: ``leaving=hits.through()``.

        A ray with ``leaving=hits`` starts on the side that the hit ray came from, as a reflected one does.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree, down = Octree.from_mesh(box()), [[0.0, 0.0, -1.0]]
        >>> hits = octree.closest_hit([[0.5, 0.25, 3.0]], down)
        >>> octree.closest_hit(hits.points, down, leaving=hits.through()).t
        array([1.])
        """
        pile = self.face if self._pile is None else self._pile
        return Passage(self.face, self.u, self.v, None if self.side is None else -self.side, pile)

    def shaped(self, shape: tuple[int, ...]) -> "Hits":
        """The same hits in other dimensions.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree.from_mesh(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.shaped((2, 1)).t.tolist()
        [[2.0], [inf]]
        """
        if self.t.shape == shape:
            return self
        t, u, v = (values.reshape(shape) for values in (self.t, self.u, self.v))
        # rule: bounds-in-shape
        t_error = None if self.t_error is None else self.t_error.reshape(shape)
        side = None if self.side is None else self.side.reshape(shape)
        pile = None if self._pile is None else self._pile.reshape(shape)
        return Hits(t, self.face.reshape(shape), u, v, self._mesh, t_error, side, pile)

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Whether each ray hit a face, (...) bool.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree.from_mesh(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.hit
        array([ True, False])
        """
        return self.face >= 0

    @property
    def points(self) -> NDArray[np.float64]:
        """Hit points from the barycentrics, (..., 3) float64; nan on a miss.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree.from_mesh(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.points
        array([[0.5 , 0.25, 1.  ],
               [ nan,  nan,  nan]])
        """
        points = np.full((*self.face.shape, 3), np.nan)
        hit = self.hit
        points[hit] = points_on(self._mesh, self.face[hit], self.u[hit], self.v[hit])
        return points

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit geometric normals by the faces' winding, (..., 3) float64; nan on a miss.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree.from_mesh(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.normals
        array([[ 0.,  0.,  1.],
               [nan, nan, nan]])
        """
        normals = np.full((*self.face.shape, 3), np.nan)
        hit = self.hit
        normals[hit] = _normals(self._mesh, self.face[hit])
        return normals


@dataclass(eq=False, slots=True)
class AllHits:
    """All hits of n rays, m in all, in compressed rows: those of ray i are the rows offsets[i] to offsets[i + 1].

    The rows of a ray are sorted by t, then face.

    offsets  (n + 1,) int64, from 0 to m
    t        (m,) float64, in units of |direction|
    face     (m,) int64
    u, v     (m,) float64, P = (1 - u - v) p0 + u p1 + v p2
    t_error  (m,) float64, how far rounding may have moved t; None unless it was asked for
    side     (m,) int64, the side of the face that the ray came from, as of ``Hits``

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> hits = Octree.from_mesh(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
    >>> begin, end = hits.offsets[:2]
    >>> hits.t[begin:end], hits.face[begin:end]
    (array([2., 3.]), array([10,  9]))
    """

    offsets: NDArray[np.int64]
    t: NDArray[np.float64]
    face: NDArray[np.int64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    _mesh: Mesh = field(repr=False)
    _shape: tuple[int, ...] = field(repr=False)
    t_error: NDArray[np.float64] | None = None
    side: NDArray[np.int64] | None = None

    @property
    def counts(self) -> NDArray[np.int64]:
        """The number of hits of each ray, in the dimensions of the rays, (...) int64.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree.from_mesh(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.counts
        array([2, 0])
        """
        return np.diff(self.offsets).reshape(self._shape)

    @property
    def ray(self) -> NDArray[np.int64]:
        """The ray of each hit, (m,) int64: its row, where rays of several dimensions are counted in C order.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree.from_mesh(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.ray
        array([0, 0])
        """
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))

    @property
    def points(self) -> NDArray[np.float64]:
        """Hit points from the barycentrics, (m, 3) float64.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree.from_mesh(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.points
        array([[0.5 , 0.25, 1.  ],
               [0.5 , 0.25, 0.  ]])
        """
        return points_on(self._mesh, self.face, self.u, self.v)

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit geometric normals by the faces' winding, (m, 3) float64.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree.from_mesh(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.normals
        array([[ 0.,  0.,  1.],
               [ 0.,  0., -1.]])
        """
        return _normals(self._mesh, self.face)


def points_on(
    mesh: Mesh, face: NDArray[np.int64], u: NDArray[np.float64], v: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The points (k, 3) of faces at barycentrics u and v."""
    corners, vertices = mesh.faces.take(face, axis=0), mesh.vertices
    # Corner by corner and in place: a third of the time of one sum of all.
    points = vertices.take(corners[:, 0], axis=0)
    points *= (1.0 - u - v)[:, None]
    for k, weight in ((1, u), (2, v)):
        other = vertices.take(corners[:, k], axis=0)
        other *= weight[:, None]
        points += other
    return points


def _normals(mesh: Mesh, face: NDArray[np.int64]) -> NDArray[np.float64]:
    return face_normals(mesh.vertices[mesh.faces[face]])
