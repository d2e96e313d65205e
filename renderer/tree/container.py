"""Files of arrays: a text that describes them and their bytes, checked when they are read.

Numbers are little-endian. The header and each array begin on a multiple of 64 bytes, as records in memory do, so that
a map of the file can be traced as it stands.

    bytes 0-7     the format's: no text, and damaged by what takes it for one
    bytes 8-11    uint32 0x01020304, which shows the order of bytes
    bytes 12-15   uint32, the version of the format
    bytes 16-19   uint32, the bytes of the header's text with the spaces that fill it up
    bytes 20-23   uint32, the CRC-32 (as zlib has it) of bytes 0-19 and the text
    bytes 24-     the text, JSON: {..., "arrays": [{"name": "vertices", "dtype": "<f8", "rows": 163842,
                  "crc32": 305419896}, ...]} with the keys of the format
    then          the arrays in the text's order, each filled up with zeros, which its CRC-32 counts too

A file may hold several of these, one after another.
"""

from __future__ import annotations

import errno
import json
import math
import os
import struct
import sys
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
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
from renderer.system.files import as_path
from renderer.trace.layout import CACHE_LINE, cache_aligned

_ORDER = 0x01020304
# The format's bytes, the order of bytes, version, bytes of the text; then the checksum of these and the text.
_START, _CRC = struct.Struct("<8s3I"), struct.Struct("<I")
_BEFORE = _START.size + _CRC.size

Arrays = dict[str, NDArray[Any]]


class Format(NamedTuple):
    """The contents of a file of one kind.

    content  in words, with who wrote it
    keys     of the text beside "arrays"; it may lack the ``optional`` ones
    kinds    for each array the types that it may have, and the shape of one of its rows
    always   the arrays that no file lacks
    """

    magic: bytes
    version: int
    content: str
    keys: tuple[str, ...]
    optional: tuple[str, ...]
    kinds: Mapping[str, tuple[tuple[str, ...], tuple[int, ...]]]
    always: frozenset[str]


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


def checked_path(path: str | os.PathLike[str]) -> Path:
    """A path, on a machine whose numbers are those of files."""
    expect(sys.byteorder == "little", "sys.byteorder", "little, as numbers in the file", sys.byteorder)
    return as_path("path", path)


def shown(value: object) -> str:
    """A value as errors show it."""
    return f"{value!r:.80}"


