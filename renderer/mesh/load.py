"""Mesh files: PLY, OBJ, STL and GLB in, PLY out."""

from __future__ import annotations

import os
import warnings
from codecs import BOM_UTF8
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from renderer.errors import MeshError
from renderer.mesh.glb import parse_glb
from renderer.mesh.mesh import Mesh, Repairs, RepairWarning
from renderer.mesh.obj import parse_obj
from renderer.mesh.ply import format_ply, parse_ply
from renderer.mesh.stl import parse_stl
from renderer.system.files import as_path, read_whole, write_atomically


def load_mesh(path: str | os.PathLike[str], name: str | None = None, *, repair: bool = False) -> Mesh:
    """Read a triangle mesh from a .ply, .obj, .stl or .glb file.

    name : the mesh's name; by default the file's, without its suffix.
    repair : leave out the triangles that name a vertex that is not finite or an index out of range, keep the rest
        as ``Mesh.repaired`` does, and issue one ``RepairWarning`` that names the file and the counts.

    Polygons are cut into triangles: by a fan from the first corner, concave ones by their ears. The fan stays, though
    it may be wrong, where a polygon touches or crosses itself, repeats a corner, has a hole by a bridge, more than 4096
    corners, or strays from its plane. Normals, colours and texture coordinates of vertices are kept; of GLB, colours
    only where a mesh has no material, and texture coordinates only where it has one. Positions are float64 whatever the
    file holds. An STL file shares no vertices between its faces.

    Raises ``MeshError`` that names the file and the fault: not there, not a file, unknown suffix, malformed
    or truncated, no faces, a face index out of range, a face of fewer than three vertices, values that are
    not finite. With ``repair`` it is raised where no good face is left, and for faults that no repair mends.

    >>> from renderer import load_mesh
    >>> mesh = load_mesh("scenes/models/torus_knot.ply")
    >>> mesh.name, mesh.faces.shape, mesh.is_closed()
    ('torus_knot', (40000, 3), True)
    """
    try:
        path = as_path("path", path)
    except ValueError as error:
        raise MeshError(str(error)) from None
    if not isinstance(repair, bool):
        raise MeshError(f"repair: expected True or False, got {repair!r}")
    if path.suffix.lower() not in _PARSERS:
        raise MeshError(f"{path}: expected a suffix of {', '.join(_PARSERS)}, got {path.suffix!r}")
    try:
        content = read_whole(path)
    except OSError as error:
        raise MeshError(f"{path}: cannot be read: {error.strerror or error}") from error
    try:
        repairs: list[Repairs] | None = [] if repair else None
        mesh = parse_mesh(content, path.suffix.lower(), repairs)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from error
    if repairs and any(repairs):
        warnings.warn(f"{path}: {_total(repairs)}", RepairWarning, stacklevel=2)
    return replace(mesh, name=path.stem if name is None else name)


def parse_mesh(content: bytes, suffix: str, repairs: list[Repairs] | None = None) -> Mesh:
    """The mesh in a file's content; ``suffix`` is one of '.ply', '.obj', '.stl', '.glb'.

    repairs : a list to which the repairs are added that ``load_mesh`` makes with ``repair``, one per mesh of the file.

    Raises ``MeshError`` as ``load_mesh`` does, without the file's name.
    """
    # Some editors begin a text with a byte order mark, which is no part of it. In STL only its length tells what it is.
    if suffix != ".stl":
        content = content.removeprefix(BOM_UTF8)
    mesh = _PARSERS[suffix](content, repairs)
    if len(mesh.faces) == 0:
        raise MeshError(f"holds no good faces: {_total(repairs)}" if repairs and any(repairs) else "holds no faces")
    return mesh


def _total(repairs: list[Repairs]) -> Repairs:
    """All meshes' repairs as if they were one mesh's; only the counts mean something."""
    parts = ((r.dropped_faces, r.bad_vertices, r.kept_faces, r.bad_normals) for r in repairs)
    return Repairs(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def save_ply(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write ``mesh`` as binary little-endian PLY, with float32 positions where those are exact, else double.

    The file appears whole or not at all. Raises ``OSError`` where it cannot be written.
    """
    write_atomically(path, lambda file: file.write(format_ply(mesh)))


_PARSERS: dict[str, Callable[[bytes, list[Repairs] | None], Mesh]] = {
    ".ply": parse_ply,
    ".obj": parse_obj,
    ".stl": parse_stl,
    ".glb": parse_glb,
}

# The suffixes of files that ``load_mesh`` reads.
MESH_SUFFIXES = tuple(_PARSERS)
