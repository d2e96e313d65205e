"""The tree itself, built and refitted: where each face stands, what boxes and blocks hold, and how deep it is."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.trace.layout import Tree
from validation.meshes import loose
from validation.promises import levels
from validation.promises.row import row

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
# Triangles with more vertices than are looked at together.
_MANY = 30_000
# By this share of its width a face's box is wider than the face, on each side.
_ROOM = 2.0**-21
_JUDGE = "recount of the tree"


def check_trees(rng: Generator) -> list[dict[str, Any]]:
    """Trees of few faces and of many, by either rule, before and after the vertices move."""
    found: dict[str, list[Bools]] = {}
    for octree in _octrees(rng):
        for promise, kept in _judged(octree.tree, octree.mesh).items():
            found.setdefault(promise, []).append(kept)
    return [
        *(row(promise, _JUDGE, np.concatenate(kept)) for promise, kept in found.items()),
        row("blocks are float32 only where that holds every vertex", "known answer", _digits()),
    ]


def _octrees(rng: Generator) -> Iterator[Octree]:
    """Of one face, of one leaf, of one subtree, and of many subtrees; equal and upright faces too. Of float32 and
    of float64.
    """
    for count, leaf_size in ((1, 1), (3, 1), (5, 8), (300, 32), (9_000, 3), (20_000, 8)):
        corners = rng.normal(size=(count, 1, 3)) + rng.exponential(0.1, (count, 1, 1)) * rng.normal(size=(count, 3, 3))
        corners[0, :, 0] = corners[0, 0, 0]
        corners[count // 2 : count // 2 + count // 4] = corners[0]
        # A part of few faces, which is a leaf beside subtrees of thousands.
        corners[1:4] += 100.0 * (count > 8192)
        single = corners.astype(np.float32).astype(np.float64)
        split: Literal["midpoint", "sah"] = "midpoint" if leaf_size == 8 else "sah"
        octree = Octree.from_mesh(loose(single), split=split, leaf_size=leaf_size)
        yield octree
        octree.refit((3.0 * rng.permutation(corners) + 1.0).reshape(-1, 3))
        yield octree


def _judged(tree: Tree, mesh: Mesh) -> dict[str, Bools]:
    """Each promise, and where it was kept."""
    found = levels.levels(tree)
    boxes, _, links = levels.joined(found)
    ends = links < 0
    leaf, place = levels.places(links[ends])
    faces = tree.faces[place].astype(np.int64)
    used = faces >= 0
    size = np.bincount(leaf[used], minlength=int(ends.sum()))[leaf]
    rank = np.arange(len(leaf)) - np.searchsorted(leaf, leaf)
    every, where = levels.octants(tree)
    unused = every[:, :, 0, 0] > every[:, :, 1, 0]
    return {
        "every place of every block is in one leaf": np.bincount(place, minlength=len(tree.faces)) == 1,
        "every face is in one leaf": np.bincount(faces[used], minlength=len(mesh.faces)) == 1,
        "a leaf fills its blocks one after another": (used == (rank < size)) & (rank // 4 * 4 < size),
        "a leaf's box is that of its faces, rounded outwards": _fits(mesh, boxes[ends], leaf[used], faces[used]),
        "a node's box is that of its octants": _unites(found),
        "each node is reached once": np.bincount(links[~ends], minlength=len(where))[1:] == 1,
        "an octant without faces is empty": _is_empty(every[unused], where[unused], len(tree.faces) // 4),
        "orders have all octants, the farthest first": _ordered(tree.links.reshape(-1, 64)[:, 56:], every, unused),
        "a node but the first has two octants or more": (~unused).sum(axis=1)[1:] > 1,
        "the depth is the number of levels": np.array([tree.depth == len(found)]),
        "blocks hold their faces' corners": _holds(tree, mesh),
    }


def _fits(mesh: Mesh, boxes: levels.Floats, leaf: levels.Indices, faces: levels.Indices) -> Bools:
    """Whether the box of each leaf holds its faces and their room, and reaches at most two float32 steps further."""
    corners = mesh.triangles[faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    room = (high - low) * _ROOM
    wanted = np.full((len(boxes), 2, 3), np.inf)
    np.minimum.at(wanted[:, 0], leaf, low - room)
    np.minimum.at(wanted[:, 1], leaf, -(high + room))
    given = boxes * [[1.0], [-1.0]]
    fits: Bools = ((given <= wanted) & (given >= wanted - 2 * np.spacing(np.abs(boxes)))).all(axis=(1, 2))
    return fits


def _is_empty(boxes: levels.Floats, links: levels.Indices, blocks: int) -> Bools:
    """Whether a box is entered by no ray, and by one with a NaN leads to one block that is there."""
    inverted = (boxes == [[np.inf] * 3, [-np.inf] * 3]).all(axis=(1, 2))
    kept: Bools = inverted & (links < 0) & (~links & 7 == 0) & (~links >> 3 < blocks)
    return kept


def _ordered(orders: NDArray[np.int32], boxes: levels.Floats, unused: Bools) -> Bools:
    """Whether the octal digits of each order are the octants, and no box has its middle farther along than one before.

    Middles that differ by less than a millionth of the farthest may come in any order: the renderer's are float32.
    """
    kept = np.ones(orders.shape, np.bool_)
    middles = np.where(unused[:, :, None, None], np.nan, boxes.astype(np.float64)).mean(axis=2)
    near = 1e-6 * np.nanmax(np.abs(middles), axis=(1, 2))
    for signs in range(8):
        digits = orders[:, signs, None] // 8 ** np.arange(8) % 8
        far = np.take_along_axis(middles @ (1.0 - 2.0 * (signs >> np.arange(3) & 1)), digits, axis=1)
        before, after = np.triu_indices(8, 1)
        kept[:, signs] = (np.sort(digits) == np.arange(8)).all(axis=1)
        kept[:, signs] &= ~(far[:, after] > far[:, before] + near[:, None]).any(axis=1)
    return kept.ravel()


def _unites(found: list[levels.Level]) -> Bools:
    """Whether the box of each octant that is a node is the least that holds the octants of the node."""
    kept = [np.ones(0, np.bool_)]
    for level, below in pairwise(found):
        united = np.full(level.boxes.shape, np.inf, np.float32)
        np.minimum.at(united[:, 0], below.above, below.boxes[:, 0])
        np.minimum.at(united[:, 1], below.above, -below.boxes[:, 1])
        united[:, 1] *= -1
        kept.append((united == level.boxes).all(axis=(1, 2))[level.links >= 0])
    return np.concatenate(kept)


def _holds(tree: Tree, mesh: Mesh) -> Bools:
    """Whether each place holds its face's corners, or nothing, and blocks are float32 where that is exact."""
    rows = tree.blocks.reshape(-1, 9, 4).transpose(0, 2, 1).reshape(-1, 3, 3)
    used = tree.faces >= 0
    same = (rows == mesh.triangles[tree.faces]).all(axis=(1, 2))
    narrow = np.array_equal(mesh.vertices.astype(np.float32), mesh.vertices)
    kept: Bools = np.where(used, same, np.isnan(rows).all(axis=(1, 2)))
    return np.append(kept, tree.blocks.dtype == (np.float32 if narrow else np.float64))


