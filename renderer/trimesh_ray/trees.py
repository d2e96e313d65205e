"""The octree of a ``trimesh.Trimesh``, kept as long as the mesh lives and its content stays."""

import weakref
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from renderer.octree import Octree


class _Kept(NamedTuple):
    """A tree, the mesh it was built for, and the digest of the mesh's content at that time."""

    mesh: "weakref.ref[Any]"
    digest: int
    octree: "Octree"


# By the mesh's id; and trees in use by the content's digest, so that a copy of a mesh needs no tree of its own.
_kept: dict[int, _Kept] = {}
_by_digest: "weakref.WeakValueDictionary[int, Octree]" = weakref.WeakValueDictionary()


def octree_of(mesh: Any) -> "Octree":
    """The octree of a mesh as it is now: built when first asked for, and again after an edit."""
    key, digest = id(mesh), hash(mesh)
    kept = _kept.get(key)
    if kept is not None and kept.digest == digest and kept.mesh() is mesh:
        return kept.octree
    octree = _shared(mesh, digest)
    own = weakref.ref(mesh, lambda gone: _forget(key, gone))
    _kept[key] = _Kept(own, digest, octree)
    return octree


def _shared(mesh: Any, digest: int) -> "Octree":
    """A tree of a mesh with the same content, or a new one."""
    # Late, so that a mesh whose rays are never asked imports no compiler.
    from renderer.octree import Octree

    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    found = _by_digest.get(digest)
    # A digest is no proof.
    if found is not None and np.array_equal(found.mesh.vertices, vertices) and np.array_equal(found.mesh.faces, faces):
        return found
    octree = _by_digest[digest] = Octree(vertices, faces)
    return octree


def _forget(key: int, gone: "weakref.ref[Any]") -> None:
    kept = _kept.get(key)
    # Another mesh may have that id by now.
    if kept is not None and kept.mesh is gone:
        del _kept[key]
