"""The walk through a tree that all searches share: what a query does at a node and at a leaf is passed in.

As ``traverse_top_down`` of madmann91/bvh. Numba compiles a walk anew for the two kernels that it is given, and LLVM
inlines both, so a walk costs what a loop of its own would.
"""

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import load, lowest_bit, store
from renderer.trace.layout import CHILDREN, LEAF_BITS, MAX_LEAF_BLOCKS, NODE_WORDS


def stack_size(depth: int) -> int:
    """Entries of one stack: each level leaves at most seven octants waiting, and some are written beyond the top."""
    return 7 * depth + 24


@inlined
def blocks_of(leaf):
    """The first block of a leaf, and how many it has. Python calls ``blocks_of.py_func``, for arrays too."""
    return ~leaf >> LEAF_BITS, (~leaf & (MAX_LEAF_BLOCKS - 1)) + 1


@inlined
def first_block(leaf):
    """The first block of a leaf."""
    return blocks_of(leaf)[0]


@inlined
def child_in(tree, node, octant):
    """The node or leaf in an octant of a node."""
    return np.int64(load(tree.links, node * NODE_WORDS + CHILDREN + octant))


@inlined
def push_children(tree, node, bits, stack, top):
    """Let the children in the octants ``bits`` of a node wait on a stack, the last on top; returns the new top."""
    while bits != 0:
        store(stack, top, child_in(tree, node, lowest_bit(bits)))
        bits &= bits - 1
        top += 1
    return top


@inlined
def walk(tree, stack, query, found, enter, visit):
    """Walk from the root to every leaf that a query reaches, the last octants first; returns what was found.

    stack  pointer to ``stack_size`` int64
    query  what both kernels read
    found  what they find, at first nothing; of the same type throughout
    enter  enter(tree, query, node, found): what is found at a node, and the bits of the octants to go on to
    visit  visit(tree, query, first, count, found): what is found in the ``count`` blocks of a leaf from ``first`` on,
           and whether the walk ends there

    A tree without nodes is one leaf.
    """
    if not tree.has_nodes:
        found, _ = visit(tree, query, 0, tree.count, found)
        return found
    top, ends = 1, False
    store(stack, 0, 0)
    while top > 0 and not ends:
        top -= 1
        child = load(stack, top)
        if child < 0:
            first, count = blocks_of(child)
            found, ends = visit(tree, query, first, count, found)
        else:
            found, bits = enter(tree, query, child, found)
            top = push_children(tree, child, bits, stack, top)
    return found


@inlined
def walk_nearest_first(tree, stack, query, found, reaches, enter, visit):
    """``walk`` in the order of distances, as far as ``enter`` pushes the octants of a node in that order.

    reaches  reaches(query, k, found): whether the stack's k-th entry may still matter when its turn comes
    enter    enter(tree, query, node, found, top): what is found at a node, and the stack's top above the octants that
             it pushed, with what ``reaches`` reads of them
    """
    if not tree.has_nodes:
        found, _ = visit(tree, query, 0, tree.count, found)
        return found
    top, ends = 1, False
    store(stack, 0, 0)
    while top > 0 and not ends:
        top -= 1
        if not reaches(query, top, found):
            continue
        child = load(stack, top)
        if child < 0:
            first, count = blocks_of(child)
            found, ends = visit(tree, query, first, count, found)
        else:
            found, top = enter(tree, query, child, found, top)
    return found
