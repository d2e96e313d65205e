"""Reading STL, binary and text.

Own code, because trimesh drops a text file's last solid where the file is cut off, and logs a traceback where
a normal is malformed; numpy-stl keeps float32 alone and refuses text that others read. The format: 3D Systems,
"StereoLithography Interface Specification", 1988.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MeshError
from renderer.mesh.mesh import Mesh, give_parts
from renderer.mesh.parts import parts_of
from renderer.mesh.reading import Reading

_HEADER_BYTES = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
# Counts that some writers leave in the header when they cannot know it yet.
_NO_COUNT = (0, 2**32 - 1)

# A facet of a text file, word by word; None stands for a number.
_CORNER = ["vertex", None, None, None]
_FACET = ["facet", "normal", None, None, None, "outer", "loop", *_CORNER * 3, "endloop", "endfacet"]


def parse_stl(content: bytes, reading: Reading | None = None) -> Mesh:
    """The mesh in an STL file's content; its faces share no vertices.

    A file is binary where its length says so, or it is no text that begins with "solid". Normals are left out, since
    they follow from the winding. Several solids of a text file are parts.

    Raises ``MeshError``, which does not know the file's name.
    """
    reading = reading or Reading()
    names: list[str] = []
    counts: list[int] = []
    corners: NDArray[np.floating] | None = _binary_corners(content, reading)
    if corners is None:
        text = content.removeprefix(BOM_UTF8).decode("latin-1").replace("\r", "\n")
        corners = _text_corners(text.lower(), reading)
        names, counts = _solids(text)
    faces = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    mesh = reading.mesh(corners.reshape(-1, 3), faces)
    if len(names) < 2 or sum(counts) != len(corners):
        return mesh
    return give_parts(mesh, parts_of(names, np.diff(reading.kept(np.cumsum(counts)), prepend=0).tolist()))


def _binary_corners(content: bytes, reading: Reading) -> NDArray[np.float32] | None:
    """The corners of a binary file, (F, 3, 3); None for text."""
    count = int.from_bytes(content[80:84], "little")
    size = _HEADER_BYTES + count * _RECORD.itemsize
    is_text = content.removeprefix(BOM_UTF8).lstrip()[:5].lower() == b"solid"
    if len(content) != size:
        held, rest = divmod(max(len(content) - _HEADER_BYTES, 0), _RECORD.itemsize)
        plain = is_text and b"facet" in content[:4096].lower()
        if plain or (is_text and not held):
            return None
        if count in _NO_COUNT and held and not rest:
            reading.note(f"the header counts {count} faces, the file holds {held}")
            count = held
        elif len(content) > size and count:
            reading.note("left out: what stands behind the last face")
        elif is_text:
            return None
        else:
            raise MeshError(_unreadable(content, size, count))
    return np.frombuffer(content, _RECORD, count, _HEADER_BYTES)["corners"]


def _unreadable(content: bytes, size: int, count: int) -> str:
    if len(content) < _HEADER_BYTES:
        return (
            f"expected text that starts with 'solid', or binary of at least {_HEADER_BYTES} bytes, got {len(content)}"
        )
    return (
        f"expected text that starts with 'solid', or binary of {size} bytes for its {count} faces, got {len(content)}"
        " bytes"
    )


def _solids(text: str) -> tuple[list[str], list[int]]:
    """The names of the solids in a text file, and how many facets each has."""
    names: list[str] = []
    counts: list[int] = []
    for begin in re.finditer(r"(?mi)^[ \t]*(?:solid\b(.*)|facet\b)", text):
        if begin[1] is not None:
            names.append(begin[1].strip().encode("latin-1").decode("utf-8", "replace"))
            counts.append(0)
        elif counts:
            counts[-1] += 1
    return names, counts


def _text_corners(text: str, reading: Reading) -> NDArray[np.float64]:
    """(F, 3 corners, 3) positions."""
    begun, ended = len(re.findall(r"(?m)^[ \t]*solid\b", text)), len(re.findall(r"(?m)^[ \t]*end ?solid\b", text))
    # A solid's line may hold any words as its name; the rest is facets.
    body = re.sub(r"(?m)^[ \t]*(end ?)?solid\b.*$", "", text)
    if begun != ended:
        if not body.rstrip().endswith("endfacet"):
            raise MeshError(f"truncated: {begun} solids begin, {ended} end")
        reading.note(f"{begun} solids begin, {ended} end")
    words, size = body.split(), len(_FACET)
    second = words[1::size]
    if second.count("normal") < len(second):
        body, without = re.subn(r"\bfacet\s+(?=outer\b)", "facet normal 0 0 0 ", body)
        words = body.split()
        if without:
            reading.note("facets without a normal")
    face_count, left_over = divmod(len(words), size)
    _check_words(words, face_count)
    if left_over:
        raise MeshError(f"expected {size} words, got {left_over} in facet {face_count}")
    if any("_" in word for word in words):  # float() would take 1_000 for a number
        raise MeshError("malformed number: '_' in a facet")
    coordinates = [words[place::size] for place in range(8, 19) if _FACET[place] is None]
    try:
        columns = [np.fromiter(map(float, column), np.float64, face_count) for column in coordinates]
    except ValueError as error:
        raise MeshError(f"malformed number: {str(error)[:80]}") from error
    return np.stack(columns, axis=1).reshape(-1, 3, 3)


def _check_words(words: list[str], face_count: int) -> None:
    """Raise ``MeshError`` where another word stands than facets have there."""
    for place, keyword in enumerate(_FACET):
        if keyword is None:
            continue
        for face, word in enumerate(words[place :: len(_FACET)]):
            if word != keyword:
                raise MeshError(f"expected {keyword!r}, got {word[:20]!r} in facet {face}")
