"""Terrain: a grid of heights as a mesh."""

from __future__ import annotations

import numpy as np

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import lattice_faces


def heightfield_mesh(grid: ArrayLike, spacing: ArrayLike = 1.0, origin: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """Return the mesh of a grid of heights along z: a vertex for each, and two faces for each cell.

    Parameters
    ----------
    grid : array_like, shape (rows, columns)
        The height at x = column, y = row; at least 2 x 2. Give a raster whose first row is the northernmost as
        ``grid[::-1]``. The faces around a NaN are left out.
    spacing : float or array_like, shape (2,), default 1
        The distance of columns and rows, > 0; two numbers along x and y.
    origin : array_like, shape (3,), default (0, 0, 0)
        The place of the first row and column at height 0.

    Returns
    -------
    Mesh
        Vertex ``row * columns + column`` is that of the grid. Faces are counter-clockwise seen from above.

    Raises
    ------
    ValueError
        For a bad argument. The message names it and, for an infinite height, its place.

    Examples
    --------
    >>> from renderer.mesh.heightfield import heightfield_mesh
    >>> mesh = heightfield_mesh([[0, 0, 0], [0, 1, 0]], spacing=2.0, origin=(100, 200, 0))
    >>> mesh.vertices[4].tolist(), len(mesh.faces)
    ([102.0, 202.0, 1.0], 4)
    """
    with np.errstate(over="ignore"):
        heights = real_argument("grid", grid).astype(np.float64)
    shape = heights.shape
    expect(len(shape) == 2 and min(shape) >= 2, "grid", "shape (rows, columns), at least 2 each", f"shape {shape}")
    if np.isinf(heights).any():
        row, column = np.argwhere(np.isinf(heights))[0]
        expect(False, "grid", "finite heights, or NaN", f"{heights[row, column]} in row {row}, column {column}")
    steps = real_argument("spacing", spacing).astype(np.float64)
    good = steps.shape in ((), (2,)) and bool(((steps > 0.0) & np.isfinite(steps)).all())
    expect(good, "spacing", "a finite number > 0 or two", repr(spacing))
    start = real_argument("origin", origin).astype(np.float64)
    expect(start.shape == (3,) and bool(np.isfinite(start).all()), "origin", "three finite numbers", repr(origin))
    step_x, step_y = np.broadcast_to(steps, 2)
    known = np.isfinite(heights)
    # Somewhere within the bounds, for vertices that no face names.
    z = np.where(known, heights, heights[known].min() if known.any() else 0.0)
    y, x = np.meshgrid(np.arange(shape[0]) * step_y, np.arange(shape[1]) * step_x, indexing="ij")
    faces = lattice_faces(*shape)
    kept = known.ravel()[faces].all(axis=1)
    with np.errstate(over="ignore"):  # Mesh refuses what is not finite, with its row
        vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3) + start
    return Mesh(vertices, faces[kept], name="heightfield")
