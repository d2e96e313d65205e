"""A mesh cut off at a plane across an axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh, give_materials, give_parts
from renderer.mesh.parts import parts_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def cut(mesh: Mesh, axis: int, at: float, below: bool) -> Mesh:
    """The part of ``mesh`` where the coordinate along ``axis`` is at most ``at``, or at least that if not ``below``.

    Faces across the plane are cut. Their new corners lie on it exactly; faces that share an edge share its new corner.
    What vertices carry is interpolated. The cut stays open.

    >>> from renderer.mesh.shapes import box
    >>> half = cut(box(), 0, 0.25, below=True)
    >>> len(half.faces), half.extent.tolist(), half.is_closed()
    (14, [0.25, 1.0, 1.0], False)
    """
    heights = (mesh.vertices[:, axis] - at) * (1.0 if below else -1.0)
    above = heights > 0.0
    count = above[mesh.faces].sum(axis=1)
    kept = [np.flatnonzero(count == number) for number in range(3)]
    faces, ends = [mesh.faces[kept[0]].astype(np.int64)], _Ends(len(mesh.vertices))
    # Of two corners left a quadrangle stays, of one a triangle.
    a, b, c = _turned(mesh.faces[kept[1]], above, 1)
    right, left = ends.of(a, b), ends.of(a, c)
    faces += [np.stack([right, b, c], axis=1), np.stack([right, c, left], axis=1)]
    a, b, c = _turned(mesh.faces[kept[2]], above, 2)
    faces += [np.stack([a, ends.of(a, b), ends.of(a, c)], axis=1)]
    owners = np.concatenate([kept[0], kept[1], kept[1], kept[2]])
    order = np.argsort(owners, kind="stable")
    return _made(mesh, np.concatenate(faces)[order], owners[order], _Cut(ends, heights, axis, at))


class _Ends:
    """New vertices, each on the edge of two others, numbered behind those of the mesh."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.edges = np.empty((0, 2), np.int64)

    def of(self, first: Ints, second: Ints) -> Ints:
        """The numbers of the vertices on these edges; an edge gets one for both its ways round, at each call."""
        pairs = np.stack([np.minimum(first, second), np.maximum(first, second)], axis=1)
        begin = self.count + len(self.edges)
        self.edges = np.concatenate([self.edges, pairs])
        return begin + np.arange(len(pairs))


class _Cut:
    """Values of vertices, and of those on the edges that the plane cuts."""

    def __init__(self, ends: _Ends, heights: Floats, axis: int, at: float) -> None:
        self.edges, self.rows = np.unique(ends.edges, axis=0, return_inverse=True)
        low, high = heights[self.edges[:, 0]], heights[self.edges[:, 1]]
        self.low_end, self.high_end = low == 0.0, high == 0.0
        self.share = (low / np.where(low == high, 1.0, low - high))[:, None]
        self.axis, self.at, self.count = axis, at, ends.count

    def values(self, values: NDArray[Any]) -> NDArray[Any]:
        """The rows of vertices, and behind them those interpolated."""
        first, second = (values[self.edges[:, k]] for k in (0, 1))
        return np.concatenate([values, (first + self.share * (second - first)).astype(values.dtype)])

    def numbers(self, faces: Ints) -> Ints:
        """Faces whose new corners are numbered once an edge; one at an edge's end is the vertex there."""
        own = self.count + np.arange(len(self.edges))
        own = np.where(self.low_end, self.edges[:, 0], np.where(self.high_end, self.edges[:, 1], own))
        return np.append(np.arange(self.count), own[self.rows.ravel()])[faces]


def _turned(faces: NDArray[np.int32], above: NDArray[np.bool_], lonely: int) -> tuple[Ints, Ints, Ints]:
    """Corners of faces, turned so that the first is the one above the plane, or below it if two are above."""
    alone = above[faces] if lonely == 1 else ~above[faces]
    first = alone.argmax(axis=1)
    corners = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1).astype(np.int64)
    return corners[:, 0], corners[:, 1], corners[:, 2]


def _made(mesh: Mesh, faces: Ints, owners: Ints, done: _Cut) -> Mesh:
    """The mesh of the faces, of which those of ``owners`` were made, without the vertices that they do not use."""
    positions = done.values(mesh.vertices)
    positions[done.count :, done.axis] = done.at
    corners = done.numbers(faces)
    real = (corners != np.roll(corners, 1, axis=1)).all(axis=1)  # a corner on the plane is cut off without a piece
    corners, owners = corners[real], owners[real]
    used, numbers = np.unique(corners, return_inverse=True)
    given = (mesh.normals, mesh.colors, mesh.texcoords)
    normals, colors, texcoords = (None if rows is None else done.values(rows)[used] for rows in given)
    made = Mesh(positions[used], numbers.reshape(-1, 3), normals, colors, texcoords, mesh.name)
    give_materials(made, mesh.materials, mesh.face_materials, owners)
    ends = np.searchsorted(owners, [part.faces.stop for part in mesh.parts])
    return give_parts(made, parts_of([part.name for part in mesh.parts], np.diff(ends, prepend=0).tolist()))
