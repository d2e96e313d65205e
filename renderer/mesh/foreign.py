"""The arrays of meshes of other libraries, as ``trimesh.Trimesh`` has them. None is imported."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

# Computed anew, a vertex's normal differs by less after the mesh was moved; one that a file has as float32 by more.
_SAME_NORMAL = 1e-12


class TriangleMesh(Protocol):
    """An object with vertices (V, 3) and faces (F, 3), such as a ``trimesh.Trimesh``."""

    @property
    def vertices(self) -> Any:
        """(V, 3) numbers."""

    @property
    def faces(self) -> Any:
        """(F, 3) integers."""


def has_triangles(thing: object) -> bool:
    """Whether it has vertices and faces, and is no class that its instances have them of."""
    return not isinstance(thing, type) and hasattr(thing, "vertices") and hasattr(thing, "faces")


def attributes_of(geometry: Any) -> dict[str, Any]:
    """Normals, colours and texture coordinates of the vertices of a ``trimesh.Trimesh``, None where it has none."""
    # trimesh computes normals when they are first read; before, only those of the file or its maker are in the cache.
    cache = getattr(geometry, "_cache", ())
    visual: Any = getattr(geometry, "visual", None)
    colors = None
    if getattr(visual, "kind", None) == "vertex":
        colors = (np.asarray(visual.vertex_colors)[:, :3] / 255).astype(np.float32)
    return {
        "normals": geometry.vertex_normals if "vertex_normals" in cache else None,
        "colors": colors,
        "texcoords": getattr(visual, "uv", None),
    }


def has_own_normals(geometry: Any, normals: Any) -> bool:
    """Whether normals of a ``trimesh.Trimesh`` are other than those that it computes from its faces."""
    computed = type(geometry)(vertices=geometry.vertices, faces=geometry.faces, process=False).vertex_normals
    return np.shape(normals) != computed.shape or not np.allclose(normals, computed, rtol=0.0, atol=_SAME_NORMAL)
