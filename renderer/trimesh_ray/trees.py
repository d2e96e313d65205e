"""The octree of a ``trimesh.Trimesh``, kept as long as the mesh lives and its content stays."""

import weakref
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.lazy import lazy
from renderer.mesh.mesh import face_normals
from renderer.trimesh_ray.distinct import distinct_faces, placed_faces
from renderer.trimesh_ray.facing import Rings, rings_of
from renderer.trimesh_ray.solid import solid_faces

if TYPE_CHECKING:
    from renderer.octree import Octree

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Traced:
    """The octree over a mesh's faces that count, and which of the mesh's they are.

    octree           its vertices that are not finite are at 0; no face has one
    rows             (k,) the mesh's face for each of the octree's; None where they are the same
    vertices, faces  the mesh's at that time
    """

    def __init__(self, vertices: Floats, faces: Integers) -> None:
        # Late, so that a mesh whose rays are never asked imports no compiler.
        from renderer.octree import Octree

        # trimesh takes numbers from the end, too.
        known = faces if not len(faces) or faces.min() >= 0 else np.where(faces < 0, faces + len(vertices), faces)
        self._placed = placed_faces(vertices, known)
        self._distinct = distinct_faces(vertices, known, self._placed)
        self.rows = None if len(self._distinct) == len(faces) else self._distinct
        finite = np.isfinite(vertices)
        there = vertices if finite.all() else np.where(finite, vertices, 0.0)
        self.octree: Octree = Octree(there, known if self.rows is None else known[self.rows])
        self._known = self.octree.mesh.faces if self.rows is None else known
        # The octree's copies, where it has all.
        self.vertices = self.octree.mesh.vertices if there is vertices else vertices.copy()
        self.faces = self._known if known is faces and self.rows is None else faces.copy()

    @lazy
    def solid(self) -> "Octree":
        """The octree over the faces that bound the inside."""
        from renderer.octree import Octree

        rows = solid_faces(self.octree.mesh.vertices, self._known, self._placed, self._distinct)
        return self.octree if rows is self._distinct else Octree(self.octree.mesh.vertices, self._known[rows])

    @lazy
    def bounds(self) -> Floats:
        """(2, 3): the least and the greatest corner of the faces that count. Other vertices are not looked at."""
        used = np.zeros(len(self.vertices), np.bool_)
        used[self._known[self._placed].ravel()] = True
        corners = self.octree.mesh.vertices[used]
        return np.stack([corners.min(axis=0, initial=np.inf), corners.max(axis=0, initial=-np.inf)])

    @lazy
    def rings(self) -> Rings:
        """The faces around the vertices."""
        return rings_of(self.octree.mesh.vertices, self._known, self._placed)

    @lazy
    def normals(self) -> Floats:
        """(f, 3) of all the mesh's faces."""
        return face_normals(self.octree.mesh.vertices[self._known])

    def named(self, faces: Integers) -> Integers:
        """The mesh's numbers of the octree's faces; -1 stays."""
        return faces if self.rows is None else np.where(faces >= 0, self.rows[faces], -1)


class _Kept(NamedTuple):
    """A tree, the mesh it was built for, and the digest of the mesh's content at that time."""

    mesh: "weakref.ref[Any]"
    digest: int
    traced: Traced


# By the mesh's id; and trees in use by the content's digest, so that a copy of a mesh needs no tree of its own.
_kept: dict[int, _Kept] = {}
_by_digest: "weakref.WeakValueDictionary[int, Traced]" = weakref.WeakValueDictionary()


def traced(mesh: Any) -> Traced:
    """The octree of a mesh, or of a scene's merged one, as it is now: built by the first query, again after an edit."""
    # Late, as above.
    from renderer.rayscene.scene import RayScene

    mesh = mesh.merged if isinstance(mesh, RayScene) else mesh
    key, digest = id(mesh), hash(mesh)
    kept = _kept.get(key)
    if kept is not None and kept.digest == digest and kept.mesh() is mesh:
        return kept.traced
    found = _shared(mesh, digest)
    own = weakref.ref(mesh, lambda gone: _forget(key, gone))
    _kept[key] = _Kept(own, digest, found)
    return found


def _shared(mesh: Any, digest: int) -> Traced:
    """A tree of a mesh with the same content, or a new one."""
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    found = _by_digest.get(digest)
    # A digest is no proof.
    same = found is not None and np.array_equal(found.vertices, vertices, equal_nan=True)
    if found is not None and same and np.array_equal(found.faces, faces):
        return found
    made = _by_digest[digest] = Traced(vertices, faces)
    return made


def _forget(key: int, gone: "weakref.ref[Any]") -> None:
    kept = _kept.get(key)
    # Another mesh may have that id by now.
    if kept is not None and kept.mesh is gone:
        del _kept[key]
