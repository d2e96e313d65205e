"""Writing meshes: PLY, plain or coloured by values."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments.arrays import real_argument
from renderer.errors import expect
from renderer.mesh.colormaps import colors_of, scale_of
from renderer.mesh.mesh import Mesh
from renderer.mesh.ply import by_name, format_columns, format_ply, vertex_columns
from renderer.mesh.values import Owner, owned_values
from renderer.system.files import as_path, write_atomically


def save_mesh(
    mesh: Mesh,
    path: str | os.PathLike[str],
    values: ArrayLike | None,
    cmap: str,
    on: Owner | None,
    limits: tuple[float, float] | None,
) -> None:
    """Write a PLY file, see ``Mesh.save``."""
    target = as_path("path", path)
    expect(target.suffix.lower() == ".ply", "path", "a file name that ends in .ply", repr(str(path)))
    if values is None:
        content = format_ply(mesh)
    else:
        rows, owner = owned_values(mesh, values, on)
        expect(rows.ndim == 1, "values", f"one value for each of the {owner}", f"shape {rows.shape}")
        columns = vertex_columns(mesh, colors=False)
        content = format_valued(columns, mesh.faces, rows.astype(np.float64), owner == "faces", cmap, _ends(limits))
    write_atomically(target, lambda file: file.write(content))


def format_valued(
    points: dict[str, NDArray[np.floating]],
    faces: NDArray[np.int32] | None,
    values: NDArray[np.float64],
    of_faces: bool,
    cmap: str = "viridis",
    limits: tuple[float, float] | None = None,
) -> bytes:
    """A binary PLY whose vertices, or faces, have ``red``, ``green``, ``blue`` and the ``value`` itself as double.

    points : columns of the vertices. faces : None for a cloud of points. limits : None for the values' own.
    """
    colors = colors_of(values, scale_of(values) if limits is None else limits, cmap)
    valued = {"value": values, **by_name(("red", "green", "blue"), colors)}
    return format_columns(points, faces, valued) if of_faces else format_columns(points | valued, faces)


def _ends(limits: tuple[float, float] | None) -> tuple[float, float] | None:
    if limits is None:
        return None
    ends = real_argument("limits", limits)
    good = ends.shape == (2,) and bool(np.isfinite(ends).all() and ends[0] <= ends[1])
    expect(good, "limits", "two finite numbers, low <= high, or None", repr(limits))
    return float(ends[0]), float(ends[1])
