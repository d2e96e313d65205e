"""Hits on a scene: which object, which of its instances, and which face of its mesh."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.lazy import lazy
from renderer.mesh.mesh import Mesh, face_normals
from renderer.mesh.values import Owner, interpolated
from renderer.rayscene.built import BuiltScene, Located
from renderer.results.attributes import PlacesOnFaces, Values
from renderer.results.closest_points import ClosestPoints
from renderer.results.hits import AllHits, Hits, Passage


class _Places(PlacesOnFaces):
    """Places on faces of a scene, ``(...)`` or ``(m,)``."""

    # The arrays that ``repr`` shows first, as that of an octree's hits does.
    _own: tuple[str, ...] = ("t", "side", "t_error")

    def __init__(self, found: Hits | AllHits | ClosestPoints, scene: BuiltScene) -> None:
        self._found, self._scene = found, scene

    def __repr__(self) -> str:
        names = (*self._own, "object", "instance", "face", "u", "v")
        return f"{type(self).__name__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    @lazy
    def _at(self) -> Located:
        # Computed when it is read: many queries read t alone.
        return self._scene.located(self._found.face, self._found.u, self._found.v)

    @property
    def object(self) -> NDArray[np.int64]:
        """The objects, as ``RayScene.add`` numbers them, (...) int64; -1 on a miss.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 3)])
        >>> scene.closest_hit([[3.5, 0.25, 9], [9, 9, 9]], [0, 0, -1]).object
        array([ 0, -1])
        """
        return self._at.object

    @property
    def instance(self) -> NDArray[np.int64]:
        """The instance of the object, (...) int64; -1 on a miss.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 3)])
        >>> scene.closest_hit([[3.5, 0.25, 9], [9, 9, 9]], [0, 0, -1]).instance
        array([ 1, -1])
        """
        return self._at.instance

    @property
    def face(self) -> NDArray[np.int64]:  # type: ignore[override]  # computed when it is read
        """The faces of the objects' meshes, (...) int64; -1 on a miss.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 3)])
        >>> scene.closest_hit([[3.5, 0.25, 9], [9, 9, 9]], [0, 0, -1]).face
        array([10, -1])
        """
        return self._at.face

    @property
    def u(self) -> NDArray[np.float64]:
        """Barycentrics on the mesh: the point is (1 - u - v) p0 + u p1 + v p2, placed, (...) float64; nan on a miss.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 3)])
        >>> scene.closest_hit([[3.5, 0.25, 9], [9, 9, 9]], [0, 0, -1]).u
        array([0.25,  nan])
        """
        return self._at.u

    @property
    def v(self) -> NDArray[np.float64]:
        """The weight of the third corner, see ``u``, (...) float64; nan on a miss.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 3)])
        >>> scene.closest_hit([[3.5, 0.25, 9], [9, 9, 9]], [0, 0, -1]).v
        array([0.25,  nan])
        """
        return self._at.v

    @property
    def points(self) -> NDArray[np.float64]:
        """The hit points in the world, from the barycentrics, (..., 3) float64; nan on a miss.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> lifted = scene.add(box(), transforms=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5]])
        >>> scene.closest_hit([0.5, 0.25, 9], [0, 0, -1]).points
        array([0.5 , 0.25, 6.  ])
        """
        return self._on_hits(self._points, (3,))

    @property
    def normals(self) -> NDArray[np.float64]:
        """The unit normals of the faces in the world, by the right-hand rule, (..., 3) float64; nan on a miss.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.closest_hit([0.5, 0.25, 9], [0, 0, -1]).normals
        array([0., 0., 1.])
        """
        return self._on_hits(lambda hit: face_normals(self._scene.corners(self._found.face[hit])), (3,))

    def _points(self, hit: NDArray[np.bool_]) -> NDArray[np.float64]:
        found = self._found
        corners, u, v = self._scene.corners(found.face[hit]), found.u[hit], found.v[hit]
        points: NDArray[np.float64] = (1.0 - u - v)[:, None] * corners[:, 0]
        points += u[:, None] * corners[:, 1]
        points += v[:, None] * corners[:, 2]
        return points

    def _on_hits(self, values: Callable[[NDArray[np.bool_]], NDArray[np.float64]], row: tuple[int, ...]) -> Any:
        """An array of the values at hits, and nan elsewhere."""
        hit = self._found.face >= 0
        found = np.full((*hit.shape, *row), np.nan)
        found[hit] = values(hit)
        return found

    def interpolate(self, values: Values, *, on: Owner | None = None) -> NDArray[np.float64]:
        """Return values of the meshes at the hits: interpolated between vertices, or those of the faces.

        Parameters
        ----------
        values : array_like, or dict of int to array_like
            For each object its values, as ``Hits.interpolate`` takes them; hits on other objects get nan. An array is
            that of the only object.
        on : {"vertices", "faces"}, optional
            What the values belong to. Needed only if a mesh has as many vertices as faces.

        Returns
        -------
        ndarray of float64, shape (..., ...)
            The shape of the hits, then that of a row; nan on a miss.

        Raises
        ------
        ValueError
            For values that fit no object, or rows of different shapes.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> hits = scene.closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
        >>> hits.interpolate({cube: box().vertices[:, 0]})
        array([0.5, nan])
        """
        meshes = {member.id: member.built.mesh for member in self._scene.members}
        given = _by_object(values, meshes)
        found: NDArray[np.float64] | None = None
        for object_, rows in given.items():
            own = self.object == object_
            at = interpolated(meshes[object_], self.face[own], self.u[own], self.v[own], rows, on)
            if found is None:
                found = np.full((*self.face.shape, *at.shape[1:]), np.nan)
            expect(found.shape[self.face.ndim :] == at.shape[1:], "values", "rows of one shape", f"{at.shape[1:]}")
            found[own] = at
        return np.full(self.face.shape, np.nan) if found is None else found

    def _vertex_values(self, name: str) -> Any:
        meshes = {member.id: member.built.mesh for member in self._scene.members}
        values = {id_: getattr(mesh, name) for id_, mesh in meshes.items()}
        return {id_: own for id_, own in values.items() if own is not None} or None


def _by_object(values: Values, meshes: dict[int, Mesh]) -> dict[int, Any]:
    """Values for each object."""
    if isinstance(values, Mapping):
        unknown = [key for key in values if key not in meshes]
        expect(not unknown, "values", f"objects of the scene, {sorted(meshes)}", unknown)
        return dict(values)
    expect(len(meshes) == 1, "values", "a dict of object to values, in a scene of several objects", "one array")
    return {next(iter(meshes)): values}


class ScenePassage(NamedTuple):
    """Rays that have passed through faces of a scene: ``SceneHits.through`` makes it, ``leaving`` takes it.

    Attributes
    ----------
    passage : Passage
        Of faces of the merged mesh.
    moment : str
        Which scene it was.
    """

    passage: Passage
    moment: str


class SceneHits(_Places):
    """Closest hits on a scene. Their shape (...) is that of the rays.

    Attributes
    ----------
    t : ndarray of float64, shape (...)
        Distance in units of ``|direction|``; inf on a miss.
    side : ndarray of int64, shape (...)
        The side of the face that the ray came from: 1 that of its normal, -1 the other; 0 on a miss.
    t_error : ndarray of float64, shape (...), or None
        How far rounding may have moved t; nan on a miss. None without ``t_error=True``.

    Examples
    --------
    >>> from renderer import RayScene
    >>> from renderer.mesh.shapes import box
    >>> scene = RayScene()
    >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 3)])
    >>> hits = scene.closest_hit([[0.5, 0.25, 3], [3.5, 0.25, 3], [9, 9, 9]], [0, 0, -1])
    >>> hits.object, hits.instance, hits.face
    (array([ 0,  0, -1]), array([ 0,  1, -1]), array([10, 10, -1]))
    """

    _found: Hits

    def __init__(self, hits: Hits, scene: BuiltScene) -> None:
        super().__init__(hits, scene)
        self.t, self.side, self.t_error = hits.t, hits.side, hits.t_error

    def __getitem__(self, rows: Any) -> SceneHits:
        """The hits of some rays, by an index of an array of the hits' shape, such as ``hits[hits.hit]``.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> hits = scene.closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
        >>> hits[hits.hit].object
        array([0])
        """
        return SceneHits(self._found[rows], self._scene)

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Whether each ray hit a face, (...) bool.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).hit
        array([ True, False])
        """
        return self._found.hit

    def through(self) -> ScenePassage:
        """Return the same places for rays that go on through the faces: ``leaving=hits.through()``.

        Returns
        -------
        ScenePassage

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> hits = scene.closest_hit([[0.5, 0.25, 3.0]], [[0, 0, -1]])
        >>> scene.closest_hit(hits.points, [[0, 0, -1]], leaving=hits.through()).t
        array([1.])
        """
        return ScenePassage(self._found.through(), self.moment)

    @property
    def moment(self) -> str:
        """The state of the scene that was hit: another name after each change.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> before = scene.closest_hit([0.5, 0.25, 3], [0, 0, -1]).moment
        >>> scene.show(cube)
        >>> before == scene.closest_hit([0.5, 0.25, 3], [0, 0, -1]).moment
        False
        """
        return self._scene.moment


