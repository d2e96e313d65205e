"""The file of a built octree: its mesh, tree and repairs, written whole, and checked when it is read.

Version 1. Numbers are little-endian. The header and each array begin on a multiple of 64 bytes, as records in memory
do, so that a map of the file can be traced as it stands.

    bytes 0-7     89 4F 43 54 52 45 45 0A: no text, and damaged by what takes it for one
    bytes 8-11    uint32 0x01020304, which shows the order of bytes
    bytes 12-15   uint32, the version
    bytes 16-19   uint32, the bytes of the header's text with the spaces that fill it up
    bytes 20-23   uint32, the CRC-32 (as zlib has it) of bytes 0-19 and the text
    bytes 24-     the text, JSON: {"depth": 8, "scale": 1.0, "name": "teapot", "arrays": [{"name": "vertices",
                  "dtype": "<f8", "rows": 163842, "crc32": 305419896}, ...]}; of a mesh of several parts also
                  "parts": [["body", 900], ["wheel", 120], ...], the name and the number of faces of each
    then          the arrays in the text's order, each filled up with zeros, which its CRC-32 counts too

``_KINDS`` has the arrays that there are. ``trace.layout`` describes nodes and blocks; "block_faces" is ``Tree.faces``.
"""

import errno
import json
import math
import os
import struct
import sys
import zlib
from io import BufferedReader
from mmap import ACCESS_READ
from mmap import mmap as map_of
from pathlib import Path
from stat import S_ISREG
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.counts import is_count
from renderer.errors import NoSuchFileError, expect
from renderer.mesh.mesh import Mesh, Repairs, give_parts
from renderer.mesh.parts import Part, parts_of
from renderer.system.files import as_path, write_atomically
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CACHE_LINE, NODE_WORDS, Tree, cache_aligned, locked
from renderer.tree.invariants import check_safe

VERSION = 1
_MAGIC, _ORDER = b"\x89OCTREE\n", 0x01020304
# Magic, order of bytes, version, bytes of the text; then the checksum of these and the text.
_START, _CRC = struct.Struct("<8s3I"), struct.Struct("<I")
# No tree has more levels: cuts by the split rule end after 3 * 64 of them, the greatest ``max_depth``, and cuts in even
# halves within 31 more.
_MAX_LEVELS = 256

# The types that each array may have, and the shape of one of its rows.
_KINDS: dict[str, tuple[tuple[str, ...], tuple[int, ...]]] = {
    "vertices": (("<f8",), (3,)),
    "faces": (("<i4",), (3,)),
    "normals": (("<f8",), (3,)),
    "colors": (("<f4",), (3,)),
    "texcoords": (("<f8",), (2,)),
    "nodes": (("<f4",), (NODE_WORDS,)),
    "blocks": (("<f4", "<f8"), (BLOCK_WORDS,)),
    "block_faces": (("<i4",), (BLOCK_FACES,)),
    "dropped_faces": (("<i8",), ()),
    "bad_vertices": (("<i8",), ()),
    "kept_faces": (("<i8",), ()),
    "bad_normals": (("<i8",), ()),
}
_OF_MESH = ("vertices", "faces", "normals", "colors", "texcoords")
_OF_REPAIRS = ("dropped_faces", "bad_vertices", "kept_faces", "bad_normals")
_ALWAYS = {"vertices", "faces", "nodes", "blocks", "block_faces"}

Arrays = dict[str, NDArray[Any]]


class Stored(NamedTuple):
    """The parts of an octree that a file keeps; ``repairs`` is None without ``repair=True``."""

    mesh: Mesh
    tree: Tree
    repairs: Repairs | None


