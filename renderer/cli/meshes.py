"""The meshes of a study: their files, the axis that points up, and the values of each file."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from renderer.errors import expect

# By the format; other files do not say.
_UP_OF_GLB, _UP = "y", "z"


@dataclass(frozen=True)
class Files:
    """Mesh files and their meshes in one: faces and vertices follow each other in the order of the files.

    faces, vertices  where those of each file begin, and the number of all
    """

    paths: list[Path]
    mesh: Any
    faces: list[int]
    vertices: list[int]


def kept_of(paths: Sequence[Path], hidden: Sequence[str]) -> list[Path]:
    """The files that no name or pattern of ``hidden`` leaves out."""
    from renderer.system.files import are_apart

    expect(are_apart(paths), "mesh", "each file once", ", ".join(map(str, paths)))
    kept = list(paths)
    for pattern in hidden:
        named = [path for path in paths if path == Path(pattern) or fnmatchcase(path.name, pattern)]
        expect(bool(named), "--hide", "the name of a mesh file, or a pattern of names", repr(pattern))
        kept = [path for path in kept if path not in named]
    expect(bool(kept), "--hide", "one file at least that is left", "none")
    return kept


def load_files(paths: list[Path]) -> Files:
    """Load all files as one mesh."""
    from renderer.mesh.load import load_mesh
    from renderer.mesh.mesh import Mesh

    meshes = [load_mesh(path) for path in paths]
    faces, vertices = [0], [0]
    for mesh in meshes:
        faces.append(faces[-1] + len(mesh.faces))
        vertices.append(vertices[-1] + len(mesh.vertices))
    return Files(paths, meshes[0] if len(meshes) == 1 else Mesh.concatenate(meshes), faces, vertices)


def up_of(paths: Sequence[Path], given: str | None) -> tuple[str, str]:
    """The name of the axis that points up, and the line that says so where neither the user nor a file does."""
    if given is not None:
        return given, ""
    from renderer.mesh.load import Y_UP, mesh_suffix

    silent = [path for path in paths if mesh_suffix(path) not in Y_UP]
    if not silent:
        return _UP_OF_GLB, ""
    expect(len(silent) == len(paths), "--up", "an axis for .glb and .gltf files, whose y is up, beside others", "none")
    who = f"{paths[0]} does" if len(paths) == 1 else "the mesh files do"
    return _UP, f"{who} not say which axis points up: {_UP} was taken; --up x|y|z changes it"


def say_up(line: str) -> None:
    """Say on standard error which axis was taken."""
    print(f"octree-render: {line}", file=sys.stderr)


def values_of_files(files: Files, chosen: Any, answers: Any) -> Iterator[str]:
    """A table of the values on each file; no line where points are on no known face."""
    import numpy as np

    from renderer.studies.places import face_areas

    on = chosen.points.leaving
    if (on < 0).any():
        return
    starts = files.faces if chosen.of_faces else files.vertices if chosen.of_vertices else None
    weights = np.ones(len(on)) if starts is None else face_areas(files.mesh)[on]
    owner = np.searchsorted(files.faces, on, side="right") - 1
    head = ("points", "mean") if starts is None else ("rows", "mean by area")
    yield _columns(*head, "least", "greatest", "file")
    for number, path in enumerate(files.paths):
        here = owner == number
        values = answers[here]
        rows = f"{len(values)}" if starts is None else f"{starts[number]}:{starts[number + 1]}"
        mean, least, greatest = np.nan, np.nan, np.nan
        if len(values):
            mean, least, greatest = np.average(values, weights=weights[here]), values.min(), values.max()
        yield _columns(rows, f"{mean:.4g}", f"{least:.4g}", f"{greatest:.4g}", str(path))


def _columns(rows: str, mean: str, least: str, greatest: str, file: str) -> str:
    return f"  {rows:<16}{mean:<14}{least:<10}{greatest:<10}{file}"
