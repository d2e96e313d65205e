"""Reading and writing PLY: ASCII and both binary byte orders, polygons and triangle strips.

Own code, because the readers at hand do not serve: plyfile reads mixed polygons and ASCII row by row in
Python, and trimesh drops ``tristrips``. The format: Greg Turk, "The PLY Polygon File Format", 1994.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MeshError
from renderer.mesh.material import MeshMaterial
from renderer.mesh.mesh import Float64Array, Mesh
from renderer.mesh.polygons import triangulate
from renderer.mesh.reading import Reading
from renderer.mesh.texture import Texture
from renderer.numerics.compressed import firsts_of

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float": "f4", "double": "f8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_KEYWORDS = {"f4": "float", "f8": "double", "u1": "uchar"}  # of what is written
_ByteOrder = Literal["<", ">", "="]
_ASCII: _ByteOrder = "="  # its numbers are turned into native doubles
_BYTE_ORDERS: dict[str, _ByteOrder] = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": _ASCII}
_XYZ, _NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
_INDEX_NAMES = ("vertex_indices", "vertex_index")
_KEPT = {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "s", "t", "u", "v", "texture_u", "texture_v"}
_TEXCOORD_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))

# Real headers are a few hundred bytes; beyond this a missing end_header is certain enough to stop looking.
_MAX_HEADER_BYTES = 1 << 20


@dataclass(frozen=True)
class _Property:
    name: str
    type: np.dtype[Any]  # as the header declares it
    count_type: np.dtype[Any] | None  # of a list's length; None for a single value
    stored: np.dtype[Any]  # as its values stand in the body
    count_stored: np.dtype[Any] | None


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


@dataclass(frozen=True)
class _Column:
    """One property of every row: ``values`` end to end; row r holds values[starts[r] : starts[r + 1]]."""

    property: _Property
    starts: NDArray[np.int64]
    values: NDArray[Any]


_Columns = dict[str, _Column]


def parse_ply(content: bytes, reading: Reading | None = None) -> Mesh:
    """The mesh in a PLY file's content.

    Faces come from the elements ``face`` (polygons are cut as ``polygons.triangulate`` says) and ``tristrips``
    (-1 restarts a strip; every second triangle is turned; stitching triangles without area stay), in the file's
    order. Vertex normals, colours (red, green, blue; integers are
    divided by 255 or by their type's maximum) and texture coordinates (s t, u v or texture_u texture_v) are
    kept; a comment ``TextureFile`` gives a material. Other properties and elements are left out and noted, as are faces
    of fewer than three corners, header lines of no meaning and bytes behind the last element. An alpha that is opaque
    at all vertices is not noted.

    Raises ``MeshError``, which does not know the file's name.
    """
    reading = reading or Reading()
    columns, elements = _vertices(content, reading)
    vertex = columns["vertex"]
    _note_left_out(elements, vertex, reading)
    positions = _vertex_columns(vertex, _XYZ)
    if positions is None:
        raise MeshError(f"element vertex: expected properties x, y and z, got {', '.join(vertex) or 'none'}")
    lists = [(e.name, _corners(e.name, columns[e.name])) for e in elements if e.name in ("face", "tristrips")]
    faces = [
        _strips(corners) if name == "tristrips" else _polygons(corners, positions, reading) for name, corners in lists
    ]
    pairs = (_vertex_columns(vertex, names) for names in _TEXCOORD_NAMES)
    texcoords = next((pair for pair in pairs if pair is not None), None)
    return reading.mesh(
        positions,
        np.concatenate([np.empty((0, 3), np.int64), *faces]),
        normals=_vertex_columns(vertex, _NORMAL),
        colors=_colors(vertex, reading),
        texcoords=texcoords,
        materials=_texture_file(content, texcoords is not None, reading),
    )


def _texture_file(content: bytes, has_texcoords: bool, reading: Reading) -> list[MeshMaterial]:
    """A material with the image that a comment ``TextureFile`` names, as MeshLab writes; none without that."""
    header = content[: content.find(b"end_header", 0, _MAX_HEADER_BYTES)]
    names = re.findall(r"(?m)^comment TextureFile[ \t]+(\S.*?)\s*$", header.decode("utf-8", "replace"))
    if names and (not has_texcoords or len(names) > 1):
        reading.note("left out, as vertices have no texture coordinates in one image: textures", names)
    elif names and (image := reading.image_file(names[0])) is not None:
        return [MeshMaterial(base_color_texture=Texture(image), double_sided=True)]
    return []


def _vertices(content: bytes, reading: Reading) -> tuple[dict[str, _Columns], list[_Element]]:
    """The columns of a file's elements, vertices among them, and the elements."""
    byte_order, elements, body_start = _parse_header(content, reading)
    if byte_order == _ASCII:
        content, elements = _ascii_as_doubles(content[body_start:]), [_in_doubles(e) for e in elements]
        body_start = 0
    columns = _read_elements(content, body_start, elements, byte_order, reading)
    if "vertex" not in columns:
        raise MeshError(f"expected an element 'vertex', got {', '.join(columns) or 'no element'}")
    return columns, elements


def _note_left_out(elements: list[_Element], vertex: _Columns, reading: Reading) -> None:
    """Note elements and properties that have no place in a mesh. An alpha that is opaque everywhere needs none."""
    alpha = _vertex_columns(vertex, ("alpha",))
    opaque = alpha is not None and bool((alpha == _full(vertex["alpha"].property.type, alpha)).all())
    own = _KEPT | {"alpha"} if opaque else _KEPT
    places = {"vertex": own, "face": set(_INDEX_NAMES), "tristrips": set(_INDEX_NAMES)}
    for element in elements:
        names = [p.name for p in element.properties if p.name not in places.get(element.name, ())]
        if element.name not in places and element.count:
            reading.note(f"left out: element {element.name}")
        elif names and element.count:
            reading.note(f"left out of element {element.name}:", names)


def point_rows(content: bytes) -> NDArray[np.float64]:
    """The vertices of a file, (n, 3), or (n, 6) with normals; it needs no faces. Raises ``MeshError``."""
    vertex = _vertices(content, Reading())[0]["vertex"]
    positions, normals = (_vertex_columns(vertex, names) for names in (_XYZ, _NORMAL))
    if positions is None:
        raise MeshError(f"element vertex: expected properties x, y and z, got {', '.join(vertex) or 'none'}")
    return positions if normals is None else np.concatenate([positions, normals], axis=1)


def format_ply(mesh: Mesh) -> bytes:
    """Binary little-endian PLY of ``mesh``: float32 positions where those are exact, else double.

    Normals and texture coordinates are doubles; colours are floats.
    """
    return format_columns(vertex_columns(mesh), mesh.faces)


def vertex_columns(mesh: Mesh, colors: bool = True) -> dict[str, NDArray[Any]]:
    """The columns of a mesh's vertices: positions, and what else they have, ``colors`` only if wanted."""
    columns = by_name(("x", "y", "z"), mesh.vertices.astype(np.float32) if mesh.is_float32 else mesh.vertices)
    for names, array in (
        (("nx", "ny", "nz"), mesh.normals),
        (("red", "green", "blue"), mesh.colors if colors else None),
        (("s", "t"), mesh.texcoords),
    ):
        if array is not None:
            columns |= by_name(names, array)
    return columns


def by_name(names: tuple[str, ...], array: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """The columns of an array (n, len(names)) by their names."""
    return dict(zip(names, array.T, strict=True))


def format_columns(
    vertex: dict[str, NDArray[Any]],
    faces: NDArray[np.int32] | None = None,
    face: dict[str, NDArray[Any]] | None = None,
) -> bytes:
    """Binary little-endian PLY of columns (n,) of float32, float64 or uint8, by the names of their properties.

    vertex : the vertices' columns. faces : (F, 3), or None for a file without faces. face : further columns of these.
    """
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertex['x'])}", *_declared(vertex)]
    body = _packed(vertex)
    if faces is not None:
        own = face or {}
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices", *_declared(own)]
        body += _packed({"count": np.full(len(faces), 3, np.uint8), "corners": faces, **own})
    return "\n".join([*header, "end_header", ""]).encode("ascii") + body


