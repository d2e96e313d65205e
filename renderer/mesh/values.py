"""Values of a mesh's vertices or faces, and what they are at places on the faces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments.arrays import real_argument
from renderer.errors import expect

if TYPE_CHECKING:
    from renderer.mesh.mesh import Mesh

# What values belong to.
Owner = Literal["vertices", "faces"]


def interpolated(
    mesh: Mesh,
    face: NDArray[np.int64],
    u: NDArray[np.float64],
    v: NDArray[np.float64],
    values: ArrayLike,
    on: Owner | None,
) -> NDArray[np.float64]:
    """Values at places of any shape (...), nan where ``face`` is -1; see ``Hits.interpolate``."""
    rows, owner = owned_values(mesh, values, on)
    found = np.full((*face.shape, *rows.shape[1:]), np.nan)
    there = face >= 0
    if owner == "faces":
        found[there] = rows[face[there]]
        return found
    corners, more = mesh.faces[face[there]], (np.newaxis,) * (rows.ndim - 1)
    u, v = u[there][:, *more], v[there][:, *more]
    found[there] = (1.0 - u - v) * rows[corners[:, 0]] + u * rows[corners[:, 1]] + v * rows[corners[:, 2]]
    return found


def owned_values(mesh: Mesh, values: ArrayLike, on: Owner | None) -> tuple[NDArray[Any], Owner]:
    """Values of all vertices or all faces, a row each, and their owners: by the number of rows where ``on`` is None.

    Raises ``ValueError`` naming the argument.
    """
    rows = real_argument("values", values)
    counts: dict[Owner, int] = {"vertices": len(mesh.vertices), "faces": len(mesh.faces)}
    expect(on is None or on in counts, "on", "'vertices', 'faces' or None", repr(on))
    either = f"{counts['vertices']} rows, one a vertex, or {counts['faces']}, one a face"
    fits = [owner for owner in counts if on in (None, owner) and rows.ndim and len(rows) == counts[owner]]
    expect(bool(fits), "values", either if on is None else f"{counts[on]} rows for on={on!r}", f"shape {rows.shape}")
    many = f"on='vertices' or on='faces', as the mesh has {len(rows) if rows.ndim else 0} of both"
    expect(len(fits) == 1, "values", many, "neither")
    return rows, fits[0]
