"""Counts that an octree or brute force tells of itself: leaves, and triangles that a ray tests."""

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.promises import levels
from validation.promises.row import row


class _Options(NamedTuple):
    split: Literal["sah", "midpoint"]
    leaf_size: int
    max_depth: int


_BUILDS = (_Options("sah", 1, 64), _Options("sah", 32, 64), _Options("midpoint", 8, 64), _Options("sah", 4, 2))
# Up to two blocks of four, and trees of several levels.
_COUNTS = (*range(1, 10), 33, 500)


def check_counts(rng: Generator) -> list[dict[str, Any]]:
    """Faces that fill their last block and faces that do not."""
    leaves, tested = [], []
    for count in _COUNTS:
        corners = (rng.normal(size=(count, 1, 3)) + 0.1 * rng.normal(size=(count, 3, 3))).reshape(-1, 3)
        faces = np.arange(3 * count).reshape(-1, 3)
        octree, brute = Octree(corners, faces, leaf_size=3), BruteForce(corners, faces)
        links = levels.joined(levels.levels(octree.tree)).links
        leaves.append(octree.stats.leaves == (links < 0).sum())
        steps = brute.count_steps(rng.normal(size=(20, 3)), rng.normal(size=(20, 3)))
        tested.append((steps.triangles == count) & (steps.nodes == 0))
    return [
        row("stats counts the leaves that hold faces", "the tree's arrays, read again", np.array(leaves)),
        row("from_mesh builds with the options that it is given", "the tree of the arrays", _same(rng)),
        row("brute force tests each face once and no padding", "the number of faces", np.concatenate(tested)),
    ]


def _same(rng: Generator) -> NDArray[np.bool_]:
    corners, faces = rng.normal(size=(900, 3)), np.arange(900, dtype=np.int32).reshape(-1, 3)
    kept = []
    usual = Octree(corners, faces).stats
    for options in _BUILDS:
        stats = Octree(corners, faces, **options._asdict()).stats
        kept += [Octree.from_mesh(Mesh(corners, faces), **options._asdict()).stats == stats, stats != usual]
    return np.array(kept)