def _declared(columns: dict[str, NDArray[Any]]) -> list[str]:
    """The header's lines about single values."""
    return [f"property {_KEYWORDS[column.dtype.str[1:]]} {name}" for name, column in columns.items()]


def _packed(columns: dict[str, NDArray[Any]]) -> bytes:
    """The columns' values, row by row."""
    fields = [(name, column.dtype.newbyteorder("<"), column.shape[1:]) for name, column in columns.items()]
    rows = np.empty(len(next(iter(columns.values()))), fields)
    for name, column in columns.items():
        rows[name] = column
    return rows.tobytes()


# --- header -------------------------------------------------------------------------------------------------


def _parse_header(content: bytes, reading: Reading) -> tuple[_ByteOrder, list[_Element], int]:
    """Byte order, elements, and the start of the body."""
    if re.match(rb"ply[ \t]*(\r\n|\r|\n)", content) is None:
        raise MeshError(f"expected a first line 'ply', got {content[:16]!r}")
    end = re.compile(rb"[\r\n]end_header[ \t]*(\r\n|\r|\n|\Z)").search(content, 0, _MAX_HEADER_BYTES)
    if end is None:
        raise MeshError("header: expected a line 'end_header', found none")
    lines = content[: end.start()].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    byte_order: _ByteOrder | None = None
    elements: list[tuple[str, int, list[_Property]]] = []
    for number, line in enumerate(lines[1:], start=2):
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", word, version] if (
                word in _BYTE_ORDERS and re.fullmatch(r"1\.0+", version) and byte_order is None
            ):
                byte_order = _BYTE_ORDERS[word]
            case ["element", name, count] if re.fullmatch("[0-9]{1,18}", count):
                if name in [other[0] for other in elements]:
                    raise MeshError(f"header line {number}: element {name!r} stands twice")
                elements.append((name, int(count), []))
            case ["property", *words] if elements and (property_ := _parse_property(words)) is not None:
                if property_.name in [other.name for other in elements[-1][2]]:
                    raise MeshError(f"header line {number}: property {property_.name!r} stands twice")
                elements[-1][2].append(property_)
            case ["property", value, _] | ["property", "list", _, value, _] if elements and value not in _TYPES:
                raise MeshError(f"header line {number}: expected a type of PLY, got {value[:40]!r}")
            case ["format" | "element" | "property" | "ply", *_]:
                raise MeshError(f"header line {number}: expected a PLY header line, got {line[:80]!r}")
            case [word, *_]:
                reading.note("left out: header lines that begin with", [word])
    if byte_order is None:
        raise MeshError("header: expected a line 'format', found none")
    return byte_order, [_Element(name, count, tuple(rows)) for name, count, rows in elements], end.end()


