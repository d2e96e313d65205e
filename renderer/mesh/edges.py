"""Places of vertices, and the edges of a mesh that bound nothing: those at which its surface is open."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def open_edges(vertices: NDArray[np.float64], faces: NDArray[np.int32], oriented: bool) -> NDArray[np.int64]:
    """(k, 2) vertex numbers of the edges at which a surface is open, one row for each place, in the order of the faces.

    Vertices at one position count as one, so triangle soup is as closed as a shared mesh. With ``oriented`` an edge is
    closed where as many faces pass it in one direction as in the other, else where an even number of faces has it.
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    first, second, edge = sides(vertices, faces)
    # An edge from a place to itself, of a face with two corners in one place, bounds nothing.
    real = (first != second).ravel()
    start, end, first, second = start[real], end[real], first.ravel()[real], second.ravel()[real]
    _, rows, edge = np.unique(edge.ravel()[real], return_index=True, return_inverse=True)
    ways = np.where(first < second, 1.0, -1.0) if oriented else None
    passed = np.bincount(edge.ravel(), weights=ways, minlength=len(rows))
    is_open = passed != 0 if oriented else passed % 2 == 1
    found = np.sort(rows[is_open])
    return np.stack([start[found], end[found]], axis=1).astype(np.int64)


def places(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """A number for each vertex that those at the same place share."""
    # 0.0 added, so that -0.0 is the same place.
    # rule: zero-without-sign
    rows = np.ascontiguousarray(vertices + 0.0).view("V24").ravel()
    return np.unique(rows, return_inverse=True)[1].ravel().astype(np.int64)


def sides(
    vertices: NDArray[np.float64], faces: NDArray[np.integer[Any]]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Of each side (f, 3) of each face the places where it starts and ends, and a number that its edge alone has.

    Vertices at one position have one number, and so have edges between the same positions.
    """
    place = places(vertices)
    start, end = place[faces], place[np.roll(faces, -1, axis=1)]
    return start, end, np.minimum(start, end) * len(vertices) + np.maximum(start, end)
