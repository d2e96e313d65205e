"""The binary hierarchy that a split rule makes of faces, before it becomes nodes of eight."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel
from renderer.numerics.simd import minimum
from renderer.trace.layout import BLOCK_FACES
from renderer.tree.bounds import BOX

# None, so that kernels are compiled for it apart: those of most builds have no code of the midpoint rule.
MIDPOINT, SAH = 0, None


class Rule(NamedTuple):
    """The rule of a build: the split rule, the largest number of faces of a leaf, and the deepest level that it may
    split.
    """

    split: int | None
    leaf_size: int
    max_depth: int


class Hierarchy(NamedTuple):
    """Parts: ranges of faces, each whole or cut in two halves, which are stored side by side after the part itself.

    boxes    (n * BOX,) float32, their bounds
    ranges   (n, 2) int32, begin and end
    halves   (n,) int32, the first half, or -1 for a part that is whole
    costs    (n * 8,) float32, the expected cost of the part as one to eight children of a node, see ``collapse``
    choices  (n * 8,) uint8, the choices of least cost, see ``collapse``
    """

    boxes: NDArray[np.float32]
    ranges: NDArray[np.int32]
    halves: NDArray[np.int32]
    costs: NDArray[np.float32]
    choices: NDArray[np.uint8]


def new_hierarchy(parts: int) -> Hierarchy:
    """Room for ``parts`` parts."""
    costs, choices = np.empty(parts * 8, np.float32), np.empty(parts * 8, np.uint8)
    boxes, ranges, halves = np.empty(parts * BOX, np.float32), np.empty((parts, 2), np.int32), np.empty(parts, np.int32)
    return Hierarchy(boxes, ranges, halves, costs, choices)


def first_parts(tree: Hierarchy, count: int) -> Hierarchy:
    """The first ``count`` parts, in the same memory."""
    return Hierarchy(
        tree.boxes[: count * BOX],
        tree.ranges[:count],
        tree.halves[:count],
        tree.costs[: count * 8],
        tree.choices[: count * 8],
    )


@kernel
def add_part(tree, part, begin, end):
    """Write a whole part, all but its box."""
    tree.ranges[part, 0], tree.ranges[part, 1] = begin, end
    tree.halves[part] = -1


@kernel
def whole_size(rule):
    """The most faces of a part that is never cut, because they fit into one block."""
    return minimum(rule.leaf_size, BLOCK_FACES)
