"""The traversal that all searches share; a query passes in its work at a node and at a leaf.

Like ``traverse_top_down`` of madmann91/bvh. Numba compiles a walk for each pair of kernels, and LLVM inlines both, so
it costs no more than a loop of its own.
"""

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import load, lowest_bit, movemask, octal8, permuted, set_first, store
from renderer.trace.layout import CHILDREN, LEAF_BITS, MAX_LEAF_BLOCKS, NODE_WORDS


def stack_size(depth: int) -> int:
    """Entries of one stack: each level leaves at most seven octants waiting, and some are written beyond the top."""
    return 7 * depth + 24


@inlined
def blocks_of(leaf):
    """The first block of a leaf, and its number of blocks. Python calls ``blocks_of.py_func``, also for arrays."""
    return ~leaf >> LEAF_BITS, (~leaf & (MAX_LEAF_BLOCKS - 1)) + 1


@inlined
def first_block(leaf):
    """The first block of a leaf."""
    return blocks_of(leaf)[0]


@inlined
def child_in(tree, node, octant):
    """The node or leaf in an octant of a node."""
    return tree.ways.child(tree, node, octant)


@inlined
def child_of_node(tree, node, octant):
    """``child_in`` of a mesh."""
    return np.int64(load(tree.links, node * NODE_WORDS + CHILDREN + octant))


@inlined
def boxes_of(tree, node):
    """The boxes of a node's octants: a pointer, and where the six rows of eight begin there."""
    return tree.ways.boxes(tree, node)


@inlined
def boxes_of_node(tree, node):
    """``boxes_of`` a mesh."""
    return tree.nodes, node * NODE_WORDS


@inlined
def push_children(tree, node, bits, stack, top):
    """Push the children in the octants ``bits`` of a node onto a stack, the last on top. Returns the new top."""
    while bits != 0:
        store(stack, top, child_in(tree, node, lowest_bit(bits)))
        bits &= bits - 1
        top += 1
    return top


@inlined
def push_in_order(tree, node, bits, order, stack, top):
    """``push_children`` in an order of the octants."""
    if bits & (bits - 1) == 0:
        return push_children(tree, node, bits, stack, top)
    # No branch: all are written, and the top moves by those pushed.
    for k in range(8):
        octant = np.int64(order) >> 3 * k & 7
        store(stack, top, child_in(tree, node, octant))
        top += bits >> octant & 1
    return top


@inlined
def entered_in_order(meets, order):
    """The octants of a mask in an order and then others, eight int32; and the bits of the mask in that order."""
    octants = octal8(order)
    bits = movemask(permuted(meets, octants))
    return permuted(octants, set_first(bits)), bits


@inlined
def always(query, k, found):
    """``reaches`` of a ``walk_nearest_first`` whose ``enter`` pushes no data."""
    return True


@inlined
def walk(tree, stack, query, found, enter, visit):
    """Walk from the root to every leaf that a query reaches, last octants first. Returns what was found.

    stack  pointer to ``stack_size`` int64
    query  read by both kernels
    found  the initial result; its type never changes
    enter  enter(tree, query, node, found): the result after a node, and the bits of the octants to enter
    visit  visit(tree, query, first, count, found): the result after the ``count`` blocks of a leaf from ``first`` on,
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
    """``walk`` in order of distance, if ``enter`` pushes the octants of a node in that order.

    reaches  reaches(query, k, found): whether the stack's k-th entry may still matter when its turn comes
    enter    enter(tree, query, node, found, top): the result after a node, and the stack's top above the octants that
             it pushed, with the data that ``reaches`` reads
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