class _Section(NamedTuple):
    """An array in a file: its type, its shape, its first byte, and the checksum of its bytes and the zeros after it."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    begin: int
    crc: int

    @property
    def size(self) -> int:
        return math.prod(self.shape) * self.dtype.itemsize

    @property
    def end(self) -> int:
        """The first byte after the zeros."""
        return _filled(self.begin + self.size)


class _Header(NamedTuple):
    depth: int
    scale: float
    name: str
    parts: tuple[Part, ...]
    sections: dict[str, _Section]


def save_octree(path: str | os.PathLike[str], stored: Stored) -> None:
    """Write an octree to a file, whole or not at all, see ``Octree.save``."""
    target, arrays = _path(path), _arrays(stored)
    head = _head_of(stored, arrays)

    def write(file: BinaryIO) -> None:
        file.write(head)
        for array in arrays.values():
            memory = _bytes_of(array)
            file.write(memory)
            file.write(_zeros_after(memory))

    write_atomically(target, write)


def load_octree(path: str | os.PathLike[str], mapped: bool) -> Stored:
    """The octree in a file, in memory or as a map of the file, see ``Octree.load``."""
    source = _path(path)
    try:
        if not S_ISREG(source.stat().st_mode):  # a pipe would be waited for
            raise OSError(errno.EINVAL, "expected a file, got a folder, pipe or device")
        with open(source, "rb") as file:
            header = _read_header(file)
            arrays = _mapped(file, header.sections) if mapped else _read(file, header.sections)
        return _stored(header, arrays)
    except FileNotFoundError as error:
        raise NoSuchFileError(f"{source}: cannot be read: {error.strerror}") from error
    except OSError as error:
        raise ValueError(f"{source}: cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error


def _path(path: str | os.PathLike[str]) -> Path:
    expect(sys.byteorder == "little", "sys.byteorder", "little, as numbers in the file", sys.byteorder)
    return as_path("path", path)


# --- writing ----------------------------------------------------------------------------------------------------


def _arrays(stored: Stored) -> Arrays:
    """The arrays to be written, by their names in the file."""
    mesh, tree, repairs = stored.mesh, stored.tree, stored.repairs
    arrays = {name: getattr(mesh, name) for name in _OF_MESH if getattr(mesh, name) is not None}
    arrays |= {"nodes": tree.nodes, "blocks": tree.blocks, "block_faces": tree.faces}
    return arrays | ({name: getattr(repairs, name) for name in _OF_REPAIRS} if repairs is not None else {})


def _bytes_of(array: NDArray[Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def _zeros_after(memory: memoryview) -> bytes:
    return bytes(_filled(len(memory)) - len(memory))


def _head_of(stored: Stored, arrays: Arrays) -> bytes:
    """All before the first array."""
    listed = []
    for name, array in arrays.items():
        memory, (_, row) = _bytes_of(array), _KINDS[name]
        crc = zlib.crc32(_zeros_after(memory), zlib.crc32(memory))
        listed.append({"name": name, "dtype": array.dtype.str, "rows": array.size // math.prod(row), "crc32": crc})
    described = {"depth": int(stored.tree.depth), "scale": float(stored.tree.scale), "name": stored.mesh.name}
    parts = stored.mesh._parts
    named = {"parts": [[part.name, part.faces.stop - part.faces.start] for part in parts]} if parts else {}
    text = json.dumps({**described, **named, "arrays": listed}).encode("ascii")
    before = _START.size + _CRC.size
    text = text.ljust(_filled(before + len(text)) - before)
    start = _START.pack(_MAGIC, _ORDER, VERSION, len(text))
    return start + _CRC.pack(zlib.crc32(text, zlib.crc32(start))) + text


def _filled(size: int) -> int:
    """``size`` filled up to whole cache lines."""
    return -(-size // CACHE_LINE) * CACHE_LINE


# --- reading ----------------------------------------------------------------------------------------------------


def _read_header(file: BufferedReader) -> _Header:
    """The header, checked by itself and against the size of the file."""
    size = os.fstat(file.fileno()).st_size
    before = _START.size + _CRC.size
    head = file.read(before)
    start = head[: _START.size]
    expect(start[:8] == _MAGIC, "content", "an octree that Octree.save wrote", f"{size} bytes that begin {start[:8]!r}")
    expect(len(head) == before, "size", f"at least {before} bytes", size)
    _, order, version, length = _START.unpack(start)
    expect(order == _ORDER, "order of bytes", f"{_ORDER:#010x}, little-endian", f"{order:#010x}")
    expect(version == VERSION, "version", f"{VERSION}, which this release reads", version)
    expect(before + length <= size, "size", f"at least the {before + length} bytes that its header takes", size)
    (crc,), text = _CRC.unpack(head[_START.size :]), file.read(length)
    found = zlib.crc32(text, zlib.crc32(start))
    expect(found == crc, "header", f"the checksum {crc:08x}, with which it was written", f"{found:08x}")
    header, end = _parsed(text, before + length)
    expect(size == end, "size", f"{end} bytes, as its header says", size)
    return header


def _parsed(text: bytes, begin: int) -> tuple[_Header, int]:
    """The header in a text, and the end of the last array; the first one begins at ``begin``.

    A text that ``_head_of`` wrote passes; the checks are for others, whose checksum is right.
    """
    try:
        described = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"header: expected JSON, got {error}") from None
    keys = ["depth", "scale", "name", "arrays"]
    good = isinstance(described, dict) and sorted({"parts", *described}) == sorted([*keys, "parts"])
    expect(good, "header", f"the keys {keys}, or also 'parts'", _shown(described))
    depth, scale, name, listed = (described[key] for key in keys)
    expect(is_count(depth, 0, _MAX_LEVELS), "depth", f"an integer from 0 to {_MAX_LEVELS}", _shown(depth))
    good = isinstance(scale, float) and math.frexp(scale)[0] == 0.5
    expect(good, "scale", "a power of two", _shown(scale))
    expect(isinstance(name, str), "name", "a string", _shown(name))
    parts = _parts(described.get("parts", []))
    expect(isinstance(listed, list), "arrays", "a list", _shown(listed))
    sections: dict[str, _Section] = {}
    for entry in listed:
        of, section = _section(entry, begin)
        expect(of not in sections, "arrays", "each one once", f"{of} again")
        sections[of], begin = section, section.end
    missing = _ALWAYS - sections.keys()
    expect(not missing, "arrays", f"{sorted(_ALWAYS)}", f"none for {sorted(missing)}")
    return _Header(depth, scale, name, parts, sections), begin


def _parts(listed: Any) -> tuple[Part, ...]:
    """The parts of the mesh, none if it has one only."""
    good = isinstance(listed, list) and all(
        isinstance(entry, list) and len(entry) == 2 and isinstance(entry[0], str) and is_count(entry[1], 0, 2**32 - 1)
        for entry in listed
    )
    expect(good, "parts", "pairs of a name and a number of faces", _shown(listed))
    return parts_of([name for name, _ in listed], [count for _, count in listed])


def _section(entry: Any, begin: int) -> tuple[str, _Section]:
    """The name and place of one array in a file."""
    keys = ["name", "dtype", "rows", "crc32"]
    good = isinstance(entry, dict) and sorted(entry) == sorted(keys)
    expect(good, "arrays", f"entries with the keys {keys}", _shown(entry))
    name, dtype, rows, crc = (entry[key] for key in keys)
    expect(isinstance(name, str) and name in _KINDS, "arrays", f"names among {sorted(_KINDS)}", _shown(name))
    dtypes, row = _KINDS[name]
    expect(dtype in dtypes, name, f"the type {' or '.join(dtypes)}", _shown(dtype))
    good = is_count(rows, 0, 2**32 - 1) and is_count(crc, 0, 2**32 - 1)
    expect(good, name, "rows and crc32 from 0 to 2^32 - 1", f"{_shown(rows)} and {_shown(crc)}")
    return name, _Section(np.dtype(dtype), (rows, *row), begin, crc)


def _shown(value: object) -> str:
    return f"{value!r:.80}"


def _read(file: BufferedReader, sections: dict[str, _Section]) -> Arrays:
    """The arrays of a file in memory of their own, with their checksums checked. The file stands at the first one."""
    arrays = {}
    for name, section in sections.items():
        memory = cache_aligned(section.end - section.begin, np.uint8)
        count, crc = file.readinto(memory.data), zlib.crc32(memory.data)
        expect(count == len(memory), name, f"{len(memory)} bytes", f"the end of the file after {count}")
        expect(crc == section.crc, name, f"the checksum {section.crc:08x}, with which it was written", f"{crc:08x}")
        arrays[name] = memory[: section.size].view(section.dtype).reshape(section.shape)
    return arrays


def _mapped(file: BufferedReader, sections: dict[str, _Section]) -> Arrays:
    """The arrays of a file as views of a map of it, which cannot be written and stays as long as one of them does."""
    memory = np.frombuffer(map_of(file.fileno(), 0, access=ACCESS_READ), np.uint8)
    return {
        name: memory[section.begin : section.begin + section.size].view(section.dtype).reshape(section.shape)
        for name, section in sections.items()
    }


def _stored(header: _Header, arrays: Arrays) -> Stored:
    """Mesh, tree and repairs over the arrays of a file, checked so far that tracing is safe."""
    mesh = Mesh._viewing({name: arrays[name] for name in _OF_MESH if name in arrays}, header.name)
    counted = header.parts[-1].faces.stop if header.parts else len(mesh.faces)
    expect(counted == len(mesh.faces), "parts", f"{len(mesh.faces)} faces in all", counted)
    give_parts(mesh, header.parts)
    nodes, blocks, faces = (arrays[name].reshape(-1) for name in ("nodes", "blocks", "block_faces"))
    tree = Tree(nodes, blocks, faces, header.depth, header.scale)
    check_safe(tree, len(mesh.faces))
    given = [arrays[name] for name in _OF_REPAIRS if name in arrays]
    expect(len(given) in (0, len(_OF_REPAIRS)), "arrays", f"all of {_OF_REPAIRS} or none", f"{len(given)} of them")
    repairs = Repairs(*map(locked, given)) if given else None
    kept = len(mesh.faces) if repairs is None else len(repairs.kept_faces)
    expect(kept == len(mesh.faces), "kept_faces", f"a row a face, {len(mesh.faces)}", kept)
    return Stored(mesh, tree, repairs)
