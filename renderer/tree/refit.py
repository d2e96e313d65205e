"""Refits a tree to moved vertices: the same nodes and leaves, with new boxes and blocks."""

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel
from renderer.numerics.simd import maximum, minimum
from renderer.system.threads import for_chunks
from renderer.trace.intersect import face_range
from renderer.trace.layout import (
    BLOCK_FACES,
    CHILDREN,
    NODE_WORDS,
    Tree,
    cache_aligned,
    locked,
)
from renderer.trace.walk import blocks_of
from renderer.tree.blocks import fill_blocks
from renderer.tree.order import order_nodes

# Nodes per chunk when leaves are fitted: some tenths of a millisecond.
_NODES = 1 << 10


@kernel
def _fit_leaves(vertices, faces, block_faces, nodes, links, begin, end):
    """Set the boxes of all leaves of the nodes ``begin:end``; empty octants, by their boxes, stay empty."""
    for node in range(begin, end):
        for place in range(8):
            at = node * NODE_WORDS + place
            link = links[at + CHILDREN]
            if link < 0 and nodes[at] <= nodes[at + 8]:
                first, count = blocks_of(link)
                begin_face, end_face = first * BLOCK_FACES, (first + count) * BLOCK_FACES
                _fit_leaf(vertices, faces, block_faces, begin_face, end_face, nodes, at)


@kernel
def _fit_leaf(vertices, faces, block_faces, first, last, nodes, at):
    """Set the box whose words are ``at``, ``at + 8``, ... to the union of the boxes of the faces in ``first:last``."""
    for axis in range(3):
        low, high = np.float32(np.inf), np.float32(-np.inf)
        for i in range(first, last):
            face = block_faces[i]
            if face >= 0:
                a, b, c = faces[face]
                bottom, top = face_range(vertices[a, axis], vertices[b, axis], vertices[c, axis])
                low, high = minimum(low, bottom), maximum(high, top)
        nodes[at + 16 * axis], nodes[at + 16 * axis + 8] = low, high


@kernel
def _fit_nodes(nodes, links):
    """Set the boxes of all nodes to the union of their children's. A child comes after its parent in memory."""
    for node in range(len(nodes) // NODE_WORDS - 1, -1, -1):
        for place in range(8):
            child = links[node * NODE_WORDS + CHILDREN + place]
            if child >= 0:
                for axis in range(3):
                    row, at = child * NODE_WORDS + 16 * axis, node * NODE_WORDS + 16 * axis + place
                    low, high = nodes[row], nodes[row + 8]
                    for k in range(1, 8):
                        low, high = minimum(low, nodes[row + k]), maximum(high, nodes[row + 8 + k])
                    nodes[at], nodes[at + 8] = low, high


def refit_tree(tree: Tree, vertices: NDArray[np.float64], faces: NDArray[np.int32], scale: float, threads: int) -> Tree:
    """``tree`` over moved vertices, in new arrays; the faces of its blocks, which do not change, are shared."""
    nodes = cache_aligned(len(tree.nodes), np.float32)
    links = nodes.view(np.int32)
    # Copied as integers, because the bits of a link may be a NaN as a float.
    links[:] = tree.links
    block_faces = locked(tree.faces)
    for_chunks(
        lambda begin, end: _fit_leaves(vertices, faces, block_faces, nodes, links, begin, end),
        len(nodes) // NODE_WORDS,
        _NODES,
        threads,
    )
    _fit_nodes(nodes, links)
    for_chunks(lambda begin, end: order_nodes(nodes, links, begin, end), len(nodes) // NODE_WORDS, _NODES, threads)
    return Tree(nodes, fill_blocks(vertices, faces, tree.faces, threads), tree.faces, tree.depth, scale)
