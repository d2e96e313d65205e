"""Mesh files: PLY, OBJ, STL, GLB and glTF in, plain or compressed by gzip; PLY out."""

from __future__ import annotations

import gzip
import os
import re
import warnings
import zlib
from codecs import BOM_UTF8
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np

from renderer.errors import MeshError, NoSuchMeshError
from renderer.mesh.gltf import buffer_names, parse_gltf, placed_gltf
from renderer.mesh.mesh import Mesh, RepairWarning
from renderer.mesh.obj import parse_obj
from renderer.mesh.placements import Placed
from renderer.mesh.ply import format_ply, parse_ply
from renderer.mesh.reading import Reading
from renderer.mesh.stl import parse_stl
from renderer.system.files import as_path, read_whole, write_atomically

_GZIP = b"\x1f\x8b"
T = TypeVar("T")
FilePaths = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]


def load_mesh(
    path: str | os.PathLike[str] | bytes | BinaryIO,
    name: str | None = None,
    *,
    repair: bool = False,
    strict: bool = False,
) -> Mesh:
    """Return the triangle mesh in a .ply, .obj, .stl, .glb or .gltf file.

    Polygons are cut into triangles. Normals, colours and texture coordinates of vertices are kept. Groups and objects
    of OBJ, nodes of glTF and solids of STL are ``parts`` of the mesh. ``materials`` are those of glTF, of the MTL files
    that an OBJ file names, and the ``TextureFile`` of PLY; images are decoded when they are first read. An STL file
    shares no vertices between its faces. A ``RepairWarning`` names all else that the file has and the mesh has not.

    Parameters
    ----------
    path : str, path, bytes or binary file
        A file whose name ends in its kind, also before ``.gz``; or its content, whose first bytes say its kind.
    name : str, optional
        The name of the mesh; by default that of the file, without its suffix.
    repair : bool, default False
        Leave out triangles that name a missing vertex or one that is not finite, as ``Mesh.repaired`` does, and issue a
        ``RepairWarning`` that counts them.
    strict : bool, default False
        Raise an error in place of a warning.

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
    Polygons are cut by a fan from the first corner if that covers them, else by mapbox_earcut, also those that touch
    themselves or have a hole by a bridge. Those that cross themselves or are far from flat keep the fan, and are
    named by the warning.

    Examples
    --------
    >>> from renderer import load_mesh
    >>> mesh = load_mesh("scenes/models/torus_knot.ply")
    >>> mesh.name, mesh.faces.shape, mesh.is_closed()
    ('torus_knot', (40000, 3), True)
    """
    for argument, value in (("repair", repair), ("strict", strict)):
        if not isinstance(value, bool):
            raise MeshError(f"{argument}: expected True or False, got {value!r}")
    mesh, stem = _loaded(path, parse_mesh, Reading(repair), strict)
    return replace(mesh, name=stem if name is None else name)


def load_placed(path: str | os.PathLike[str]) -> list[Placed]:
    """The meshes in a file, each once, and where they stand: those of a glTF file's nodes, or the one of another file.

    ``Mesh.transformed`` places the triangles of ``load_mesh`` so. Raises ``MeshError`` and warns as that does.
    """
    placed, stem = _loaded(path, _parse_placed, Reading(), strict=False)
    return [each._replace(mesh=replace(each.mesh, name=each.mesh.name or stem)) for each in placed]


def _loaded(
    path: str | os.PathLike[str] | bytes | BinaryIO,
    parse: Callable[[bytes, str, Reading], T],
    reading: Reading,
    strict: bool,
) -> tuple[T, str]:
    """What is parsed of a file, and the file's name without its suffix. Warns of what was left out."""
    shown, suffix, content, reading.folder = _read(path)
    try:
        parsed = parse(content, suffix, reading)
    except MeshError as error:
        raise MeshError(f"{shown}: {error}") from error
    said = reading.said
    if said and strict:
        raise MeshError(f"{shown}: {said}")
    if said:
        warnings.warn(f"{shown}: {said}", RepairWarning, stacklevel=3)
    return parsed, "" if reading.folder is None else Path(str(shown).removesuffix(".gz")).stem


def _read(path: str | os.PathLike[str] | bytes | BinaryIO) -> tuple[object, str, bytes, Path | None]:
    """What messages call a file, the suffix of its kind, its content, and the folder where it lies."""
    given = path.read() if hasattr(path, "read") else path
    if given is not path or isinstance(given, bytes | bytearray | memoryview):
        if not isinstance(given, bytes | bytearray | memoryview):
            raise MeshError(f"path: expected a file opened as binary, got {type(given).__name__} from it")
        content = _unpacked(bytes(given))
        return "mesh", _kind(content), content, None
    try:
        file = as_path("path", path)
    except ValueError as error:
        raise MeshError(str(error)) from None
    suffix = mesh_suffix(file)
    if suffix is None:
        raise MeshError(f"{file}: expected a suffix of {', '.join(MESH_SUFFIXES)}, got {file.suffix!r}")
    try:
        content = read_whole(file)
    except FileNotFoundError as error:
        raise NoSuchMeshError(f"{file}: cannot be read: {error.strerror}") from error
    except OSError as error:
        raise MeshError(f"{file}: cannot be read: {error.strerror or error}") from error
    try:
        return file, suffix, _unpacked(content) if file.suffix.lower() == ".gz" else content, file.parent
    except MeshError as error:
        raise MeshError(f"{file}: {error}") from error


