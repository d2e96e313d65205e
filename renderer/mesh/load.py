"""Mesh files: PLY, OBJ, STL and GLB in, PLY out."""

from __future__ import annotations

import os
import warnings
from codecs import BOM_UTF8
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from renderer.errors import MeshError, NoSuchMeshError
from renderer.mesh.glb import parse_glb
from renderer.mesh.mesh import Mesh, Repairs, RepairWarning
from renderer.mesh.obj import parse_obj
from renderer.mesh.ply import format_ply, parse_ply
from renderer.mesh.stl import parse_stl
from renderer.system.files import as_path, read_whole, write_atomically


def load_mesh(path: str | os.PathLike[str], name: str | None = None, *, repair: bool = False) -> Mesh:
    """Return the triangle mesh in a .ply, .obj, .stl or .glb file.

    Polygons are cut into triangles. Normals, colours and texture coordinates of vertices are kept; of GLB, colours only
    if a mesh has no material, and texture coordinates only if it has one. Groups and objects of OBJ, nodes of
    GLB and solids of STL are ``parts`` of the mesh. An STL file shares no vertices between its faces.

    Parameters
    ----------
    path : str or path
    name : str, optional
        The name of the mesh; by default that of the file, without its suffix.
    repair : bool, default False
        Leave out triangles that name a missing vertex or one that is not finite, as ``Mesh.repaired`` does, and issue a
        ``RepairWarning`` that counts them.

    Returns
    -------
    Mesh

    Raises
    ------
    FileNotFoundError
        If there is no such file. The error is a ``MeshError`` too.
    MeshError
        For a file that cannot be read: of another kind, malformed, truncated, without faces, with values that are not
        finite. The message names the file and the fault.

    Notes
    -----
    Polygons are cut by a fan from the first corner; concave ones by their ears. The fan stays, though it may be wrong,
    if a polygon touches or crosses itself, repeats a corner, has a hole by a bridge or more than 4096 corners, or is
    far from flat.

    Examples
    --------
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
    except FileNotFoundError as error:
        raise NoSuchMeshError(f"{path}: cannot be read: {error.strerror}") from error
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
    """Write ``mesh`` as binary little-endian PLY, as ``Mesh.save`` does."""
    write_atomically(path, lambda file: file.write(format_ply(mesh)))


_PARSERS: dict[str, Callable[[bytes, list[Repairs] | None], Mesh]] = {
    ".ply": parse_ply,
    ".obj": parse_obj,
    ".stl": parse_stl,
    ".glb": parse_glb,
}

# The suffixes of files that ``load_mesh`` reads.
MESH_SUFFIXES = tuple(_PARSERS)