def _parse_property(words: list[str]) -> _Property | None:
    match words:
        case ["list", count, value, name] if count in _TYPES and value in _TYPES and _TYPES[count][0] != "f":
            type_, count_type = np.dtype(_TYPES[value]), np.dtype(_TYPES[count])
            return _Property(name, type_, count_type, type_, count_type)
        case [value, name] if value in _TYPES:
            return _Property(name, np.dtype(_TYPES[value]), None, np.dtype(_TYPES[value]), None)
    return None


# --- body ---------------------------------------------------------------------------------------------------


def _ascii_as_doubles(body: bytes) -> bytes:
    """The numbers of an ASCII body as native doubles, which hold every PLY type: one reader serves both."""
    tokens = body.split()
    if b"_" in body:  # float() would take 1_000 for a number
        raise MeshError("malformed number: '_' in the body")
    try:
        return np.fromiter(map(float, tokens), np.float64, len(tokens)).tobytes()
    except ValueError as error:
        raise MeshError(f"malformed number: {str(error)[:80]}") from error


def _in_doubles(element: _Element) -> _Element:
    double = np.dtype("f8")
    swapped = [replace(p, stored=double, count_stored=p.count_type and double) for p in element.properties]
    return replace(element, properties=tuple(swapped))


def _read_elements(
    content: bytes, position: int, elements: list[_Element], byte_order: _ByteOrder, reading: Reading
) -> dict[str, _Columns]:
    columns: dict[str, _Columns] = {}
    for element in elements:
        # Refuse, before anything is allocated, a count that the rest of the file cannot hold.
        least = sum((p.count_stored or p.stored).itemsize for p in element.properties)
        if element.count * least > len(content) - position:
            raise MeshError(f"truncated: too short for the {element.count} rows of element {element.name}")
        columns[element.name], position = _read_rows(content, position, element, byte_order)
    # Some writers pad.
    if content[position:].strip(b"\0 \t\r\n"):
        reading.note("left out: what stands behind the last element")
    return columns