def mesh_suffix(path: Path) -> str | None:
    """The suffix of a mesh file's kind, of a compressed one that before ``.gz``; None for any other file."""
    last = path.suffix.lower()
    found = Path(path.stem).suffix.lower() if last == ".gz" else last
    return found if found in MESH_SUFFIXES else None


def mesh_paths(paths: FilePaths) -> list[Path]:
    """The files at one path or several; those of a folder are its mesh files, in the order of their names.

    A shell's ``*`` finds the same in a folder: files whose names begin with a dot, and folders, do not count. Raises
    ``MeshError`` if there is none.
    """
    given: Any = paths
    one = isinstance(given, str | bytes | os.PathLike) or not isinstance(given, Iterable)
    files = [file for path in ([given] if one else given) for file in _files_at(path)]
    if not files:
        raise MeshError("path: expected a string or path, got none of several")
    return files


def _files_at(path: object) -> list[Path]:
    try:
        found = as_path("path", path)
    except ValueError as error:
        raise MeshError(str(error)) from None
    if not os.path.isdir(found):  # which no name is too long for
        return [found]
    try:
        inside = sorted(each for each in found.iterdir() if not each.name.startswith("."))
    except OSError as error:
        raise MeshError(f"{found}: cannot be read: {error.strerror or error}") from error
    files = [each for each in inside if mesh_suffix(each) is not None and not each.is_dir()]
    if not files:
        raise MeshError(f"{found}: expected mesh files ({', '.join(MESH_SUFFIXES)}) in the folder, got none")
    return files


def buffer_files(path: Path) -> list[Path]:
    """The files of buffers that a mesh file names, none of which is read. Raises ``MeshError``."""
    if mesh_suffix(path) not in Y_UP:
        return []
    _, _, content, _ = _read(path)
    try:
        return [path.parent / name for name in buffer_names(content.removeprefix(BOM_UTF8))]
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from error


def _unpacked(content: bytes) -> bytes:
    """The content, of which gzip is known by its first bytes."""
    if content[:2] != _GZIP:
        return content
    try:
        return gzip.decompress(content)
    except (OSError, EOFError, zlib.error) as error:
        raise MeshError(f"malformed gzip: {str(error)[:80]}") from error


def _kind(content: bytes) -> str:
    """The suffix of a content's kind by its first bytes; OBJ, which begins in any way, where it is no other."""
    begin = content.removeprefix(BOM_UTF8)[:512].lstrip()
    if begin[:3] == b"ply" and begin[3:4].isspace():
        return ".ply"
    if begin[:4] == b"glTF":
        return ".glb"
    if begin[:1] == b"{":
        return ".gltf"
    words = any(re.match(rb"(v|vn|vt|f|o|g|mtllib|#)[ \t]", line) for line in begin.splitlines())
    return ".obj" if words and begin[:5].lower() != b"solid" else ".stl"


def parse_mesh(content: bytes, suffix: str, reading: Reading | None = None) -> Mesh:
    """The mesh in a file's content; ``suffix`` is one of MESH_SUFFIXES.

    Raises ``MeshError`` as ``load_mesh`` does, without the file's name.
    """
    reading, content = reading or Reading(), _unmarked(content, suffix)
    mesh = _PARSERS[suffix](content, reading)
    _expect_faces(len(mesh.faces), reading)
    return mesh


def _parse_placed(content: bytes, suffix: str, reading: Reading) -> list[Placed]:
    """The meshes in a file's content, see ``load_placed``."""
    if suffix not in Y_UP:
        return [Placed(parse_mesh(content, suffix, reading), np.eye(4)[None], ())]
    placed = placed_gltf(_unmarked(content, suffix), reading)
    _expect_faces(sum(len(each.mesh.faces) for each in placed), reading)
    return placed


def _unmarked(content: bytes, suffix: str) -> bytes:
    """The content without the byte order mark with which some editors begin a text, and which is no part of it."""
    # In STL only its length tells what it is.
    return content if suffix == ".stl" else content.removeprefix(BOM_UTF8)


def _expect_faces(count: int, reading: Reading) -> None:
    if count == 0:
        raise MeshError(f"holds no good faces: {reading.said}" if reading.said else "holds no faces")


def save_ply(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write ``mesh`` as binary little-endian PLY, as ``Mesh.save`` does."""
    write_atomically(path, lambda file: file.write(format_ply(mesh)))


_PARSERS: dict[str, Callable[[bytes, Reading], Mesh]] = {
    ".ply": parse_ply, ".obj": parse_obj, ".stl": parse_stl, ".glb": parse_gltf, ".gltf": parse_gltf,
}  # fmt: skip
# Of glTF, in which y points up by its specification.
Y_UP = (".glb", ".gltf")

# The suffixes of files that ``load_mesh`` reads.
MESH_SUFFIXES = tuple(_PARSERS)
