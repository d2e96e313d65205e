"""The points of a study: of faces, of vertices, of a grid or of a file; and directions to the sun of a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.ordering.morton import order_along_curve
from renderer.studies.places import face_points

Floats = NDArray[np.float64]
# What NumPy raises for files that it cannot read: a header is parsed as Python, and PK begins an archive.
_BROKEN = (ValueError, EOFError, TypeError, OverflowError, SyntaxError, TokenError, BadZipFile)
# Points that are put in order together: 32 bytes each while it is done, and a second of sorting.
_TOGETHER = 1 << 22
# More would not fit into memory with their normals and results: 7 numbers of 8 bytes each.
_MOST = 1 << 28


@dataclass(frozen=True, eq=False)
class Points:
    """The points of a study: ``points`` and ``normals`` (n, 3) float64, and ``leaving`` (n,) int64, -1 for a face that
    is not known.
    """

    points: Floats
    normals: Floats
    leaving: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.points)

    def part(self, rows: slice | NDArray[np.int64]) -> Points:
        """Those of some rows."""
        return Points(self.points[rows], self.normals[rows], self.leaving[rows])

    def order(self) -> NDArray[np.int64]:
        """The rows (n,) in which those that follow each other lie together, along a curve that fills space."""
        rows = np.empty(len(self), np.int64)
        for first in range(0, len(self), _TOGETHER):
            rows[first : first + _TOGETHER] = first + order_along_curve(self.points[first : first + _TOGETHER])[0]
        return rows


@dataclass(frozen=True, eq=False)
class Chosen:
    """Points, and functions that spread their answers over the mesh.

    of_faces : from the answers (n,) to one a face (F,), NaN where a face has none; None where points are on no faces.
    of_vertices : to one a vertex (V,), NaN where it has none; None likewise.
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
    """As on faces; a vertex gets the mean of its faces' answers by their areas.

    A vertex has no normal of its own, by which studies know its side.
    """
    chosen, mesh = on_faces(octree), octree.mesh
    assert chosen.of_faces is not None
    corners = mesh.triangles
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)

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


def on_grid(octree: Octree, spacing: float) -> Chosen:
    """A grid of points as seen from above (z up): where vertical rays first meet the mesh, on the upper side.

    The points of the grid lie at multiples of ``spacing`` above the lower left corner of the mesh's box, half a
    spacing in; where a ray meets nothing there is no point.
    """
    expect(bool(0.0 < spacing < np.inf), "--grid", "a number > 0, in the mesh's units", f"{spacing:g}")
    lower, upper = octree.mesh.bounds
    with np.errstate(over="ignore"):
        counts = np.maximum(1.0, np.ceil((upper - lower)[:2] / spacing))
        number = counts.prod()
    expect(number <= _MOST, "--grid", f"a spacing with at most {_MOST:,} points", f"{number:.4g}")
    x, y = (lower[a] + spacing * (np.arange(int(counts[a])) + 0.5) for a in (0, 1))
    # The last may stand beside the mesh, and too far away for any ray.
    x, y = x[x <= upper[0]], y[y <= upper[1]]
    start = float(upper[2]) + float(np.abs(octree.mesh.bounds).max()) * 2.0**-20 + float(octree.mesh.extent.max())
    origins = np.stack([*(g.ravel() for g in np.meshgrid(x, y)), np.full(len(x) * len(y), start)], axis=1)
    hits = octree.closest_hit(origins, (0.0, 0.0, -1.0))
    seen = np.flatnonzero(hits.hit)
    expect(len(seen) > 0, "--grid", "points above the mesh", "none")
    normals = hits.normals[seen]
    normals[normals[:, 2] < 0.0] *= -1.0
    return Chosen(Points(hits.points[seen], normals, hits.face[seen].astype(np.int64)))


def of_file(octree: Octree, path: Path) -> Chosen:
    """Points of an ``.npy`` file, (n, 3), or (n, 6) with normals behind them. Points without normals look up.

    Studies find out which of them lie on the surface, and on which faces.
    """
    array = _read_array("--points", path)
    good = array.ndim == 2 and array.shape[1] in (3, 6) and len(array) > 0
    expect(good, "--points", "an array (n, 3), or (n, 6) with normals, n >= 1", f"shape {array.shape} in {path}")
    points = np.ascontiguousarray(array[:, :3], np.float64)
    normals = np.ascontiguousarray(array[:, 3:], np.float64) if array.shape[1] == 6 else np.zeros(points.shape)
    if array.shape[1] == 3:
        normals[:, 2] = 1.0
    return Chosen(Points(points, normals, np.full(len(points), -1, np.int64)))


def suns_of(path: Path) -> tuple[Floats, Floats]:
    """Directions to the sun (k, 3) and the hours of each (k,) of a text file: x y z and hours, or x y z for one hour.

    A line that begins with # is none; numbers are parted by spaces or commas.
    """
    try:
        text = path.read_text(encoding="utf-8").replace(",", " ")
        rows = np.array([line.split() for line in text.splitlines() if line.split("#")[0].strip()], np.float64)
    except OSError as error:
        raise _unreadable("--suns", path, error) from None
    except ValueError as error:
        raise ValueError(f"--suns: expected rows of 3 or 4 numbers, got {path}: {error}") from None
    good = rows.ndim == 2 and rows.shape[1] in (3, 4)
    expect(good, "--suns", "rows x y z, or x y z hours", f"an array of shape {rows.shape} in {path}")
    return rows[:, :3].copy(), rows[:, 3].copy() if rows.shape[1] == 4 else np.ones(len(rows))


def _face_points(mesh: Mesh) -> tuple[Points, NDArray[np.int64]]:
    found = face_points(mesh)
    expect(len(found.points) > 0, "mesh", "a face that has an area", "none")
    return Points(found.points, found.normals, found.faces), found.faces


def _read_array(argument: str, path: Path) -> NDArray[Any]:
    try:
        with open(path, "rb") as file:  # which NumPy leaves open where it is broken
            array = np.load(file, allow_pickle=False)
    except OSError as error:
        raise _unreadable(argument, path, error) from None
    except _BROKEN as error:
        raise ValueError(f"{argument}: expected an .npy file, got {path}: {error}") from None
    expect(isinstance(array, np.ndarray), argument, "one array in an .npy file", str(path))
    real = np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer)
    expect(real, argument, "real numbers", f"{array.dtype} in {path}")
    return np.asarray(array)


def _unreadable(argument: str, path: Path, error: OSError) -> ValueError:
    return ValueError(f"{argument}: expected a file that can be read, got {path}: {error.strerror or error}")
