"""``--transmittance``: the share of each ray that the faces of a material, an object or a file let through."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any

from renderer.cli.meshes import Files
from renderer.errors import expect

_TRANSMITTANCE = (
    "the share of each ray, from 0 to 1, that faces let through: those of the material, object or mesh file of this "
    "name or pattern, such as 'tree*=0.3'; may be given again, and the last one holds"
)


def add_transmittance(command: Any) -> None:
    """Add the option to a command."""
    command.add_argument("--transmittance", action="append", metavar="NAME=VALUE", help=_TRANSMITTANCE)


def transmittance_of(files: Files, given: Sequence[str] | None) -> Any:
    """The share that each face lets through, (F,) float64, by the words of the option; None without any.

    Raises ``ValueError`` for words that are no name and share, and for a name that nothing has.
    """
    import numpy as np

    if not given:
        return None
    shares, named = np.zeros(len(files.mesh.faces)), list(_named(files))
    for word in given:
        pattern, share = _pair(word)
        faces = [faces for name, faces in named if name == pattern or fnmatchcase(name, pattern)]
        expect(bool(faces), "--transmittance", "the name of a material, an object or a mesh file", repr(pattern))
        for some in faces:
            shares[some] = share
    return shares


def _pair(word: str) -> tuple[str, float]:
    """Name and share; the name may have equals signs."""
    name, _, value = word.rpartition("=")
    try:
        share = float(value)
    except ValueError:
        share = -1.0
    expect(bool(name) and 0.0 <= share <= 1.0, "--transmittance", "NAME=VALUE with a value from 0 to 1", repr(word))
    return name, share


def _named(files: Files) -> Iterator[tuple[str, Any]]:
    """What may be named, and its faces: materials, objects and files."""
    mesh = files.mesh
    for row, material in enumerate(mesh.materials):
        yield material.name, mesh.face_materials == row
    for part in mesh.parts:
        yield part.name, part.faces
    for number, path in enumerate(files.paths):
        yield path.name, slice(files.faces[number], files.faces[number + 1])