def _digits() -> NDArray[np.bool_]:
    """A row of triangles of which a single vertex, each in turn, is not a float32 number; a ray meets it there."""
    x = np.arange(8.0)
    corners = np.stack(
        [np.stack([x, 0 * x, 0 * x], 1), np.stack([x + 0.5, 0 * x, 0 * x], 1), np.stack([x, 0 * x + 1, 0 * x], 1)], 1
    )
    vertices, kept = corners.reshape(-1, 3), []
    for k in range(len(vertices)):
        moved = vertices.copy()
        moved[k, 2] = 1.0 / 3.0
        octree = Octree.from_mesh(loose(moved))
        hits = octree.closest_hit(moved[k] + [0.0, 0.0, 2.0], [0.0, 0.0, -1.0])
        kept.append(hits.face == k // 3 and abs(hits.t - 2.0) <= 2.0**-51)
    return np.array([*kept, *_last_digit()])


def _last_digit() -> list[bool]:
    """The same of the last of very many triangles alone."""
    x = np.repeat(np.arange(_MANY, dtype=np.float64), 3)
    vertices = np.stack([x, np.tile([0.0, 1.0, 0.0], _MANY), np.tile([0.0, 0.0, 1.0], _MANY)], 1)
    vertices[-3:, 0] += 1.0 / 3.0
    octree = Octree.from_mesh(loose(vertices))
    hits = octree.closest_hit([_MANY + 1.0, 0.25, 0.25], [-1.0, 0.0, 0.0])
    return [bool(hits.t == _MANY + 1.0 - vertices[-1, 0]), bool(hits.face == _MANY - 1)]
