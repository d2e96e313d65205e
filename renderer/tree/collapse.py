"""Collapses a binary hierarchy into nodes of eight children at least expected cost.

Dynamic programming from the leaves up (Ylitie, Karras and Laine, Efficient Incoherent Ray Traversal on GPUs Through
Compressed Wide BVHs, HPG 2017, sec. 3.1), with leaves counted in blocks.
"""

import numpy as np

from renderer.jit.decorators import kernel
from renderer.numerics.simd import load8
from renderer.trace.layout import BLOCK_FACES
from renderer.tree.bounds import BOX, half_area

# The costs of entering a node and of testing a block.
NODE_COST = np.float32(1.0)
BLOCK_COST = np.float32(1.0)


@kernel
def leaf_cost(tree, part):
    """The expected cost of a part as one leaf."""
    blocks = (tree.ranges[part, 1] - tree.ranges[part, 0] + BLOCK_FACES - 1) // BLOCK_FACES
    return half_area(load8(tree.boxes, part * BOX)) * np.float32(blocks) * BLOCK_COST


@kernel
def collapse(tree, count, leaf_size):
    """Fill ``costs`` and ``choices`` of ``count`` parts; ``costs[8 * part]`` of whole parts is set before.

    costs[8 * part + i - 1] is the least cost of the part as at most i children of a node. The choice at that index is
    the number of children that come from the first half. For i = 1, a choice of 0 makes the part a leaf; otherwise it
    becomes a node of eight children. For i > 1, a choice of 0 means that i - 1 children cost no more.
    """
    for part in range(count - 1, -1, -1):
        at = 8 * part
        first = tree.halves[part]
        if first < 0:
            for i in range(8):
                tree.costs[at + i], tree.choices[at + i] = tree.costs[at], 0
            continue
        for children in range(8, 0, -1):
            # For i = 1, which comes last, the eight children of the node that the part may become.
            share = children if children > 1 else 8
            tree.costs[at + children - 1], tree.choices[at + children - 1] = _share(tree.costs, first, share)
        tree.costs[at] += half_area(load8(tree.boxes, part * BOX)) * NODE_COST
        if tree.ranges[part, 1] - tree.ranges[part, 0] <= leaf_size:
            whole = leaf_cost(tree, part)
            if not tree.costs[at] < whole:
                tree.costs[at], tree.choices[at] = whole, 0
        for i in range(1, 8):
            if not tree.costs[at + i] < tree.costs[at + i - 1]:
                tree.costs[at + i], tree.choices[at + i] = tree.costs[at + i - 1], 0


@kernel
def _share(costs, first, children):
    """The least cost of two halves as ``children`` children in total, and how many the first half gets."""
    left, right = 8 * first - 1, 8 * (first + 1) - 1
    best, chosen = costs[left + 1] + costs[right + children - 1], 1
    for k in range(2, children):
        cost = costs[left + k] + costs[right + children - k]
        if cost < best:
            best, chosen = cost, k
    return best, chosen
