"""Counts that an octree or brute force tells of itself: leaves, and triangles that a ray tests."""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.octree import BruteForce, Octree
from validation.promises import levels
from validation.promises.row import row

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
        row("brute force tests each face once and no padding", "the number of faces", _all(tested)),
    ]


def _all(kept: list[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    return np.concatenate(kept)
