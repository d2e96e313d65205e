"""Values of patches as colours of vertices, which programs blend over the faces."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect, expect_known
from renderer.mesh.crease import Split
from renderer.mesh.mesh import Mesh, give_materials, give_parts
from renderer.picture.image import srgb_of_linear
from renderer.radiosity.surfaces import reject_rows
from renderer.studies.places import face_areas
from renderer.trace.batch import whole_numbers

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def vertex_colors(
    mesh: Mesh,
    values: ArrayLike,
    *,
    crease: float = 30.0,
    surfaces: ArrayLike | None = None,
    exposure: float = 0.0,
    space: Literal["srgb", "linear"] = "srgb",
) -> Mesh:
    """Return the mesh with a colour for each vertex: the mean of the faces around it, which stops at sharp edges.

    Parameters
    ----------
    mesh : Mesh
    values : array_like, shape (F, 3) or (F,)
        Linear red, green and blue of each face, >= 0, such as radiosities; or a grey.
    crease : float, default 30
        From 0 to 180 degrees. Vertices are split at edges where the normals of faces differ by more.
    surfaces : array_like of int, shape (F,), optional
        The surface that each face belongs to, >= 0. Vertices are split between surfaces too. By default the materials
        of the mesh are its surfaces.
    exposure : float, default 0
        In stops: values are multiplied by 2^exposure. What is 1 or more then is white.
    space : {"srgb", "linear"}, default "srgb"
        How colours are kept: "srgb" for files, whose colours programs take for sRGB; "linear" for a material with
        ``vertex_colors="linear"``.

    Returns
    -------
    Mesh
        With ``colors``. Faces, their order and their corners' positions stay. `Mesh.save` writes the colours.

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row.

    Notes
    -----
    A vertex has the mean of the faces around it, weighted by their areas: of those that share a surface and are joined
    there by edges that are not sharp. Faces that share no vertices count as joined where they lie at one edge.

    Examples
    --------
    The corners where the two faces of a square meet have the mean; the two others their face's own grey.

    >>> import numpy as np
    >>> from renderer.mesh.shapes import box, grid
    >>> from renderer.radiosity import vertex_colors
    >>> print(vertex_colors(grid(), [0.0, 1.0], space="linear").colors)
    [[0.5 0.5 0.5]
     [0.  0.  0. ]
     [0.5 0.5 0.5]
     [1.  1.  1. ]]

    Sides of a box do not blend.

    >>> sides = np.repeat([0.0, 0.2, 0.4, 0.6, 0.8, 1.0], 2)
    >>> len(vertex_colors(box(), sides).vertices)
    24
    """
    expect(isinstance(mesh, Mesh), "mesh", "a renderer.Mesh", type(mesh).__name__)
    rows = _check_values(values, len(mesh.faces))
    owner = _check_surfaces(mesh, surfaces)
    stops = real_argument("exposure", exposure)
    expect(stops.ndim == 0 and bool(np.isfinite(stops)), "exposure", "a finite number of stops", repr(exposure))
    expect_known("space", space, ("srgb", "linear"))
    group, vertices, faces = _split(mesh, crease, owner)
    with np.errstate(over="ignore"):
        linear = np.clip(_means(mesh, group, rows)[group[vertices]] * np.exp2(float(stops)), 0.0, 1.0)
    colors = srgb_of_linear(linear) if space == "srgb" else linear
    used = mesh.faces.ravel()[vertices]
    normals, texcoords = (None if a is None else a[used] for a in (mesh.normals, mesh.texcoords))
    made = Mesh(mesh.vertices[used], faces, normals, colors, texcoords, mesh.name)
    return give_parts(give_materials(made, mesh.materials, mesh.face_materials), mesh.parts)


def _check_values(values: ArrayLike, count: int) -> Floats:
    given = real_argument("values", values)
    fits = given.shape in ((count,), (count, 3))
    expect(fits, "values", f"shape ({count},) or ({count}, 3), a row a face", f"shape {given.shape}")
    rows: Floats = np.array(given, np.float64).reshape(count, -1)
    reject_rows("values", "finite numbers >= 0", rows, ~((rows >= 0.0) & (rows < np.inf)))
    return np.array(np.broadcast_to(rows, (count, 3)))


def _check_surfaces(mesh: Mesh, surfaces: ArrayLike | None) -> Ints:
    if surfaces is None:
        rows = np.zeros(len(mesh.faces), np.int64) if mesh.face_materials is None else mesh.face_materials + 1
        return rows.astype(np.int64)
    count = len(mesh.faces)
    given = np.array(whole_numbers("surfaces", real_argument("surfaces", surfaces), (count,)), np.int64)
    reject_rows("surfaces", "numbers >= 0", given, given < 0)
    return np.unique(given, return_inverse=True)[1].astype(np.int64)


def _split(mesh: Mesh, crease: float, owner: Ints) -> tuple[Ints, Ints, Ints]:
    """Of each corner (3 F,) the number of those that share its colour; a corner of each new vertex; the new faces."""
    corner_owner = np.repeat(owner, 3)
    near = Split(mesh, crease).group.astype(np.int64) * (int(owner.max(initial=0)) + 1) + corner_owner
    group = np.unique(near, return_inverse=True)[1].astype(np.int64)
    # Vertices of one group may differ in normal or texture.
    keys = group * max(len(mesh.vertices), 1) + mesh.faces.ravel()
    _, first, corner = np.unique(keys, return_index=True, return_inverse=True)
    return group, first, corner.reshape(-1, 3)


def _means(mesh: Mesh, group: Ints, rows: Floats) -> Floats:
    """The mean of the faces of each group, by area; of faces without area the plain mean."""
    count = int(group.max(initial=-1)) + 1
    areas = np.repeat(face_areas(mesh), 3)
    flat = np.bincount(group, areas, count) == 0.0
    weights = np.where(flat[group], 1.0, areas)
    total = np.bincount(group, weights, count)
    shares = weights / total[group]
    return np.stack([np.bincount(group, shares * np.repeat(column, 3), count) for column in rows.T], axis=1)
