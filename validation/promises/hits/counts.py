"""Counts that an octree or brute force tells of itself: leaves, and triangles that a ray tests."""

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.meshes import loose
from validation.promises import levels
from validation.promises.row import row


class _Options(NamedTuple):
    split: Literal["sah", "midpoint"]
    leaf_size: int
    max_depth: int


_BUILDS = (_Options("sah", 1, 64), _Options("sah", 32, 64), _Options("midpoint", 8, 64), _Options("sah", 4, 2))
_SMALL, _MISSING = 400, 400
# A tree's boxes are met in float32, widened by some roundings of 2^-24.
_CLOSE = 2.0**-20
# Up to two blocks of four, and trees of several levels.
_COUNTS = (*range(1, 10), 33, 500)


def check_counts(rng: Generator) -> list[dict[str, Any]]:
    """Faces that fill their last block and faces that do not."""
    leaves, tested = [], []
    for count in _COUNTS:
        mesh = loose(rng.normal(size=(count, 1, 3)) + 0.1 * rng.normal(size=(count, 3, 3)))
        octree, brute = Octree.from_mesh(mesh, leaf_size=3), BruteForce.from_mesh(mesh)
        links = levels.joined(levels.levels(octree.tree)).links
        leaves.append(octree.stats.leaves == (links < 0).sum())
        steps = brute.count_steps(rng.normal(size=(20, 3)), rng.normal(size=(20, 3)))
        tested.append((steps.triangles == count) & (steps.nodes == 0))
    return [
        row("stats counts the leaves that hold faces", "recount of the tree", np.array(leaves)),
        row("from_mesh builds with the options that it is given", "tree built from arrays", _same(rng)),
        row("a ray that hits nothing visits the boxes that it enters", "slab tests", _entered(rng)),
        row("brute force tests each face once and no padding", "known answer", np.concatenate(tested)),
    ]


def _same(rng: Generator) -> NDArray[np.bool_]:
    corners, faces = rng.normal(size=(900, 3)), np.arange(900, dtype=np.int32).reshape(-1, 3)
    kept = []
    usual = Octree(corners, faces).stats
    for options in _BUILDS:
        stats = Octree(corners, faces, **options._asdict()).stats
        kept += [Octree.from_mesh(Mesh(corners, faces), **options._asdict()).stats == stats, stats != usual]
    return np.array(kept)


def _entered(rng: Generator) -> NDArray[np.bool_]:
    """Rays through small faces far apart, of which most are missed; those that pass a box closely are left out."""
    octree = Octree.from_mesh(loose(rng.uniform(-1.0, 1.0, (_SMALL, 1, 3)) + 0.01 * rng.normal(size=(_SMALL, 3, 3))))
    origins, directions = rng.uniform(-2.0, 2.0, (2, _MISSING, 3))
    steps = octree.count_steps(origins, directions)
    within, nodes, triangles = np.ones((1, _MISSING), np.bool_), np.ones(_MISSING), np.zeros(_MISSING)
    kept = ~octree.any_hit(origins, directions)
    for level in levels.levels(octree.tree):
        entered, sure = _slabs(level.boxes.astype(np.float64), origins, directions)
        entered &= within[level.above]
        kept &= (sure | ~within[level.above]).all(axis=0)
        leaf, place = levels.places(level.links[level.links < 0])
        held = np.bincount(leaf, octree.tree.faces[place] >= 0)
        nodes += entered[level.links >= 0].sum(axis=0)
        triangles += held @ entered[level.links < 0]
        within = entered
    good: NDArray[np.bool_] = ((steps.nodes == nodes) & (steps.triangles == triangles))[kept]
    return good


def _slabs(boxes: NDArray[np.float64], origins: NDArray[np.float64], directions: NDArray[np.float64]
           ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:  # fmt: skip
    """Whether each ray (m, 3) enters each box (n, 2, 3), and whether rounding cannot change that, (n, m) each."""
    ways = np.sort((boxes[:, :, None] - origins) / directions, axis=1)
    first, last = np.maximum(ways[:, 0].max(axis=-1), 0.0), ways[:, 1].min(axis=-1)
    return first <= last, np.abs(first - last) > _CLOSE * (1.0 + np.abs(first) + np.abs(last))