def _filled(size: int) -> int:
    """``size`` filled up to whole cache lines."""
    return -(-size // CACHE_LINE) * CACHE_LINE


# --- writing ----------------------------------------------------------------------------------------------------


def write(file: BinaryIO, of: Format, described: Mapping[str, Any], arrays: Arrays) -> None:
    """Write the text's keys and the arrays by their names."""
    file.write(_head(of, described, arrays))
    for array in arrays.values():
        memory = _bytes_of(array)
        file.write(memory)
        file.write(_zeros_after(memory))


def _bytes_of(array: NDArray[Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def _zeros_after(memory: memoryview) -> bytes:
    return bytes(_filled(len(memory)) - len(memory))


def _head(of: Format, described: Mapping[str, Any], arrays: Arrays) -> bytes:
    """All before the first array."""
    listed = []
    for name, array in arrays.items():
        memory, (_, row) = _bytes_of(array), of.kinds[name]
        crc = zlib.crc32(_zeros_after(memory), zlib.crc32(memory))
        listed.append({"name": name, "dtype": array.dtype.str, "rows": array.size // math.prod(row), "crc32": crc})
    text = json.dumps({**described, "arrays": listed}).encode("ascii")
    text = text.ljust(_filled(_BEFORE + len(text)) - _BEFORE)
    start = _START.pack(of.magic, _ORDER, of.version, len(text))
    return start + _CRC.pack(zlib.crc32(text, zlib.crc32(start))) + text


# --- reading ----------------------------------------------------------------------------------------------------


@contextmanager
def opened(path: str | os.PathLike[str], mapped: bool) -> Iterator[Reader]:
    """A file that is read, in memory or as a map of it. Errors within the context name the file."""
    source = checked_path(path)
    try:
        if not S_ISREG(source.stat().st_mode):  # a pipe would be waited for
            raise OSError(errno.EINVAL, "expected a file, got a folder, pipe or device")
        with open(source, "rb") as file:
            yield Reader(file, mapped)
    except FileNotFoundError as error:
        raise NoSuchFileError(f"{source}: cannot be read: {error.strerror}") from error
    except OSError as error:
        raise ValueError(f"{source}: cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error


class Reader:
    """Reads a file from its beginning, and checks what it reads."""

    def __init__(self, file: BufferedReader, mapped: bool) -> None:
        self._file, self._size, self._at = file, os.fstat(file.fileno()).st_size, 0
        # One map for all arrays, which cannot be written and stays as long as one of them does.
        shared = mapped and self._size > 0
        self._map = np.frombuffer(map_of(file.fileno(), 0, access=ACCESS_READ), np.uint8) if shared else None

    def next(self, of: Format) -> tuple[dict[str, Any], Arrays]:
        """The text of what comes next, without the arrays' entries, and the arrays."""
        described, sections = self._header(of)
        arrays = {name: self._array(name, section) for name, section in sections.items()}
        return described, arrays

    def expect_end(self) -> None:
        """Raise ``ValueError`` if more follows."""
        self._expect_size(self._size == self._at, self._at)

    def _expect_size(self, right: bool, end: int) -> None:
        expect(right, "size", f"{end} bytes, as its header says", self._size)

    def _header(self, of: Format) -> tuple[dict[str, Any], dict[str, _Section]]:
        """The header, checked by itself and against the size of the file."""
        self._file.seek(self._at)
        head, size = self._file.read(_BEFORE), self._size
        start = head[: _START.size]
        expect(start[:8] == of.magic, "content", of.content, f"{size} bytes that begin {start[:8]!r}")
        begin = self._at + _BEFORE
        expect(len(head) == _BEFORE, "size", f"at least {begin} bytes", size)
        _, order, version, length = _START.unpack(start)
        expect(order == _ORDER, "order of bytes", f"{_ORDER:#010x}, little-endian", f"{order:#010x}")
        expect(version == of.version, "version", f"{of.version}, which this release reads", version)
        expect(begin + length <= size, "size", f"at least the {begin + length} bytes that its header takes", size)
        (crc,), text = _CRC.unpack(head[_START.size :]), self._file.read(length)
        found = zlib.crc32(text, zlib.crc32(start))
        expect(found == crc, "header", f"the checksum {crc:08x}, with which it was written", f"{found:08x}")
        described = _described(text, of)
        sections = _sections(described.pop("arrays"), of, begin + length)
        end = max((section.end for section in sections.values()), default=begin + length)
        self._expect_size(end <= size, end)
        self._at = end
        return described, sections

    def _array(self, name: str, section: _Section) -> NDArray[Any]:
        """An array in memory of its own, with its checksum checked, or as a view of the map."""
        if self._map is not None:
            memory = self._map[section.begin : section.end]
        else:
            memory = cache_aligned(section.end - section.begin, np.uint8)
            self._file.seek(section.begin)
            count, crc = self._file.readinto(memory.data), zlib.crc32(memory.data)
            expect(count == len(memory), name, f"{len(memory)} bytes", f"the end of the file after {count}")
            expect(crc == section.crc, name, f"the checksum {section.crc:08x}, with which it was written", f"{crc:08x}")
        return memory[: section.size].view(section.dtype).reshape(section.shape)


def _described(text: bytes, of: Format) -> dict[str, Any]:
    """The header's text.

    A text that ``write`` wrote passes; this and other checks of entries are for others, whose checksum is right.
    """
    try:
        described = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"header: expected JSON, got {error}") from None
    keys, more = [*of.keys, "arrays"], list(of.optional)
    good = isinstance(described, dict) and sorted({*more, *described}) == sorted([*keys, *more])
    expect(good, "header", f"the keys {keys}" + (f", or also {more}" if more else ""), shown(described))
    return described


def _sections(listed: Any, of: Format, begin: int) -> dict[str, _Section]:
    """The arrays by their names; the first one begins at ``begin``."""
    expect(isinstance(listed, list), "arrays", "a list", shown(listed))
    sections: dict[str, _Section] = {}
    for entry in listed:
        name, section = _section(entry, of, begin)
        expect(name not in sections, "arrays", "each one once", f"{name} again")
        sections[name], begin = section, section.end
    missing = of.always - sections.keys()
    expect(not missing, "arrays", f"{sorted(of.always)}", f"none for {sorted(missing)}")
    return sections


def _section(entry: Any, of: Format, begin: int) -> tuple[str, _Section]:
    """The name and place of one array in a file."""
    keys = ["name", "dtype", "rows", "crc32"]
    good = isinstance(entry, dict) and sorted(entry) == sorted(keys)
    expect(good, "arrays", f"entries with the keys {keys}", shown(entry))
    name, dtype, rows, crc = (entry[key] for key in keys)
    expect(isinstance(name, str) and name in of.kinds, "arrays", f"names among {sorted(of.kinds)}", shown(name))
    dtypes, row = of.kinds[name]
    expect(dtype in dtypes, name, f"the type {' or '.join(dtypes)}", shown(dtype))
    good = is_count(rows, 0, 2**32 - 1) and is_count(crc, 0, 2**32 - 1)
    expect(good, name, "rows and crc32 from 0 to 2^32 - 1", f"{shown(rows)} and {shown(crc)}")
    return name, _Section(np.dtype(dtype), (rows, *row), begin, crc)
