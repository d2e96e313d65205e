"""The answers of queries: closest hits, a row per ray, and all hits, in compressed rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh, face_normals
from renderer.results.attributes import Attributes

# The rows that are worked on at once, so that what is computed on the way stays in the caches.
_ROWS = 1 << 14


class Passage(NamedTuple):
    """Rays that have passed through faces: ``Hits.through`` makes it, ``leaving`` takes it.

    Attributes
    ----------
    face : ndarray of int64, shape (...)
        The faces.
    u, v : ndarray of float64, shape (...)
        The place on the face.
    side : ndarray of int64, shape (...), or None
        The side that the rays are on now; None if it is unknown.
    pile : ndarray of int64, shape (...)
        The first of the coinciding faces that the ray came upon, -1 for a miss.
    """

    face: NDArray[np.int64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    side: NDArray[np.int64] | None
    pile: NDArray[np.int64]


# Slots and not frozen: a call with one ray spends a third of its time on making objects.
@dataclass(eq=False, slots=True)
class Hits(Attributes):
    """Closest hits. Their shape (...) is that of the rays.

    Attributes
    ----------
    t : ndarray of float64, shape (...)
        Distance in units of ``|direction|``; inf on a miss.
    face : ndarray of int64, shape (...)
        The face that was hit; -1 on a miss. Select by ``hit`` before you index with it.
    u, v : ndarray of float64, shape (...)
        Barycentrics: the point is (1 - u - v) p0 + u p1 + v p2; nan on a miss.
    side : ndarray of int64, shape (...), or None
        The side of the face that the ray came from: 1 that of its normal, -1 the other; 0 on a miss.
    t_error : ndarray of float64, shape (...), or None
        How far rounding may have moved t; nan on a miss. None without ``t_error=True``.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> hits = Octree(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
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

    def through(self) -> Passage:
        """Return the same places for rays that go on through the faces: ``leaving=hits.through()``.

        A ray with ``leaving=hits`` starts on the side that the hit ray came from, as a reflected one does.

        Returns
        -------
        Passage

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree, down = Octree(box()), [[0.0, 0.0, -1.0]]
        >>> hits = octree.closest_hit([[0.5, 0.25, 3.0]], down)
        >>> octree.closest_hit(hits.points, down, leaving=hits.through()).t
        array([1.])
        """
        pile = self.face if self._pile is None else self._pile
        return Passage(self.face, self.u, self.v, None if self.side is None else -self.side, pile)

    def shaped(self, shape: tuple[int, ...]) -> Hits:
        """Return the same hits in another shape.

        Parameters
        ----------
        shape : tuple of int

        Returns
        -------
        Hits

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> hits = Octree(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
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

    def __getitem__(self, rows: Any) -> Hits:
        """The hits of some rays, by an index of an array of the hits' shape, such as ``hits[hits.hit]``.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree(box())
        >>> hits = octree.closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
        >>> hits[hits.hit].t
        array([2.])
        """
        t, face, u, v = self.t[rows], self.face[rows], self.u[rows], self.v[rows]
        t_error, side, pile = (None if a is None else a[rows] for a in (self.t_error, self.side, self._pile))
        return Hits(t, face, u, v, self._mesh, t_error, side, pile)

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Whether each ray hit a face, (...) bool.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).hit
        array([ True, False])
        """
        return self.face >= 0

    @property
    def points(self) -> NDArray[np.float64]:
        """The hit points, from the barycentrics, (..., 3) float64; nan on a miss.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).points
        array([[0.5 , 0.25, 1.  ],
               [ nan,  nan,  nan]])
        """
        return where_found(self.hit, points_on, self._mesh, self.face, self.u, self.v)

    @property
    def normals(self) -> NDArray[np.float64]:
        """The unit normals of the faces that were hit, by the right-hand rule, (..., 3) float64; nan on a miss.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).normals
        array([[ 0.,  0.,  1.],
               [nan, nan, nan]])
        """
        return where_found(self.hit, _normals, self._mesh, self.face)


@dataclass(eq=False, slots=True)
class AllHits(Attributes):
    """All hits of n rays, m in all, in compressed rows: those of ray i are the rows offsets[i] to offsets[i + 1].

    The hits of a ray are sorted by t, then by face.

    Attributes
    ----------
    offsets : ndarray of int64, shape (n + 1,)
        Where the hits of each ray begin; from 0 to m.
    t : ndarray of float64, shape (m,)
        Distance in units of ``|direction|``.
    face : ndarray of int64, shape (m,)
        The face that was hit.
    u, v : ndarray of float64, shape (m,)
        Barycentrics: the point is (1 - u - v) p0 + u p1 + v p2.
    t_error : ndarray of float64, shape (m,), or None
        How far rounding may have moved t. None without ``t_error=True``.
    side : ndarray of int64, shape (m,)
        The side of the face that the ray came from, as in ``Hits``.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> hits = Octree(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
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
        """The number of hits of each ray, in the shape of the rays, (...) int64.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).counts
        array([2, 0])
        """
        return np.diff(self.offsets).reshape(self._shape)

    @property
    def ray(self) -> NDArray[np.int64]:
        """The ray of each hit, (m,) int64. Rays of several dimensions are counted in C order.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).ray
        array([0, 0])
        """
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))

    @property
    def points(self) -> NDArray[np.float64]:
        """The hit points, from the barycentrics, (m, 3) float64.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).points
        array([[0.5 , 0.25, 1.  ],
               [0.5 , 0.25, 0.  ]])
        """
        return points_on(self._mesh, self.face, self.u, self.v)

    @property
    def normals(self) -> NDArray[np.float64]:
        """The unit normals of the faces that were hit, by the right-hand rule, (m, 3) float64.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).all_hits([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).normals
        array([[ 0.,  0.,  1.],
               [ 0.,  0., -1.]])
        """
        return _normals(self._mesh, self.face)


def where_found(
    found: NDArray[np.bool_], rows_of: Callable[..., NDArray[np.float64]], mesh: Mesh, *places: NDArray[Any]
) -> NDArray[np.float64]:
    """The rows (..., 3) that ``rows_of(mesh, *places)`` makes of what was found; nan elsewhere."""
    if found.all():
        return rows_of(mesh, *(place.reshape(-1) for place in places)).reshape(*found.shape, 3)
    values = np.full((*found.shape, 3), np.nan)
    values[found] = rows_of(mesh, *(place[found] for place in places))
    return values


def points_on(
    mesh: Mesh, face: NDArray[np.int64], u: NDArray[np.float64], v: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The points (k, 3) of faces at barycentrics u and v."""
    return _some_at_once(_some_points, mesh, face, u, v)


def _some_at_once(
    rows_of: Callable[..., NDArray[np.float64]], mesh: Mesh, *places: NDArray[Any]
) -> NDArray[np.float64]:
    """``rows_of(mesh, *places)``, _ROWS at a time."""
    values = np.empty((len(places[0]), 3))
    for begin in range(0, len(values), _ROWS):
        some = slice(begin, begin + _ROWS)
        values[some] = rows_of(mesh, *(place[some] for place in places))
    return values


def _some_points(
    mesh: Mesh, face: NDArray[np.int64], u: NDArray[np.float64], v: NDArray[np.float64]
) -> NDArray[np.float64]:
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
    # Each face once, where that is less.
    if len(face) > len(mesh.faces):
        return mesh.face_normals().take(face, axis=0)
    return _some_at_once(_some_normals, mesh, face)


def _some_normals(mesh: Mesh, face: NDArray[np.int64]) -> NDArray[np.float64]:
    return face_normals(mesh.vertices[mesh.faces[face]])
