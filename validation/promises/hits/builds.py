"""Trees of each rule, leaf size and depth: their leaves and cost are those of the rules when they are written again."""

from collections.abc import Iterator
from itertools import permutations, product
from typing import Any, Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.octree import Octree
from validation.promises import levels
from validation.promises.hits import splits
from validation.promises.hits.splits import Choice, Rule
from validation.promises.row import row

Floats = NDArray[np.float64]
_SPLITS: tuple[Literal["sah", "midpoint"], ...] = ("sah", "midpoint")
_SIZES = (1, 2, 3, 4, 5, 8, 12, 32)
_DEPTHS = (1, 2, 64)
# As many as are cut twice by octants, and on either side of where the rules change.
_MANY, _FEW = 150, (32, 33)
# Boxes are wider than their faces by 2^-21 on either side; costs are sums of float32.
_NEAR = 1e-5
_JUDGE = "the rules in numpy"


def check_builds(rng: Generator) -> list[dict[str, Any]]:
    """Small trees with every order of the axes, and with faces that no middle or nothing separates
    or whose boxes have no area.
    """
    costs, leaves = [], []
    for corners, rule in _cases(rng):
        faces = np.arange(3 * len(corners)).reshape(-1, 3)
        octree = Octree(
            corners.reshape(-1, 3), faces, split=rule.split, leaf_size=rule.leaf_size, max_depth=rule.max_depth
        )
        found, wanted = _built(octree), splits.Build(corners, rule).cheapest()
        costs.append(abs(found.cost - wanted.cost) <= _NEAR * wanted.cost)
        leaves.append(sorted(found.leaves) == sorted(wanted.leaves))
    return [
        row("a tree costs no more and no less than its rule says", _JUDGE, np.array(costs)),
        row("leaves hold the faces that the rule leaves together", _JUDGE, np.array(leaves)),
    ]


def _cases(rng: Generator) -> Iterator[tuple[Floats, Rule]]:
    for number, (extent, split) in enumerate(product(permutations((1.0, 1.7, 3.0)), _SPLITS)):
        corners = _soup(rng, np.array(extent), _MANY)
        yield corners, Rule(split, _SIZES[number % len(_SIZES)], _DEPTHS[number % len(_DEPTHS)])
    for split in _SPLITS:
        yield _below_one(rng), Rule(split, 4, 32)
        yield _equal(rng), Rule(split, 5, 32)
        yield rng.uniform(-1.0, 1.0, (7, 3, 3)).astype(np.float32).astype(np.float64), Rule(split, 8, 32)
        yield _soup(rng, np.eye(3)[1], _MANY) * np.eye(3)[1], Rule(split, 8, 32)
        for count in _FEW:
            yield _soup(rng, np.array([2.0, 3.0, 1.0]), count), Rule(split, 3, 32)


def _soup(rng: Generator, extent: Floats, count: int) -> Floats:
    """Faces of all sizes, in no order, with corners that are float32."""
    size = 10.0 ** rng.uniform(-2.0, 0.0, (count, 1, 1))
    corners = extent * rng.normal(size=(count, 1, 3)) + size * rng.normal(size=(count, 3, 3))
    return corners.astype(np.float32).astype(np.float64)


def _below_one(rng: Generator) -> Floats:
    """Faces throughout the lowest octant of a large one, whose centre is the middle of their box."""
    extent = np.array([30.0, 10.0, 20.0])
    corners = extent * rng.uniform(0.1, 0.4, (_MANY, 1, 3)) + rng.uniform(-0.5, 0.5, (_MANY, 3, 3))
    corners[7] = [np.zeros(3), extent, 0.5 * extent]
    return corners.astype(np.float32).astype(np.float64)


def _equal(rng: Generator) -> Floats:
    """Faces of which half are equal."""
    corners = _soup(rng, np.array([3.0, 1.0, 2.0]), _MANY)
    corners[::2] = corners[0]
    return corners


def _built(octree: Octree) -> Choice:
    """The cost and the leaves of the tree itself."""
    found = levels.joined(levels.levels(octree.tree))
    boxes, ends = found.boxes.astype(np.float64), found.links < 0
    blocks = np.where(ends, (~found.links & 7) + 1, 1)
    whole = splits.half_area(boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0))
    cost = float(whole + (splits.half_area(boxes[:, 0], boxes[:, 1]) * blocks).sum())
    leaf, place = levels.places(found.links[ends])
    faces = octree.tree.faces[place]
    parts = np.split(faces, np.flatnonzero(np.diff(leaf)) + 1)
    return Choice(cost, tuple(tuple(sorted(part[part >= 0].tolist())) for part in parts))
