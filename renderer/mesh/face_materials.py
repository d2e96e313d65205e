"""The material of each face of a mesh: rows of a tuple of materials, -1 for none."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import plain_argument, read_only
from renderer.errors import expect
from renderer.mesh.material import MeshMaterial

# Materials, and the row of each face's, (F,); the array is None where there are none.
Looks = tuple[tuple[MeshMaterial, ...], NDArray[np.int32] | None]


def checked_materials(materials: Any, face_materials: Any, faces: int) -> Looks:
    """The arguments of ``Mesh``, the array as a read-only copy. ``ValueError`` names the argument."""
    if not isinstance(materials, Iterable):
        raise ValueError(f"materials: expected a sequence of MeshMaterial, got {type(materials).__name__}")
    kept = tuple(materials)
    for row, material in enumerate(kept):
        good = isinstance(material, MeshMaterial)
        expect(good, "materials", "a sequence of MeshMaterial", f"{type(material).__name__} in row {row}")
    if face_materials is None:
        return kept, read_only(np.zeros(faces, np.int32)) if kept else None
    given = plain_argument("face_materials", face_materials)
    integers = given.dtype.kind in "iu" or not given.size
    expect(integers, "face_materials", "integers", f"dtype {given.dtype}")
    expect(given.shape == (faces,), "face_materials", f"shape ({faces},), a row a face", given.shape)
    outside = (given < -1) | (given >= len(kept))
    if outside.any():
        row = int(outside.argmax())
        raise ValueError(f"face_materials: expected -1 to {len(kept) - 1}, got {given[row]} in row {row}")
    return kept, read_only(np.array(given, np.int32)) if kept else None


def joined_materials(meshes: Sequence[tuple[tuple[MeshMaterial, ...], NDArray[np.int32] | None, int]]) -> Looks:
    """The materials of meshes that become one, equal ones once; of each mesh both and the number of its faces."""
    rows: dict[MeshMaterial, int] = {}
    found = []
    for materials, face_materials, faces in meshes:
        # The last is for -1.
        new = np.array([*(rows.setdefault(material, len(rows)) for material in materials), -1], np.int32)
        found.append(np.full(faces, -1, np.int32) if face_materials is None else new[face_materials])
    return (tuple(rows), read_only(np.concatenate(found))) if rows else ((), None)
