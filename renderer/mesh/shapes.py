"""Meshes of simple shapes: float64, faces wound outward, vertices shared between faces."""

from __future__ import annotations

import numpy as np

from renderer.errors import expect
from renderer.mesh.mesh import Float64Array, Int32Array, Mesh


def icosphere(level: int = 3) -> Mesh:
    """The unit sphere at the origin, by an icosahedron whose faces are cut in four ``level`` times.

    Parameters
    ----------
    level : int, default 3
        From 0 to 10.

    Returns
    -------
    Mesh
        ``20 * 4**level`` faces; vertices lie on the sphere but for rounding.

    Raises
    ------
    ValueError
        For another level.

    Examples
    --------
    >>> from renderer import shapes
    >>> shapes.icosphere(2).faces.shape
    (320, 3)
    """
    expect(0 <= level <= 10, "level", "0 to 10", level)
    golden = (1 + np.sqrt(5)) / 2
    signs = [(-1, -1), (1, -1), (-1, 1), (1, 1)]
    corners = np.array([np.roll((0, a, b * golden), turn) for turn in range(3) for a, b in signs])
    vertices = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    faces = _ICOSAHEDRON_FACES
    for _ in range(level):
        vertices, faces = _subdivided(vertices, faces)
        vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return Mesh(vertices, faces, name="icosphere")


def torus(major: float = 1.0, minor: float = 0.25, around: int = 64, across: int = 32) -> Mesh:
    """A torus about the y axis at the origin.

    Parameters
    ----------
    major : float, default 1
        The radius of the circle in the middle of the tube.
    minor : float, default 0.25
        The radius of the tube, less than ``major``.
    around, across : int, default 64 and 32
        The number of segments along the circle and around the tube, at least 3.

    Returns
    -------
    Mesh
        ``2 * around * across`` faces.

    Raises
    ------
    ValueError
        For other radii or numbers.

    Examples
    --------
    >>> from renderer import shapes
    >>> ring = shapes.torus(around=8, across=4)
    >>> ring.faces.shape, ring.is_closed()
    ((64, 3), True)
    """
    expect(0 < minor < major, "minor", f"in (0, major = {major})", minor)
    expect(around >= 3 and across >= 3, "around, across", "at least 3", (around, across))
    u = np.arange(around)[:, None] * (2 * np.pi / around)
    v = np.arange(across)[None, :] * (2 * np.pi / across)
    ring = major + minor * np.cos(v)
    height = np.broadcast_to(minor * np.sin(v), (around, across))
    points = np.stack([ring * np.cos(u), height, ring * np.sin(u)], axis=-1)
    faces = lattice_faces(around, across, wrap_rows=True, wrap_columns=True)
    return Mesh(points.reshape(-1, 3), faces, name="torus")


def box(lower: tuple[float, float, float] = (0, 0, 0), upper: tuple[float, float, float] = (1, 1, 1)) -> Mesh:
    """A box parallel to the axes.

    Parameters
    ----------
    lower, upper : (float, float, float), default (0, 0, 0) and (1, 1, 1)
        The least and the greatest corner.

    Returns
    -------
    Mesh
        8 vertices and 12 faces.

    Raises
    ------
    ValueError
        Where ``upper`` is not above ``lower``.

    Examples
    --------
    >>> from renderer import shapes
    >>> shapes.box(upper=(2, 1, 1)).extent
    array([2., 1., 1.])
    """
    expect(all(a < b for a, b in zip(lower, upper, strict=True)), "upper", f"above lower = {lower}", upper)
    corners = [[(lower, upper)[(corner >> axis) & 1][axis] for axis in range(3)] for corner in range(8)]
    return Mesh(np.array(corners, dtype=np.float64), _BOX_FACES, name="box")


def grid(rows: int = 1, columns: int = 1, size: tuple[float, float] = (1.0, 1.0)) -> Mesh:
    """A rectangle in the plane y = 0, centred at the origin, whose normal is +y.

    Parameters
    ----------
    rows, columns : int, default 1
        The number of cells along z and along x.
    size : (float, float), default (1, 1)
        The lengths along x and z.

    Returns
    -------
    Mesh
        ``2 * rows * columns`` faces. Texture coordinates run from (0, 0) at least x and greatest z to (1, 1).

    Raises
    ------
    ValueError
        For fewer than one row or column.

    Examples
    --------
    >>> from renderer import shapes
    >>> shapes.grid(2, 3).faces.shape
    (12, 3)
    """
    expect(rows >= 1 and columns >= 1, "rows, columns", "at least 1", (rows, columns))
    s, t = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    points = np.stack([(s - 0.5) * size[0], np.zeros_like(s), (0.5 - t) * size[1]], axis=-1)
    texcoords = np.stack([s, t], axis=-1).reshape(-1, 2)
    return Mesh(points.reshape(-1, 3), lattice_faces(rows + 1, columns + 1), texcoords=texcoords, name="grid")


def lattice_faces(rows: int, columns: int, wrap_rows: bool = False, wrap_columns: bool = False) -> Int32Array:
    """Two faces for each cell of a rows x columns lattice of vertices numbered row by row.

    Seen with rows going up and columns to the right, faces run counter-clockwise. A wrapped direction joins
    its last line of vertices to the first.
    """
    row = np.arange(rows if wrap_rows else rows - 1)[:, None]
    column = np.arange(columns if wrap_columns else columns - 1)[None, :]
    up, right = (row + 1) % rows, (column + 1) % columns
    a, b, c, d = (r * columns + k for r, k in ((row, column), (row, right), (up, right), (up, column)))
    cells = np.stack(np.broadcast_arrays(a, b, c, a, c, d), axis=-1)
    return cells.reshape(-1, 3).astype(np.int32)


def _subdivided(vertices: Float64Array, faces: Int32Array) -> tuple[Float64Array, Int32Array]:
    """Each face cut in four at the middles of its edges, which neighbours share."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges.sort(axis=1)
    keys, inverse = np.unique(edges[:, 0].astype(np.int64) * len(vertices) + edges[:, 1], return_inverse=True)
    middles = (vertices[keys // len(vertices)] + vertices[keys % len(vertices)]) / 2
    ab, bc, ca = (len(vertices) + inverse.reshape(-1, 3)).T
    a, b, c = faces.T
    quarters = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
    return np.concatenate([vertices, middles]), quarters.reshape(-1, 3).astype(np.int32)


_BOX_FACES: Int32Array = np.array(
    [[0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5], [0, 1, 5], [0, 5, 4],
     [2, 6, 7], [2, 7, 3], [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6]], dtype=np.int32
)  # fmt: skip

_ICOSAHEDRON_FACES: Int32Array = np.array(
    [[0, 4, 1], [0, 1, 6], [0, 8, 4], [0, 6, 9], [0, 9, 8], [1, 4, 10], [1, 11, 6], [1, 10, 11], [2, 3, 5],
     [2, 7, 3], [2, 5, 8], [2, 9, 7], [2, 8, 9], [3, 10, 5], [3, 7, 11], [3, 11, 10], [4, 8, 5], [4, 5, 10],
     [6, 7, 9], [6, 11, 7]], dtype=np.int32
)  # fmt: skip