def _read_rows(content: bytes, position: int, element: _Element, byte_order: _ByteOrder) -> tuple[_Columns, int]:
    """The element's columns and its end.

    Rows that all look like the first (triangles only, say) are strided views of ``content``. Otherwise
    Python walks from list length to list length, about half a second for a million faces.
    """
    if not element.properties:
        return {}, position
    rows = element.count
    starts, lengths, end = _walk(content, position, element, byte_order, min(rows, 1))
    stride = end - position
    uniform = rows > 0 and rows * stride <= len(content) - position
    columns: _Columns = {}
    for k, p in enumerate(element.properties if uniform else ()):
        if p.count_stored is not None:
            at = int(starts[0, k]) - p.count_stored.itemsize
            count_type = p.count_stored.newbyteorder(byte_order)
            counts: NDArray[Any] = np.ndarray((rows,), count_type, content, at, (stride,))
            uniform = uniform and bool((counts == lengths[0, k]).all())
        shape, strides = (rows, int(lengths[0, k])), (stride, p.stored.itemsize)
        values: NDArray[Any] = np.ndarray(shape, p.stored.newbyteorder(byte_order), content, int(starts[0, k]), strides)
        columns[p.name] = _Column(p, np.arange(rows + 1) * lengths[0, k], values.reshape(-1))
    if uniform:
        return columns, position + rows * stride
    starts, lengths, end = _walk(content, position, element, byte_order, rows)
    return {
        p.name: _gathered(content, p, starts[:, k], lengths[:, k], byte_order) for k, p in enumerate(element.properties)
    }, end


