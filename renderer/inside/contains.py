"""The query ``contains``: checks, and chunks of points on threads."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument
from renderer.arguments.points import check_points
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.inside.crossings import ON_FACE, UNDECIDED_COUNT, count_crossings
from renderer.inside.rational import crossings_of
from renderer.inside.winding import exceeds_half
from renderer.mesh.mending import enclosed_share
from renderer.mesh.mesh import Mesh
from renderer.ordering.cells import search_in_order
from renderer.trace.layout import Tree
from renderer.trace.walk import stack_size

# The fewest points of a chunk: a millisecond of work.
_LEAST = 4096
RULES = ("nonzero", "even-odd")


def contains(
    tree: Tree, mesh: Mesh, points: ArrayLike, boundary: bool, rule: str, winding: bool, threads: int
) -> NDArray[np.bool_]:
    """Whether each point lies inside, see ``Octree.contains``."""
    boundary, winding = flag_argument("boundary", boundary), flag_argument("winding", winding)
    expect(isinstance(rule, str) and rule in RULES, "rule", f"one of {RULES}", repr(rule))
    expect(not winding or rule == RULES[0], "rule", f"the default with winding=True, {RULES[0]!r}", repr(rule))
    expect(len(mesh.faces) > 0, "mesh", "faces", "none")
    if not winding:
        _check_closed(mesh, rule)
    rows, shape = check_points("points", points)
    counted = _counted(tree, mesh, rows, threads)
    on = counted == ON_FACE
    if winding:
        # A point on a flat part of the surface has 1/2 exactly, which costs most to decide and is not needed.
        inside = np.zeros(len(rows), np.bool_)
        inside[~on] = exceeds_half(tree, mesh, rows[~on], threads)
    else:
        inside = counted != 0 if rule == "nonzero" else (counted & 1) == 1
    return (inside | on if boundary else inside & ~on).reshape(shape)


def _check_closed(mesh: Mesh, rule: str) -> None:
    """Raise ``ValueError`` for a mesh that has no inside."""
    edges = mesh.open_edges if rule == "nonzero" else mesh.odd_edges
    if len(edges):
        start, end = mesh.vertices[edges[0]].tolist()
        expected = "a mesh each of whose edges an even number of faces has, or winding=True"
        if rule == "nonzero":
            expected = "a closed mesh whose faces are turned one way, or rule='even-odd' or winding=True"
        expect(False, "mesh", expected, f"{len(edges)} open edges, the first from {start} to {end}")
    if rule == "nonzero":
        expected = (
            "a closed mesh whose faces are turned one way, or rule='even-odd'; Mesh.without_duplicates() mends it"
        )
        got = f"{len(mesh.faces)} faces, each as often one way round as the other"
        expect(mesh.is_closed(), "mesh", expected, got)


def is_inside_out(mesh: Mesh) -> bool:
    """Whether the mesh, which may have holes, encloses less than nothing, by more than a hundredth of its box."""
    return enclosed_share(mesh.bounds, mesh.triangles) < -0.01


def _counted(tree: Tree, mesh: Mesh, points: NDArray[np.float64], threads: int) -> NDArray[np.int32]:
    """Winding numbers (n,) around points in the mesh's units, or ON_FACE."""
    counted = np.empty(len(points), np.int32)
    lower, upper = mesh.bounds
    axis = int(np.argmin(upper - lower))
    middle = tree.scale * (lower[axis] / 2 + upper[axis] / 2)

    def count(rows: NDArray[np.int64], some: NDArray[np.float64]) -> Iterator[None]:
        # Memory for the deepest tree: a kernel's own frame holds the stack of most trees, not of all.
        stack, done = np.empty(stack_size(tree.depth), np.int64), 0
        while done < len(some):
            done = count_crossings(tree.descriptor, some, axis, middle, rows, counted, stack, done)
            yield

    search_in_order(count, points, mesh, axis, _LEAST, threads)
    undecided = np.flatnonzero(counted == UNDECIDED_COUNT)
    triangles = mesh.triangles if len(undecided) else np.empty((0, 3, 3))
    for row in undecided:
        winding, on = crossings_of(points[row], triangles, axis)
        counted[row] = ON_FACE if on else winding
    return counted
