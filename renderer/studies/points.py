"""The points of a study: of faces, of vertices, of a grid or of a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from typing import Any, Literal
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.arguments.up import up_axis
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.mesh.ply import point_rows
from renderer.octree import Octree
from renderer.ordering.morton import order_along_curve
from renderer.studies.grid import grid_points
from renderer.studies.places import face_areas, face_points

Floats = NDArray[np.float64]
# What NumPy raises for files that it cannot read: a header is parsed as Python, and PK begins an archive.
_BROKEN = (ValueError, EOFError, TypeError, OverflowError, SyntaxError, TokenError, BadZipFile)
# Points that are sorted together: 32 bytes each, and a second of work.
_TOGETHER = 1 << 22


@dataclass(frozen=True, eq=False)
class Points:
    """The points of a study: ``points`` and ``normals`` (n, 3) float64, ``leaving`` (n,) int64, -1 for no face."""

    points: Floats
    normals: Floats
    leaving: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.points)

    def part(self, rows: slice | NDArray[np.int64]) -> Points:
        """The points of some rows."""
        return Points(self.points[rows], self.normals[rows], self.leaving[rows])

    def order(self) -> NDArray[np.int64]:
        """The rows (n,) along a space-filling curve, so that neighbours follow each other."""
        rows = np.empty(len(self), np.int64)
        for first in range(0, len(self), _TOGETHER):
            rows[first : first + _TOGETHER] = first + order_along_curve(self.points[first : first + _TOGETHER])[0]
        return rows


@dataclass(frozen=True, eq=False)
class Chosen:
    """Points, and how their results become values of the mesh.

    of_faces     from results (n,) to values of faces (F,), NaN for a face without; None if faces get no values
    of_vertices  the same for vertices (V,)
    """

    points: Points
    of_faces: Callable[[Floats], Floats] | None = None
    of_vertices: Callable[[Floats], Floats] | None = None


def on_faces(octree: Octree) -> Chosen:
    """The centroid of each face that has an area, on the side of its normal."""
    points, faces = _face_points(octree.mesh)

    def of_faces(answers: Floats) -> Floats:
        values = np.full(len(octree.mesh.faces), np.nan)
        values[faces] = answers
        return values

    return Chosen(points, of_faces)


def on_vertices(octree: Octree) -> Chosen:
    """The points of ``on_faces``; a vertex gets the mean of its faces' values, weighted by their areas.

    A vertex has no normal of its own, and studies need one to know its side.
    """
    chosen, mesh = on_faces(octree), octree.mesh
    assert chosen.of_faces is not None
    areas = face_areas(mesh)

    def of_vertices(answers: Floats) -> Floats:
        assert chosen.of_faces is not None
        values = chosen.of_faces(answers)
        known = np.flatnonzero(np.isfinite(values))
        rows, weights = mesh.faces[known].ravel(), np.repeat(areas[known], 3)
        total = np.bincount(rows, weights, len(mesh.vertices))
        with np.errstate(invalid="ignore", divide="ignore"):
            mean: Floats = np.bincount(rows, weights * np.repeat(values[known], 3), len(mesh.vertices)) / total
        return mean

    return Chosen(chosen.points, None, of_vertices)


def on_grid(
    octree: Octree,
    spacing: float,
    *,
    bounds: ArrayLike | None = None,
    height: float | None = None,
    up: Literal["x", "y", "z"] = "z",
) -> Chosen:
    """The points of ``grid_points``, at least one."""
    found = grid_points(octree, spacing, bounds=bounds, height=height, up=up)
    expect(len(found.points) > 0, "spacing", "points above the mesh", "none")
    return Chosen(Points(*found))


def of_file(octree: Octree, path: Path, up: Literal["x", "y", "z"] = "z") -> Chosen:
    """Points of an ``.npy``, ``.csv``, ``.xyz`` or ``.ply`` file, (n, 3), or (n, 6) with normals, else they look up.

    Studies find the faces of those that lie on the surface.
    """
    array = _rows_of_file("--points", path)
    good = array.ndim == 2 and array.shape[1] in (3, 6) and len(array) > 0
    expect(good, "--points", "an array (n, 3), or (n, 6) with normals, n >= 1", f"shape {array.shape} in {path}")
    points = np.ascontiguousarray(array[:, :3], np.float64)
    normals = np.ascontiguousarray(array[:, 3:], np.float64) if array.shape[1] == 6 else np.zeros(points.shape)
    if array.shape[1] == 3:
        normals[:, up_axis(up)] = 1.0
    return Chosen(Points(points, normals, np.full(len(points), -1, np.int64)))


def _face_points(mesh: Mesh) -> tuple[Points, NDArray[np.int64]]:
    found = face_points(mesh)
    expect(len(found.points) > 0, "mesh", "a face that has an area", "none")
    return Points(found.points, found.normals, found.faces), found.faces


def read_array(argument: str, path: Path) -> NDArray[Any]:
    """The array of real numbers in an ``.npy`` file."""
    try:
        with open(path, "rb") as file:  # which NumPy leaves open where it is broken
            array = np.load(file, allow_pickle=False)
    except OSError as error:
        raise unreadable(argument, path, error) from None
    except _BROKEN as error:
        raise ValueError(f"{argument}: expected an .npy file, got {path}: {error}") from None
    expect(isinstance(array, np.ndarray), argument, "one array in an .npy file", str(path))
    real = np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer)
    expect(real, argument, "real numbers", f"{array.dtype} in {path}")
    return np.asarray(array)


def _rows_of_file(argument: str, path: Path) -> NDArray[Any]:
    """The rows of a file of points, by its suffix."""
    suffix = path.suffix.lower()
    if suffix == ".npy":
        return read_array(argument, path)
    expect(suffix in (".csv", ".xyz", ".ply"), argument, "an .npy, .csv, .xyz or .ply file", str(path))
    try:
        if suffix == ".ply":
            return point_rows(path.read_bytes())
        return _text_rows(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise unreadable(argument, path, error) from None
    except ValueError as error:
        raise ValueError(f"{argument}: expected rows of 3 or 6 numbers, got {path}: {error}") from None


def _text_rows(text: str) -> NDArray[np.float64]:
    """Numbers separated by spaces, commas or semicolons, a row a line; a first line of names is passed over."""
    lines = [line.split("#")[0].replace(",", " ").replace(";", " ").split() for line in text.splitlines()]
    rows = [line for line in lines if line]
    if rows and all(word[:1].isalpha() and word.lower() not in ("nan", "inf") for word in rows[0]):
        rows = rows[1:]
    return np.array(rows, np.float64) if rows else np.empty((0, 3))


def unreadable(argument: str, path: Path, error: OSError) -> ValueError:
    """The error for a file that cannot be read."""
    return ValueError(f"{argument}: expected a file that can be read, got {path}: {error.strerror or error}")