def _walk(
    content: bytes, position: int, element: _Element, byte_order: _ByteOrder, rows: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """The start and the number of each property's values, (rows, properties), and the end of the rows."""
    steps = [
        (p.count_stored and struct.Struct(byte_order + p.count_stored.char), p.stored.itemsize)
        for p in element.properties
    ]
    starts: list[int] = []
    lengths: list[int] = []
    size = len(content)
    for row in range(rows):
        for count_format, item_size in steps:
            length = 1
            if count_format is not None:
                if position + count_format.size > size:
                    raise MeshError(f"truncated: the file ends in row {row} of element {element.name}")
                (length,) = count_format.unpack_from(content, position)
                position += count_format.size
                if not 0 <= length < 2**32 or length % 1:
                    raise MeshError(f"element {element.name}: list length {length} in row {row}")
            starts.append(position)
            lengths.append(length)
            position += int(length) * item_size
            if position > size:
                raise MeshError(f"truncated: the file ends in row {row} of element {element.name}")
    shape = (rows, len(steps))
    return np.array(starts, np.int64).reshape(shape), np.array(lengths, np.int64).reshape(shape), position


def _gathered(
    content: bytes,
    property_: _Property,
    starts: NDArray[np.int64],
    lengths: NDArray[np.int64],
    byte_order: _ByteOrder,
) -> _Column:
    """A column whose values lie at uneven places of ``content``."""
    firsts = firsts_of(lengths)
    size = property_.stored.itemsize
    places = np.repeat(starts - firsts[:-1] * size, lengths) + np.arange(firsts[-1]) * size
    scattered = np.frombuffer(content, np.uint8)[places[:, None] + np.arange(size)]
    return _Column(property_, firsts, scattered.reshape(-1).view(property_.stored.newbyteorder(byte_order)))


# --- columns to arrays --------------------------------------------------------------------------------------


def _vertex_columns(vertex: _Columns, names: tuple[str, ...]) -> Float64Array | None:
    """(V, len(names)) float64, or None where one is missing."""
    columns = [vertex[name] for name in names if name in vertex and vertex[name].property.count_type is None]
    if len(columns) < len(names):
        return None
    with np.errstate(invalid="ignore"):  # a signalling NaN: Mesh rejects it with its row
        return np.stack([column.values.astype(np.float64) for column in columns], axis=1)


def _colors(vertex: _Columns, reading: Reading) -> Float64Array | None:
    names = ("red", "green", "blue")
    colors = _vertex_columns(vertex, names)
    if colors is None:
        return None
    scale = np.array([_full(vertex[name].property.type, column) for name, column in zip(names, colors.T, strict=True)])
    with np.errstate(invalid="ignore"):  # NaN, which does not fit either
        fit = np.isfinite(colors) & ((scale == 1.0) | ((colors >= 0.0) & (colors <= scale)))
    if not fit.all():
        reading.note("left out: vertex colours that do not fit their type or 0 to 255")
        return None
    return colors / scale


def _full(type_: np.dtype[Any], values: Float64Array) -> float:
    """The integer for 1: 255 for signed integers, and for unsigned ones of 32 bits and more where none is larger."""
    if type_.kind == "f":
        return 1.0
    few = type_.kind == "i" or (type_.itemsize > 2 and values.max(initial=0.0) <= 255.0)
    return 255.0 if few else float(np.iinfo(type_).max)


def _corners(element: str, columns: _Columns) -> _Column:
    """The element's list of vertex indices, as int64."""
    named = [columns[name] for name in _INDEX_NAMES if name in columns]
    lists = [column for column in named if column.property.count_type is not None]
    if not lists:
        names = ", ".join(columns) or "none"
        raise MeshError(f"element {element}: expected a list {' or '.join(_INDEX_NAMES)}, got {names}")
    values = lists[0].values
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore"):  # NaN and inf, which are not whole either
            whole = (np.abs(values) < 2**53) & (np.floor(values) == values)
        if not whole.all():
            raise MeshError(f"element {element}: expected whole vertex indices, got {values[~whole][0]}")
    return replace(lists[0], values=values.astype(np.int64))


def _polygons(polygons: _Column, positions: Float64Array, reading: Reading) -> NDArray[np.int64]:
    """(F, 3) triangles."""
    lengths = np.diff(polygons.starts)
    corners, rows = polygons.values, np.arange(len(lengths))
    if (lengths < 3).any():
        reading.no_polygon()
        corners, rows = corners[np.repeat(lengths >= 3, lengths)], rows[lengths >= 3]
    cut = triangulate(positions, corners, firsts_of(lengths[rows]))
    reading.cut(rows[cut.wrong].tolist(), "the row of the face")
    triangles: NDArray[np.int64] = corners[cut.places]
    return triangles


def _strips(strips: _Column) -> NDArray[np.int64]:
    """(F, 3) triangles; strip a b c d ... becomes abc, cbd, ..."""
    values = strips.values
    restarts = values == -1
    places = np.arange(len(values))
    begins = restarts.copy()
    begins[strips.starts[:-1][strips.starts[:-1] < len(values)]] = True
    # The strip of each place is named by its beginning: a row's first place, or that of a restart.
    strip = np.maximum.accumulate(np.where(begins, places, 0))
    sizes = np.bincount(strip[~restarts])
    if ((sizes == 1) | (sizes == 2)).any():
        raise MeshError("element tristrips: expected at least 3 vertices in each strip, got 1 or 2")
    whole = (strip[2:] == strip[:-2]) & ~restarts[:-2]
    first = places[:-2][whole]
    turned = (first - strip[:-2][whole] - restarts[strip[:-2][whole]]) % 2 == 1
    triangles: NDArray[np.int64] = values[np.stack([first, first + 1, first + 2], axis=1)]
    triangles[turned] = triangles[turned][:, [1, 0, 2]]
    return triangles
