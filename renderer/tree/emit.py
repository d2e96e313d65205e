"""Writes a collapsed hierarchy as nodes and leaves."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import maximum
from renderer.trace.layout import BLOCK_FACES, CHILDREN, LEAF_BITS, NODE_WORDS, UNUSED
from renderer.tree.bounds import BOX, FACE
from renderer.tree.order import order_octants

# The most parts that wait to become nodes: seven per level. Cuts by the split rule end after 3 * 64 levels, the
# greatest ``max_depth``, and cuts in even halves within 31 more.
WAITING = 8 * 256


class EmitScratch(NamedTuple):
    """Scratch of ``emit_nodes``: parts that wait to become nodes, and those that share a node's places."""

    waiting: NDArray[np.int32]
    shares: NDArray[np.int32]


def emit_scratch() -> EmitScratch:
    """Scratch for one thread."""
    return EmitScratch(np.empty((WAITING, 3), np.int32), np.empty((9, 2), np.int32))


@kernel
def emit_nodes(tree, numbers, ends, nodes, links, block_faces, scratch):
    """Write the nodes below part 0, which becomes node 0, depth first. Returns (nodes, blocks, levels of nodes).

    ``ends`` (n, 2) int32 has the link and the levels below it for each whole part. If it is empty, whole parts and
    those chosen by ``collapse`` are written as leaves. ``nodes`` and ``links`` are the same memory.
    """
    # Begin with part 0, which has no parent.
    waiting, shares = scratch.waiting, scratch.shares
    top, used, blocks, depth = _wait(waiting, 0, 0, 1, -1), np.int64(0), np.int64(0), np.int64(0)
    while top > 0:
        # Make the node and hang it below its parent.
        top -= 1
        part, level, parent = np.int64(waiting[top, 0]), np.int64(waiting[top, 1]), waiting[top, 2]
        depth = maximum(depth, level)
        base = used * NODE_WORDS
        _clear_node(nodes, links, base)
        if parent >= 0:
            links[parent] = used
        used += 1
        # Write its children: nodes that wait, subtrees that are built already, and leaves.
        place, shared = 0, _first_shares(tree, part, shares)
        while shared > 0:
            child, shared = _next_child(tree, shares, shared)
            _set_bounds(nodes, base, place, tree.boxes, child * BOX)
            link = base + CHILDREN + place
            place += 1
            if tree.choices[8 * child] > 0:
                top = _wait(waiting, top, child, level + 1, link)
            elif len(ends) > 0:
                links[link] = ends[child, 0]
                depth = maximum(depth, level + ends[child, 1])
            else:
                links[link] = leaf_link(blocks, tree.ranges[child, 1] - tree.ranges[child, 0])
                blocks = emit_leaf(tree, child, numbers, block_faces, blocks)
        order_octants(nodes, links, used - 1)
    return used, blocks, depth


@inlined
def _wait(waiting, top, part, level, link):
    """Push a part that will become the node behind ``link``, on its level. Returns the new top."""
    waiting[top, 0], waiting[top, 1], waiting[top, 2] = part, level, link
    return top + 1


@kernel
def _next_child(tree, shares, shared):
    """The part for the next place, and the number of shares left: the uppermost of ``shared`` shares is divided until
    one part takes one place.
    """
    while True:
        shared -= 1
        child, share = np.int64(shares[shared, 0]), shares[shared, 1]
        while share > 1 and tree.choices[8 * child + share - 1] == 0:
            share -= 1
        if share <= 1:
            return child, shared
        shared = _share_out(tree, child, tree.choices[8 * child + share - 1], share, shares, shared)


@kernel
def _first_shares(tree, part, shares):
    """Begin to divide a node's places; a part that is no node is its own only child."""
    if tree.choices[8 * part] > 0:
        return _share_out(tree, part, tree.choices[8 * part], 8, shares, 0)
    shares[0, 0], shares[0, 1] = part, 1
    return 1


@kernel
def _share_out(tree, part, left, share, shares, shared):
    """Give ``left`` of a part's places to its first half, which goes on top, and the rest to its second half."""
    first = tree.halves[part]
    shares[shared, 0], shares[shared, 1] = first + 1, share - left
    shares[shared + 1, 0], shares[shared + 1, 1] = first, left
    return shared + 2


@kernel
def leaf_link(block, count):
    """The link to a leaf of ``count`` faces whose first block is ``block``."""
    return ~((block << LEAF_BITS) | ((count + BLOCK_FACES - 1) // BLOCK_FACES - 1))


@kernel
def emit_leaf(tree, part, numbers, block_faces, blocks):
    """Write a part's faces to the blocks from ``blocks`` on, the last padded with -1. Returns the block after it."""
    begin, end = tree.ranges[part]
    at = blocks * BLOCK_FACES
    for i in range(begin, end):
        block_faces[at] = numbers[i * BOX + FACE]
        at += 1
    while at % BLOCK_FACES > 0:
        block_faces[at] = -1
        at += 1
    return at // BLOCK_FACES


@kernel
def _clear_node(nodes, links, base):
    nodes[base : base + NODE_WORDS] = 0.0
    for k in range(8):
        for axis in range(3):
            nodes[base + 16 * axis + k] = np.inf
            nodes[base + 16 * axis + 8 + k] = -np.inf
        links[base + CHILDREN + k] = UNUSED


@kernel
def _set_bounds(nodes, base, place, boxes, box):
    for axis in range(3):
        nodes[base + 16 * axis + place] = boxes[box + axis]
        nodes[base + 16 * axis + 8 + place] = -boxes[box + 4 + axis]


@kernel
def moved_link(link, node, block):
    """The link of a subtree whose first node and block are ``node`` and ``block`` in the whole tree."""
    return link + node if link >= 0 else link - (block << LEAF_BITS)


@kernel
def place_subtree(words, block_faces, node, block, links, all_block_faces):
    """Copy a subtree's nodes, as int32, and the faces of its blocks to the whole, from ``node`` and ``block`` on."""
    base = node * NODE_WORDS
    for i in range(len(words)):
        links[base + i] = words[i]
    for at in range(base, base + len(words), NODE_WORDS):
        for k in range(at + CHILDREN, at + CHILDREN + 8):
            links[k] = moved_link(links[k], node, block)
    for i in range(len(block_faces)):
        all_block_faces[block * BLOCK_FACES + i] = block_faces[i]
