"""Patches of a mesh: its faces cut until no edge is too long, or where somebody wants them smaller.

Own code: ``trimesh.remesh.subdivide_to_size`` cuts a face whole and leaves its neighbours, so that corners lie on the
edges of others. There light leaks between patches, and colours tear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import plain_argument, read_only, real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.mesh.edges import sides
from renderer.mesh.mesh import Mesh, give_materials, give_parts
from renderer.mesh.parts import parts_of
from renderer.studies.factors.surfaces import areas_of

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

# The most patches of one mesh: an edge that leads to more is a slip of units. Radiosities alone have 0.4 GB then.
MOST_PATCHES = 1 << 24


@dataclass(frozen=True, eq=False)
class Patches:
    """A mesh cut into patches: each is a face of ``mesh``.

    Attributes
    ----------
    mesh : Mesh
        Its faces are the patches, those of one face side by side, in the order of faces. New vertices lie in the middle
        of edges; what vertices carry is the mean of that at the edge's ends. Materials and parts stay.
    faces : ndarray of int64, shape (n,)
        The face of the given mesh that each patch is a part of.

    Examples
    --------
    Values of faces become values of patches by this index.

    >>> import numpy as np
    >>> from renderer.mesh.shapes import grid
    >>> from renderer.radiosity import patches
    >>> cut = patches(grid(), 0.75)
    >>> cut.faces
    array([0, 0, 0, 0, 1, 1, 1, 1])
    >>> np.array([0.2, 0.8])[cut.faces]
    array([0.2, 0.2, 0.2, 0.2, 0.8, 0.8, 0.8, 0.8])
    """

    mesh: Mesh
    faces: Ints


def patches(mesh: Mesh, edge: float) -> Patches:
    """Cut the faces of a mesh until no edge is longer than ``edge``.

    Parameters
    ----------
    mesh : Mesh
    edge : float
        The greatest length of an edge, > 0, in units of the mesh.

    Returns
    -------
    Patches

    Raises
    ------
    ValueError
        For another ``mesh`` or ``edge``, and where there would be more than 2^24 patches.

    Notes
    -----
    An edge is cut in the middle if it is longer than ``edge``, by that alone. So the faces on both sides of an edge
    cut it at the same points, also where they share no vertices but lie at one place: no corner of a patch lies
    within an edge of another, unless one of the given mesh does.

    A face whose three edges are cut becomes four faces of its own shape. Otherwise its longest edge is cut first, then
    another (Rivara, Algorithms for refining triangular grids suitable for adaptive and multigrid techniques, 1984).
    The new edge to the middle of the longest one has at most sqrt(3) / 2 of its length, so the cuts end.

    Patches of a long thin face are short, but not less thin.

    Examples
    --------
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import patches
    >>> cut = patches(box(), 0.5)
    >>> len(cut.mesh.faces), cut.mesh.is_closed()
    (96, True)
    """
    expect(isinstance(mesh, Mesh), "mesh", "a renderer.Mesh", type(mesh).__name__)
    length = real_argument("edge", edge)
    expect(length.ndim == 0 and bool(0.0 < length < np.inf), "edge", "a finite number > 0", repr(edge))
    # No triangle with such edges is larger than an equilateral one.
    _expect_few("edge", areas_of(mesh).sum() / float(length) / float(length) / (0.25 * math.sqrt(3.0)))
    found = Patches(mesh, read_only(np.arange(len(mesh.faces), dtype=np.int64)))
    while True:
        edges = _Edges(found.mesh)
        cut = edges.lengths > float(length)
        if not cut.any():
            return found
        found = _cut("edge", found, edges, cut)


def refined(patches: Patches, marked: ArrayLike) -> Patches:
    """Cut the marked patches in four, and their neighbours so that edges still fit.

    Parameters
    ----------
    patches : Patches
    marked : array_like of bool, shape (n,)
        The patches to cut.

    Returns
    -------
    Patches
        Of the same given mesh: ``faces`` has its faces. Without a mark it is ``patches`` itself.

    Raises
    ------
    ValueError
        For other ``marked``, and where there would be more than 2^24 patches.

    Notes
    -----
    Where one of a patch's edges is cut, its longest is cut too. Cuts spread over neighbours until that is so
    everywhere. Therefore angles stay at least half as wide as the least of the given face, however often patches are
    refined (Rosenberg, Stenger, A lower bound on the angles of triangles constructed by bisecting the longest side,
    1975).

    Examples
    --------
    >>> from renderer.mesh.shapes import grid
    >>> from renderer.radiosity import patches, refined
    >>> halves = patches(grid(), 9.0)
    >>> refined(halves, [True, False]).faces
    array([0, 0, 0, 0, 1, 1])
    """
    expect(isinstance(patches, Patches), "patches", "Patches", type(patches).__name__)
    given = plain_argument("marked", marked)
    count = len(patches.faces)
    fits = given.dtype == np.bool_ and given.shape == (count,)
    expect(fits, "marked", f"bool of shape ({count},), one a patch", f"{given.dtype} of shape {given.shape}")
    if not given.any():
        return patches
    edges = _Edges(patches.mesh)
    cut = np.zeros(len(edges.lengths), np.bool_)
    cut[edges.number[given]] = True
    own = np.take_along_axis(edges.number, edges.longest[:, None], axis=1)[:, 0]
    while True:
        due = own[cut[edges.number].any(axis=1)]
        if cut[due].all():
            return _cut("marked", patches, edges, cut)
        cut[due] = True


class _Edges:
    """The edges of a mesh, by position: faces that share no vertices share edges where these lie at one place.

    number  (F, 3), the edge from each corner of a face to the next
    lengths (n,), of each edge
    longest (F,), the corner at which the longest edge of each face starts
    """

    def __init__(self, mesh: Mesh) -> None:
        _, _, key = sides(mesh.vertices, mesh.faces)
        _, first, number = np.unique(key.ravel(), return_index=True, return_inverse=True)
        self.number = number.reshape(-1, 3)
        start, end = mesh.faces.ravel()[first], np.roll(mesh.faces, -1, axis=1).ravel()[first]
        with np.errstate(over="ignore"):  # what is too long for float64 is too long
            x, y, z = (mesh.vertices[start] - mesh.vertices[end]).T
            self.lengths: Floats = np.hypot(np.hypot(x, y), z)
        # Of edges of one length the one with the greatest number counts as longer, in each of its faces.
        rank = np.empty(len(first), np.int64)
        rank[np.argsort(self.lengths, kind="stable")] = np.arange(len(first))
        self.longest: Ints = rank[self.number].argmax(axis=1)


def _expect_few(argument: str, count: float) -> None:
    expect(count <= MOST_PATCHES, argument, f"at most {MOST_PATCHES} patches from it", f"{count:.3g} or more")


def _cut(argument: str, given: Patches, edges: _Edges, cut: NDArray[np.bool_]) -> Patches:
    """The patches with each edge of ``cut`` cut in its middle. ``ValueError`` names the argument if they are many."""
    mesh = given.mesh
    # Each edge that is cut gives each of its faces one piece more.
    _expect_few(argument, len(mesh.faces) + int(cut[edges.number].sum()))
    turn = (edges.longest[:, None] + np.arange(3)) % 3
    corners = np.take_along_axis(mesh.faces, turn, axis=1).astype(np.int64)
    due = np.take_along_axis(cut[edges.number], turn, axis=1)
    middles, ends = _middles(corners, due, len(mesh.vertices))
    faces, owners = _pieces(corners, middles, due)
    order = np.argsort(owners, kind="stable")
    return _made(given, faces[order], owners[order], ends)


def _middles(corners: Ints, due: NDArray[np.bool_], count: int) -> tuple[Ints, Ints]:
    """The new vertices on the edges that are due, (F, 3), -1 on others; and the ends (k, 2) of the edge of each."""
    start, end = corners[due], np.roll(corners, -1, axis=1)[due]
    keys, inverse = np.unique(np.minimum(start, end) * count + np.maximum(start, end), return_inverse=True)
    middles = np.full(corners.shape, -1, np.int64)
    middles[due] = count + inverse
    return middles, np.stack([keys // count, keys % count], axis=1)


def _pieces(corners: Ints, middles: Ints, due: NDArray[np.bool_]) -> tuple[Ints, Ints]:
    """The faces that faces are cut into, and of which each is a part. The first edge of a face is its longest."""
    kind = due @ np.array([1, 2, 4])
    faces, owners = [], []
    for edges, pieces in _PIECES.items():
        rows = np.flatnonzero(kind == edges)
        six = np.concatenate([corners[rows], middles[rows]], axis=1)
        faces.append(six[:, pieces].reshape(-1, 3))
        owners.append(np.repeat(rows, len(pieces)))
    return np.concatenate(faces), np.concatenate(owners)


# By the edges that are cut, 1 the longest, 2 and 4 those after it: pieces by their corners. 0, 1, 2 are corners of the
# face, 3, 4, 5 the middles of the edges behind them. An edge is never cut without the longest.
_PIECES = {
    0: [[0, 1, 2]],
    1: [[0, 3, 2], [3, 1, 2]],
    3: [[0, 3, 2], [3, 1, 4], [3, 4, 2]],
    5: [[0, 3, 5], [5, 3, 2], [3, 1, 2]],
    7: [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
}


def _made(given: Patches, faces: Ints, owners: Ints, ends: Ints) -> Patches:
    """The patches with new faces, each a part of the one in ``owners``, and new vertices between ``ends``."""
    mesh = given.mesh
    given_rows = (mesh.normals, mesh.colors, mesh.texcoords)
    normals, colors, texcoords = (None if rows is None else _with_means(rows, ends) for rows in given_rows)
    made = Mesh(_with_means(mesh.vertices, ends), faces, normals, colors, texcoords, mesh.name)
    give_materials(made, mesh.materials, mesh.face_materials, owners)
    stops = np.searchsorted(owners, [part.faces.stop for part in mesh.parts])
    give_parts(made, parts_of([part.name for part in mesh.parts], np.diff(stops, prepend=0).tolist()))
    return Patches(made, read_only(given.faces[owners]))


def _with_means(rows: NDArray[Any], ends: Ints) -> NDArray[Any]:
    """Rows of vertices, and behind them those in the middle between two; the order of the two changes no bit."""
    half = rows.dtype.type(0.5)
    return np.concatenate([rows, half * rows[ends[:, 0]] + half * rows[ends[:, 1]]])
