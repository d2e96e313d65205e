"""Reading STL, binary and text.

Own code, because trimesh drops a text file's last solid where the file is cut off, and logs a traceback where
a normal is malformed. The format: 3D Systems, "StereoLithography Interface Specification", 1988.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8

import numpy as np

from renderer.errors import MeshError
from renderer.mesh.mesh import Mesh, Repairs, build_mesh, give_parts
from renderer.mesh.parts import parts_of

_HEADER_BYTES = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

# A facet of a text file, word by word; None stands for a number.
_CORNER = ["vertex", None, None, None]
_FACET = ["facet", "normal", None, None, None, "outer", "loop", *_CORNER * 3, "endloop", "endfacet"]


def parse_stl(content: bytes, repairs: list[Repairs] | None = None) -> Mesh:
    """The mesh in an STL file's content; its faces share no vertices.

    A file is binary where its length says so. Normals are left out, since they follow from the winding. Several solids
    of a text file are parts. ``repairs`` as for ``build_mesh``.

    Raises ``MeshError``, which does not know the file's name.
    """
    face_count = int.from_bytes(content[80:84], "little")
    binary_size = _HEADER_BYTES + face_count * _RECORD.itemsize
    names: list[str] = []
    counts: list[int] = []
    if len(content) == binary_size:
        corners = np.frombuffer(content, _RECORD, offset=_HEADER_BYTES)["corners"]
    elif (text := content.removeprefix(BOM_UTF8)).lstrip()[:5].lower() == b"solid":
        lines = text.decode("latin-1").replace("\r", "\n")
        corners = _text_corners(lines.lower())
        names, counts = _solids(lines)
    else:
        raise MeshError(
            f"expected text that starts with 'solid', or binary of {binary_size} bytes for its {face_count}"
            f" faces, got {len(content)} bytes"
        )
    faces = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    mesh = build_mesh(repairs, corners.reshape(-1, 3), faces)
    if len(names) < 2 or sum(counts) != len(corners):
        return mesh
    ends = np.cumsum(counts)
    if repairs:
        ends = np.searchsorted(repairs[-1].kept_faces, ends)
    return give_parts(mesh, parts_of(names, np.diff(ends, prepend=0).tolist()))


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


def _text_corners(text: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """(F, 3 corners, 3) positions."""
    begun, ended = (len(re.findall(rf"(?m)^[ \t]*{word}\b", text)) for word in ("solid", "endsolid"))
    if begun != ended:
        raise MeshError(f"truncated: {begun} solids begin, {ended} end")
    # A solid's line may hold any words as its name; the rest is facets.
    words = re.sub(r"(?m)^[ \t]*(end)?solid\b.*$", "", text).split()
    size = len(_FACET)
    face_count, left_over = divmod(len(words), size)
    for place, keyword in enumerate(_FACET):
        if keyword is None:
            continue
        for face, word in enumerate(words[place::size]):
            if word != keyword:
                raise MeshError(f"expected {keyword!r}, got {word[:20]!r} in facet {face}")
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
