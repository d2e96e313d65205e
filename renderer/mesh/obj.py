"""Reading Wavefront OBJ.

Own code, because trimesh takes index 0 for the last vertex, drops faces of two vertices and vertices that no
face uses (NaN among them), and reorders faces by material.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MeshError
from renderer.mesh.mesh import Float64Array, Mesh, give_materials, give_parts
from renderer.mesh.mtl import rest_of
from renderer.mesh.obj_materials import Looks, materials_of
from renderer.mesh.parts import Part, runs_of
from renderer.mesh.polygons import triangulate
from renderer.mesh.reading import Reading, in_utf8

# Statements that say nothing about surfaces.
_IGNORED = {
    *("g", "o", "s", "l", "p", "mg", "vp", "bevel", "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj"),
}
_OF_MATERIALS = ("usemtl", "mtllib")
# Those that have no place in a mesh, and what a note calls them.
_LEFT_OUT = dict.fromkeys(("usemap", "maplib"), "texture maps of the OBJ file itself") | dict.fromkeys(
    ("cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "end", "con",
     "ctech", "stech"), "free-form curves and surfaces"
)  # fmt: skip


@dataclass(frozen=True)
class _Content:
    """The content of a file, from either reader."""

    positions: Float64Array  # (V, 3)
    colors: Float64Array | None  # (V, 3)
    texcoords: Float64Array  # (T, 2)
    normals: Float64Array  # (N, 3)
    # (C, 3): position, texcoord and normal of each corner; -1 where a corner has none, or, for positions, where an
    # index is out of range and bad faces are to be dropped.
    corners: NDArray[np.int64]
    starts: NDArray[np.int64]  # polygon p has corners[starts[p] : starts[p + 1]]
    groups: list[_Group]
    looks: Looks
    left_out: set[str]  # keywords of statements that have no place in a mesh


class _Group(NamedTuple):
    """A statement ``g`` or ``o``: the name that it gives to the polygons from this one on."""

    first: int
    name: str


def parse_obj(content: bytes, reading: Reading | None = None) -> Mesh:
    """The mesh in an OBJ file's content.

    Polygons are cut as ``polygons.triangulate`` says. A face may stand before what it names; a negative index counts
    back from what stands before the face. A vertex is split where its faces differ in texture coordinate or normal.
    Where only some faces have texture coordinates, the others get (0, 0); where only some have normals, the normals
    are left out, since they follow from the faces. Vertex colours after the position are kept where every vertex has
    them. The last ``g`` or ``o`` before a face names its part, the last ``usemtl`` its material, which ``mtllib`` files
    beside the file describe. Lines and points are ignored. What else is left out is noted: free-form surfaces, unknown
    statements, indices of normals and texture coordinates that name nothing, faces of fewer than three corners.

    Raises ``MeshError`` with the line's number; it does not know the file's name.
    """
    reading = reading or Reading()
    content = in_utf8(content)
    read = _read_common(content)
    read = _read_any(content, reading) if read is None else read
    for what in sorted({_LEFT_OUT[keyword] for keyword in read.left_out}):
        reading.note(f"left out: {what}")
    return _mesh(read, reading)


def _parts(content: _Content, polygons: NDArray[np.int64], reading: Reading) -> tuple[Part, ...]:
    """The parts that groups make; ``polygons`` has that of each triangle."""
    firsts = np.array([*(group.first for group in content.groups), len(content.starts) - 1], np.int64)
    ends = np.searchsorted(polygons, firsts)
    return runs_of(["", *(group.name for group in content.groups)], reading.kept(ends))


def _mesh(content: _Content, reading: Reading) -> Mesh:
    cut = triangulate(content.positions, content.corners[:, 0], content.starts)
    reading.cut((cut.wrong + 1).tolist(), "the number of the face")
    mesh = _split(content, content.corners[cut.places.ravel()], reading)
    if content.looks.uses or content.looks.libraries:
        kept = reading.repairs[-1].kept_faces if reading.repairs else None
        give_materials(mesh, *materials_of(content.looks, cut.polygons, reading), kept)
    return give_parts(mesh, _parts(content, cut.polygons, reading))


def _split(content: _Content, corners: NDArray[np.int64], reading: Reading) -> Mesh:
    """The mesh of the triangles' corners, its vertices split where texture coordinates or normals differ."""
    positions, colors = content.positions, content.colors
    if colors is not None and not np.isfinite(colors).all():
        reading.note("left out: vertex colours that are not numbers")
        colors = None
    by_position = reading.mesh(positions, corners[:, 0].reshape(-1, 3).astype(np.int32), colors=colors)
    if reading.repairs:
        corners = corners.reshape(-1, 9)[reading.repairs[-1].kept_faces].reshape(-1, 3)
    if (corners[:, 1:] == -1).all():
        return by_position
    distinct, faces = distinct_rows(corners, len(positions))
    position, texcoord, normal = distinct.T
    normals, texcoords = None, None
    # rule: all-have-normals
    if (normal >= 0).all():
        normals = content.normals[normal]
    if (texcoord >= 0).any():
        # The row of zeros comes last, where -1 finds it.
        texcoords = np.concatenate([content.texcoords, [[0.0, 0.0]]])[texcoord]
    return Mesh(
        by_position.vertices[position],
        faces.reshape(-1, 3).astype(np.int32),
        normals=normals,
        colors=None if by_position.colors is None else by_position.colors[position],
        texcoords=texcoords,
    )