class SceneAllHits(_Places):
    """All hits of n rays on a scene, m in all; those of ray i are the rows offsets[i] to offsets[i + 1].

    The hits of a ray are sorted by t, then by object, instance and face.

    Attributes
    ----------
    offsets : ndarray of int64, shape (n + 1,)
        Where the hits of each ray begin; from 0 to m.
    t, side, t_error
        As in ``SceneHits``, shape (m,).

    Examples
    --------
    >>> from renderer import RayScene
    >>> from renderer.mesh.shapes import box
    >>> scene = RayScene()
    >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, z]] for z in (0, 4)])
    >>> hits = scene.all_hits([[0.5, 0.25, 9], [5, 5, 5]], [0, 0, -1])
    >>> hits.t, hits.instance, hits.counts
    (array([4., 5., 8., 9.]), array([1, 1, 0, 0]), array([4, 0]))
    """

    _found: AllHits
    _own = ("offsets", "t", "side", "t_error")

    def __init__(self, hits: AllHits, scene: BuiltScene) -> None:
        super().__init__(hits, scene)
        self.offsets, self.t, self.side, self.t_error = hits.offsets, hits.t, hits.side, hits.t_error

    @property
    def counts(self) -> NDArray[np.int64]:
        """The number of hits of each ray, in the shape of the rays, (...) int64.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.all_hits([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).counts
        array([2, 0])
        """
        return self._found.counts

    @property
    def ray(self) -> NDArray[np.int64]:
        """The ray of each hit, (m,) int64. Rays of several dimensions are counted in C order.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.all_hits([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).ray
        array([0, 0])
        """
        return self._found.ray


class SceneClosestPoints(_Places):
    """The nearest point of a scene to each of some points. The shape (...) is that of the points.

    Attributes
    ----------
    distance : ndarray of float64, shape (...)
        inf if nothing is within ``max_distance``.

    Examples
    --------
    >>> from renderer import RayScene
    >>> from renderer.mesh.shapes import box
    >>> scene = RayScene()
    >>> cube = scene.add(box())
    >>> near = scene.closest_point([[0.5, 0.25, 3], [5, 5, 5]], max_distance=4)
    >>> near.distance, near.object
    (array([ 2., inf]), array([ 0, -1]))
    """

    _own = ("distance",)

    def __init__(self, near: ClosestPoints, scene: BuiltScene) -> None:
        super().__init__(near, scene)
        self.distance = near.distance
