"""Reading Wavefront OBJ.

Own code, because trimesh takes index 0 for the last vertex, drops faces of two vertices and vertices that no
face uses (NaN among them), and reorders faces by material.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from renderer.errors import MeshError
from renderer.mesh import Mesh, Repairs, build_mesh

# Statements that say nothing about surfaces made of polygons. Free-form surfaces are refused, not dropped.
_IGNORED = {
    *("g", "o", "s", "l", "p", "mg", "vp", "usemtl", "mtllib", "usemap", "maplib"),
    *("bevel", "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj"),
}


@dataclass
class _Statements:
    keeps_bad_faces: bool
    positions: list[list[float]] = field(default_factory=list)
    colors: list[list[float]] = field(default_factory=list)
    texcoords: list[list[float]] = field(default_factory=list)
    normals: list[list[float]] = field(default_factory=list)
    # One (position, texcoord, normal) a corner, three corners a triangle; -1 where a corner has none, or, for
    # positions, where an index is out of range and bad faces are to be dropped.
    corners: list[tuple[int, int, int]] = field(default_factory=list)


def parse_obj(content: bytes, repairs: list[Repairs] | None = None) -> Mesh:
    """The mesh in an OBJ file's content.

    Polygons are cut into fans from their first corner, right for convex ones. A vertex is split where its
    faces differ in texture coordinate or normal. Where only some faces have texture coordinates, the others
    get (0, 0); where only some have normals, the normals are left out, since they follow from the faces.
    Vertex colours after the position are kept where every vertex has them. Lines, points, groups and
    materials are ignored. ``repairs`` as for ``build_mesh``; faces are then dropped for any index out of range.

    Raises ``MeshError`` with the line's number; it does not know the file's name.
    """
    statements = _Statements(keeps_bad_faces=repairs is not None)
    for number, line in _logical_lines(content.decode("utf-8", "replace")):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            if "_" in line and words[0] in ("v", "vt", "vn", "f"):  # Python takes 1_000 for a number
                raise ValueError(f"malformed number {next(word for word in words if '_' in word)!r}")
            _read_statement(words[0], words[1:], statements)
        except ValueError as error:
            raise MeshError(f"line {number}: {str(error)[:100]}, got {line.strip()[:80]!r}") from error
    return _mesh(statements, repairs)


def _logical_lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines and their numbers, those that end in a backslash joined to the next."""
    begun = ""
    # Not splitlines(), which also cuts at a form feed or a Unicode separator within a comment or name.
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        if line.endswith("\\"):
            begun += line[:-1] + " "
            continue
        yield number, begun + line
        begun = ""
    yield text.count("\n") + 1, begun


def _read_statement(keyword: str, words: list[str], statements: _Statements) -> None:
    match keyword:
        case "v":
            numbers = _numbers(words, 3)
            statements.positions.append(numbers[:3])
            if len(numbers) >= 6:
                statements.colors.append(numbers[3:6])
        case "vt":
            statements.texcoords.append([*_numbers(words, 1), 0.0][:2])
        case "vn":
            statements.normals.append(_numbers(words, 3)[:3])
        case "f":
            if len(words) < 3:
                raise ValueError("expected a face of at least 3 vertices")
            corners = [_corner(word, statements) for word in words]
            for second, third in pairwise(corners[1:]):
                statements.corners += corners[0], second, third
        case _ if keyword not in _IGNORED:
            raise ValueError("expected a statement of a polygon mesh")


def _numbers(words: list[str], least: int) -> list[float]:
    if len(words) < least:
        raise ValueError(f"expected at least {least} numbers")
    return [float(word) for word in words]


def _corner(word: str, statements: _Statements) -> tuple[int, int, int]:
    parts = word.split("/")
    if len(parts) > 3:
        raise ValueError("expected a corner like 1, 1/2, 1//3 or 1/2/3")
    position, texcoord, normal = [*parts, "", ""][:3]
    try:
        return (
            _index(int(position), len(statements.positions)),
            _index(int(texcoord), len(statements.texcoords)) if texcoord else -1,
            _index(int(normal), len(statements.normals)) if normal else -1,
        )
    except IndexError as error:
        if statements.keeps_bad_faces:
            return (-1, -1, -1)
        raise ValueError(str(error)) from error


def _index(index: int, count: int) -> int:
    """From 1 .. count, or -1 .. -count for the latest back to the first, to 0 .. count - 1."""
    if not 1 <= abs(index) <= count:
        raise IndexError(f"face index out of range: expected 1 to {count} or -{count} to -1")
    return index - 1 if index > 0 else count + index


def _mesh(statements: _Statements, repairs: list[Repairs] | None) -> Mesh:
    corners = np.array(statements.corners, np.int64).reshape(-1, 3)
    colors = statements.colors if len(statements.colors) == len(statements.positions) else None
    by_position = build_mesh(
        repairs,
        np.array(statements.positions, np.float64),
        corners[:, 0].reshape(-1, 3).astype(np.int32),
        colors=None if colors is None else np.array(colors, np.float64),
    )
    if repairs:
        corners = corners.reshape(-1, 9)[repairs[-1].kept_faces].reshape(-1, 3)
    if (corners[:, 1:] == -1).all():
        return by_position
    distinct, faces = np.unique(corners, axis=0, return_inverse=True)
    position, texcoord, normal = distinct.T
    normals, texcoords = None, None
    if (normal >= 0).all():
        normals = np.array(statements.normals)[normal]
    if (texcoord >= 0).any():
        # The row of zeros comes last, where -1 finds it.
        texcoords = np.array([*statements.texcoords, [0.0, 0.0]])[texcoord]
    return Mesh(
        by_position.vertices[position],
        faces.reshape(-1, 3).astype(np.int32),
        normals=normals,
        colors=None if by_position.colors is None else by_position.colors[position],
        texcoords=texcoords,
    )