def distinct_rows(corners: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The distinct rows in rising order, and each corner's row among them, for positions below ``count``."""
    position = corners[:, 0]
    row_of = np.full(count, -1)
    row_of[position] = np.arange(len(corners))
    if (corners[row_of[position]] == corners).all():  # no vertex is split: no need to sort
        used = row_of >= 0
        return corners[row_of[used]], (np.cumsum(used) - 1)[position]
    distinct, inverse = np.unique(corners, axis=0, return_inverse=True)
    return distinct, inverse.ravel()


# --- files of the common shape: all lines of a keyword at once ------------------------------------------------


def _read_common(content: bytes) -> _Content | None:
    """The content of a file of the common shape without faults, equal to that of ``_read_any``; None for any other.

    Left to ``_read_any`` are faults of any kind; lines that end in a backslash or a bare carriage return, that begin
    with a blank, or that differ in the number of values after ``v``, ``vt`` or ``vn``; and corners that are negative,
    or not of one form throughout.
    """
    if content.count(b"\r") != content.count(b"\r\n") or re.search(rb"\\(\r|\n|\Z)", content):
        return None
    found = _blocks(content + b"\n")
    if found is None or not found[0]["v"] or not found[0]["f"]:
        return None
    blocks, groups, looks, left_out = found
    try:
        position = _table(blocks["v"], b"v", 3)
        texcoord = _table(blocks["vt"], b"vt", 1)
        normal = _table(blocks["vn"], b"vn", 3)
    except ValueError:
        return None
    faces = _faces(blocks["f"], [len(position), len(texcoord), len(normal)])
    if faces is None:
        return None
    colors = position[:, 3:6] if position.shape[1] >= 6 else None
    texcoord = np.pad(texcoord, ((0, 0), (0, 1)))[:, :2]
    return _Content(
        np.ascontiguousarray(position[:, :3]), colors, texcoord, normal[:, :3], *faces, groups, looks, left_out
    )


def _blocks(content: bytes) -> tuple[dict[str, bytes], list[_Group], Looks, set[str]] | None:
    """All lines of each keyword that matters, end to end; groups; materials; and the keywords of what is left out. None
    if any other line is not certain to be ignored.
    """
    letters = np.frombuffer(content, np.uint8)
    ends = np.flatnonzero(letters == ord("\n")) + 1
    starts = np.concatenate([[0], ends[:-1]])
    first, second, third = (letters[np.minimum(starts + k, ends - 1)] for k in range(3))
    blank, blank_third = ((letter == ord(" ")) | (letter == ord("\t")) for letter in (second, third))
    is_vertex = first == ord("v")
    rows = {
        "v": is_vertex & blank,
        "vt": is_vertex & (second == ord("t")) & blank_third,
        "vn": is_vertex & (second == ord("n")) & blank_third,
        "f": (first == ord("f")) & blank,
    }
    rest = ~np.logical_or.reduce([*rows.values(), first == ord("#"), first == ord("\n")])
    groups, looks, left_out, before = [], Looks(), set(), np.cumsum(rows["f"])
    for start, end, polygons in zip(starts[rest].tolist(), ends[rest].tolist(), before[rest].tolist(), strict=True):
        keyword = content[start:end].split(None, 1)[:1]
        if content[start : start + 1] != b"\r":
            word = keyword[0].decode("latin-1") if keyword else ""
            if word in _LEFT_OUT:
                left_out.add(word)
            elif word in _OF_MATERIALS:
                looks.read(word, rest_of(content[start:end].decode("utf-8", "replace")), polygons)
            elif word not in _IGNORED:
                return None
        if keyword in ([b"g"], [b"o"]):
            words = content[start:end].decode("utf-8", "replace").partition("#")[0].split()
            groups.append(_Group(polygons, " ".join(words[1:])))
    blocks = {}
    for name, chosen in rows.items():
        # Runs of lines begin and end where the choice changes.
        changes = np.flatnonzero(np.diff(chosen, prepend=False, append=False))
        edges = np.append(starts, len(content))[changes].tolist()
        blocks[name] = b"".join([content[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True)])
    return blocks, groups, looks, left_out


def _table(block: bytes, keyword: bytes, least: int) -> Float64Array:
    """The numbers after the keyword, one row per line. Raises ``ValueError`` unless lines have equally many."""
    lines, words = block.count(b"\n"), block.split()
    if not lines:
        return np.empty((0, least))
    width = len(words) // lines
    # If each of these is the keyword, it stands nowhere else: float() would refuse it there.
    if width * lines != len(words) or width <= least or set(words[::width]) != {keyword} or b"_" in block:
        raise ValueError
    del words[::width]
    return np.fromiter(map(float, words), np.float64, len(words)).reshape(lines, width - 1)


_NOT_IN_FACES = bytes(set(range(256)) - set(b"f0123456789/ \t\r\n"))


def _faces(block: bytes, counts: list[int]) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """``corners`` and ``starts``, for polygons whose corners all are a, a/b, a//c or a/b/c."""
    lines = block.count(b"\n")
    if len(block.translate(None, _NOT_IN_FACES)) < len(block) or block.count(b"f") != lines:
        return None
    letters = np.frombuffer(block, np.uint8)
    blank = letters <= ord(" ")
    words = np.flatnonzero(blank[:-1] & ~blank[1:] & (letters[1:] != ord("f"))) + 1
    starts = np.concatenate([[0], np.searchsorted(words, np.flatnonzero(letters == ord("\n")))])
    slashes = np.flatnonzero(letters == ord("/"))
    each, rest = divmod(len(slashes), max(len(words), 1))
    if (np.diff(starts) < 3).any() or rest or each > 2:
        return None
    columns = [0, 1, 2][: each + 1]
    if each:
        of_word = slashes.reshape(-1, each)
        if (of_word[:, 0] < words).any() or (of_word[:-1, -1] > words[1:]).any():
            return None
        if each == 2 and (of_word[:, 1] == of_word[:, 0] + 1).all():
            columns = [0, 2]
    # With as many numbers as places, none is missing anywhere.
    numbers = np.fromstring(block.translate(bytes.maketrans(b"f/", b"  ")), np.int64, sep=" ")
    if len(numbers) != len(words) * len(columns):
        return None
    corners = np.full((len(words), 3), -1)
    corners[:, columns] = numbers.reshape(-1, len(columns)) - 1
    most = np.array(counts)[columns]
    if ((corners[:, columns] < 0) | (corners[:, columns] >= most)).any():
        return None
    return corners, starts


# --- any file: line by line -----------------------------------------------------------------------------------


@dataclass
class _Statements:
    reading: Reading
    totals: Counter[str]  # of statements in the whole file, by keyword
    positions: list[list[float]] = field(default_factory=list)
    colors: list[list[float]] = field(default_factory=list)
    texcoords: list[list[float]] = field(default_factory=list)
    normals: list[list[float]] = field(default_factory=list)
    corners: list[tuple[int, int, int]] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    groups: list[_Group] = field(default_factory=list)
    looks: Looks = field(default_factory=Looks)
    left_out: set[str] = field(default_factory=set)
    unknown: list[str] = field(default_factory=list)


def _read_any(content: bytes, reading: Reading) -> _Content:
    lines = list(_logical_lines(content.decode("utf-8", "replace")))
    statements = _Statements(reading, Counter(word for _, line in lines for word in line.split(None, 1)[:1]))
    for number, line in lines:
        # The rest is a comment, at the end of a statement too, which many programs write.
        words = line.partition("#")[0].split()
        if not words:
            continue
        if words[0] in _OF_MATERIALS:  # whose names may have a #
            statements.looks.read(words[0], rest_of(line), len(statements.lengths))
            continue
        try:
            if any("_" in word for word in words) and words[0] in (
                "v",
                "vt",
                "vn",
                "f",
            ):  # Python takes 1_000 for a number
                raise ValueError(f"malformed number {next(word for word in words if '_' in word)!r}")
            _read_statement(words[0], words[1:], statements)
        except ValueError as error:
            raise MeshError(f"line {number}: {str(error)[:100]}, got {line.strip()[:80]!r}") from error
    has_colors = len(statements.colors) == len(statements.positions)
    if statements.colors and not has_colors:
        reading.note("left out: vertex colours, which only some vertices have")
    if statements.unknown:
        reading.note("left out: unknown statements", statements.unknown)
    return _Content(
        np.array(statements.positions, np.float64).reshape(-1, 3),
        np.array(statements.colors, np.float64) if has_colors else None,
        np.array(statements.texcoords, np.float64).reshape(-1, 2),
        np.array(statements.normals, np.float64).reshape(-1, 3),
        np.array(statements.corners, np.int64).reshape(-1, 3),
        np.cumsum([0, *statements.lengths]),
        statements.groups,
        statements.looks,
        statements.left_out,
    )


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
            numbers = _numbers(words, 2)
            if len(numbers) == 2:
                statements.reading.note("vertices of two numbers have z = 0")
                numbers.append(0.0)
            statements.positions.append(numbers[:3])
            if len(numbers) >= 6:
                statements.colors.append(numbers[3:6])
        case "vt":
            statements.texcoords.append([*_numbers(words, 1), 0.0][:2])
        case "vn":
            statements.normals.append(_numbers(words, 3)[:3])
        case "f":
            corners = [_corner(word, statements) for word in words]
            if len(words) < 3:
                statements.reading.no_polygon()
                return
            statements.corners += corners
            statements.lengths.append(len(words))
        case "g" | "o":
            statements.groups.append(_Group(len(statements.lengths), " ".join(words)))
        case _ if keyword in _LEFT_OUT:
            statements.left_out.add(keyword)
        case _ if keyword not in _IGNORED:
            statements.unknown.append(keyword)


def _numbers(words: list[str], least: int) -> list[float]:
    if len(words) < least:
        raise ValueError(f"expected at least {least} numbers")
    return [float(word) for word in words]


def _corner(word: str, statements: _Statements) -> tuple[int, int, int]:
    parts = word.split("/")
    if len(parts) > 3:
        raise ValueError("expected a corner like 1, 1/2, 1//3 or 1/2/3")
    position, texcoord, normal = [*parts, "", ""][:3]
    totals, reading = statements.totals, statements.reading
    so_far, total = len(statements.positions), totals["v"]
    vertex = _index(int(position), so_far, total)
    if vertex is None and not reading.repair:
        raise ValueError(f"vertex index out of range: expected 1 to {total} or -{so_far} to -1")
    found = [-1 if vertex is None else vertex]
    for text, rows, keyword, name in (
        (texcoord, statements.texcoords, "vt", "texture"), (normal, statements.normals, "vn", "normal"),
    ):  # fmt: skip
        index = _index(int(text), len(rows), totals[keyword]) if text else None
        if text and index is None:
            reading.note(f"left out: {name} indices that name nothing")
        found.append(-1 if index is None else index)
    return found[0], found[1], found[2]


def _index(index: int, so_far: int, total: int) -> int | None:
    """From 1 .. total, or -1 .. -so_far for the latest back to the first, to 0 .. total - 1; None for any other."""
    if not (1 <= index <= total or 1 <= -index <= so_far):
        return None
    return index - 1 if index > 0 else so_far + index
