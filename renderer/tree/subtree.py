"""Builds one subtree, from a range of faces to nodes and leaves, in memory of its own."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel
from renderer.numerics.kinds import of_none
from renderer.trace.layout import BLOCK_FACES, NODE_WORDS
from renderer.tree.bounds import BOX, fit
from renderer.tree.collapse import collapse, leaf_cost
from renderer.tree.emit import EmitScratch, emit_leaf, emit_nodes, emit_scratch, leaf_link
from renderer.tree.hierarchy import Hierarchy, add_part, new_hierarchy, whole_size
from renderer.tree.midpoint import OctantScratch, cut_octants, octant_scratch
from renderer.tree.sah import BinScratch, bin_scratch, cut_sah

# Parts of at most so many faces are cut by the surface area heuristic, under the midpoint rule too. Most of their
# octants would be empty, and only 72 % of the blocks' places used. With the heuristic it is 86 %, which saves a sixth
# of the memory and 2 % of the node visits, for a third more time to build.
_FEW = 32


class CutScratch(NamedTuple):
    """Scratch for one subtree: for both split rules, and for ``emit_nodes``, which ``_cut_all`` shares."""

    octants: OctantScratch
    bins: BinScratch
    emit: EmitScratch


class SubtreeScratch(NamedTuple):
    """Memory to build one subtree at a time."""

    tree: Hierarchy
    cut: CutScratch
    nodes: NDArray[np.float32]
    links: NDArray[np.int32]
    block_faces: NDArray[np.int32]
    no_ends: NDArray[np.int32]


def new_cut_scratch() -> CutScratch:
    """Scratch for one thread."""
    return CutScratch(octant_scratch(), bin_scratch(), emit_scratch())


def new_subtree_scratch(faces: int) -> SubtreeScratch:
    """Memory for subtrees of up to ``faces`` faces; a subtree leaves most of it untouched."""
    nodes = np.empty(max(1, faces) * NODE_WORDS, np.float32)
    tree = new_hierarchy(max(1, 2 * faces - 1))
    block_faces, no_ends = np.empty(faces * BLOCK_FACES, np.int32), np.empty((0, 2), np.int32)
    return SubtreeScratch(tree, new_cut_scratch(), nodes, nodes.view(np.int32), block_faces, no_ends)


@kernel
def cut_part(faces, tree, part, rule, level, count, scratch):
    """Cut a part by the rule; or in equal halves if the rule cannot, or has cut ``max_depth`` levels. Returns the
    number of parts, ``count`` before, and the level of the new ones. A cut in two is one level; octants are three.
    """
    after, below = count, level + 1
    if level < 3 * rule.max_depth:
        after, below = of_none(rule.split, _cut_in_two, _cut_by_size)(faces, tree, part, rule, level, count, scratch)
    if after == count:
        after, below = _cut_in_half(faces, tree, part, count), level + 1
    return after, below


@kernel
def _cut_in_two(faces, tree, part, rule, level, count, scratch):
    return cut_sah(faces, tree, part, count, scratch.bins), level + 1


@kernel
def _cut_by_size(faces, tree, part, rule, level, count, scratch):
    if tree.ranges[part, 1] - tree.ranges[part, 0] <= _FEW:
        return _cut_in_two(faces, tree, part, rule, level, count, scratch)
    return cut_octants(faces, tree, part, whole_size(rule), count, scratch.octants), level + 3


@kernel
def _cut_in_half(faces, tree, part, count):
    """Cut a part into equal halves if no rule separates its faces, so that the build ends."""
    begin, end = tree.ranges[part]
    middle = (begin + end) // 2
    tree.halves[part] = count
    add_part(tree, count, begin, middle)
    add_part(tree, count + 1, middle, end)
    fit(faces.boxes, begin, middle, tree.boxes, count * BOX)
    fit(faces.boxes, middle, end, tree.boxes, (count + 1) * BOX)
    return count + 2


@kernel
def _cut_all(faces, tree, rule, level, scratch):
    """Cut part 0 until every part is whole; returns the number of parts."""
    waiting, whole = scratch.emit.waiting, whole_size(rule)
    waiting[0, 0], waiting[0, 1] = 0, level
    # Counters are int64 from the start, or Numba would compile the callees twice: for the literal and for the number.
    top, count = 1, np.int64(1)
    while top > 0:
        top -= 1
        part, level = np.int64(waiting[top, 0]), np.int64(waiting[top, 1])
        if tree.ranges[part, 1] - tree.ranges[part, 0] <= whole:
            continue
        before = count
        count, level = cut_part(faces, tree, part, rule, level, count, scratch)
        for new in range(before, count):
            if tree.halves[new] < 0:
                waiting[top, 0], waiting[top, 1] = new, level
                top += 1
    return count


@kernel
def cut_once(faces, tree, rule, level, scratch):
    """Cut part 0, the only one, once. Returns the same as ``cut_part``."""
    return cut_part(faces, tree, np.int64(0), rule, level, np.int64(1), scratch)


@kernel
def build_subtree(faces, rule, begin, end, level, scratch):
    """Build over the faces ``begin:end``, the result of ``level`` cuts, into ``scratch``.

    Returns (link, cost, nodes, blocks, levels of nodes), the link counted from the subtree's own first node and block.
    A subtree of one leaf has no node, unless it is the whole tree, which always begins with a node.
    """
    tree, block_faces = scratch.tree, scratch.block_faces
    add_part(tree, 0, begin, end)
    fit(faces.boxes, begin, end, tree.boxes, 0)
    count = _cut_all(faces, tree, rule, level, scratch.cut)
    for part in range(count):
        if tree.halves[part] < 0:
            tree.costs[8 * part] = leaf_cost(tree, part)
    collapse(tree, count, rule.leaf_size)
    if tree.choices[0] == 0 and level > 0:
        blocks = emit_leaf(tree, np.int64(0), faces.numbers, block_faces, np.int64(0))
        return leaf_link(0, end - begin), tree.costs[0], 0, blocks, 0
    numbers, nodes, links = faces.numbers, scratch.nodes, scratch.links
    used, blocks, depth = emit_nodes(tree, numbers, scratch.no_ends, nodes, links, block_faces, scratch.cut.emit)
    return 0, tree.costs[0], used, blocks, depth
