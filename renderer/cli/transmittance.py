"""``--transmittance``: how much light the faces of a material, an object or a file let through."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from renderer.cli.meshes import Files
from renderer.errors import expect

_OPTION = "--transmittance"
_TRANSMITTANCE = (
    "the share of light, from 0 to 1, that faces let through: those of the material, object or mesh file of a name or "
    "pattern, such as 'tree*.obj=0.3'; or an .npy file with a value for each face; may be given again, and the last "
    "holds"
)


def add_transmittance(command: Any) -> None:
    """Add the option to a command."""
    command.add_argument(_OPTION, action="append", default=[], metavar="NAME=VALUE", help=_TRANSMITTANCE)


def transmittance_of(files: Files, given: Sequence[str]) -> Any:
    """The transmittance of all faces, (F,) float64, by the words of the option; None without any.

    Raises ``ValueError`` for words that are no name and share, and for a name that nothing has.
    """
    import numpy as np

    from renderer.studies.points import read_array
    from renderer.studies.translucent import check_transmittance

    if not given:
        return None
    shares = np.zeros(len(files.mesh.faces))
    for word in given:
        if is_array(word):
            shares = check_transmittance(_OPTION, read_array(_OPTION, Path(word)), len(shares))
            continue
        pattern, share = _pair(word)
        faces = list(_faces_of(files, pattern))
        expect(bool(faces), _OPTION, "the name of a material, an object or a mesh file, or a pattern", repr(pattern))
        for some in faces:
            shares[some] = share
    return shares


def is_array(word: str) -> bool:
    """Whether a word of the option names a file of values."""
    return word.lower().endswith(".npy")


def _pair(word: str) -> tuple[str, float]:
    """Name and share; the name may have equals signs."""
    name, _, value = word.rpartition("=")
    try:
        share = float(value)
    except ValueError:
        share = -1.0
    good = bool(name) and 0.0 <= share <= 1.0
    expect(good, _OPTION, "NAME=VALUE with a number from 0 to 1, or an .npy file", repr(word))
    return name, share


def _faces_of(files: Files, pattern: str) -> Iterator[Any]:
    """The faces of each material, object and file of a name or pattern, or of a file at a path."""
    mesh = files.mesh
    named = [(material.name, mesh.face_materials == row) for row, material in enumerate(mesh.materials)]
    named += [(part.name, part.faces) for part in mesh.parts]
    for number, path in enumerate(files.paths):
        name = pattern if path == Path(pattern) else path.name
        named.append((name, slice(files.faces[number], files.faces[number + 1])))
    for name, faces in named:
        if name == pattern or fnmatchcase(name, pattern):
            yield faces
