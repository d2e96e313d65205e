"""Trees of nodes with eight boxes and leaves of up to four triangles a block, in one plain form: ours and a BVH8."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.octree import Octree
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CHILDREN, NODE_WORDS
from validation.benchmark.limits.bvh8 import build

NODE_BYTES = 256
# Of a BVH8's block of four triangles: nine rows of four float32, and the numbers of mesh and triangle.
BVH8_BLOCK_BYTES = 176


class PlainTree(NamedTuple):
    """A tree as ``walks`` reads it.

    boxes        (N, 6, 8) float32: lower x, upper x, lower y, upper y, lower z, upper z of eight children
    children     (N, 8) int64: a node, or below 0 the complement of a leaf, 8 * its first block + its blocks less one
    faces        (B, 4) int32: the face in each place of each block, -1 where unused
    block_bytes  the size of a block in memory; a node has NODE_BYTES
    """

    boxes: NDArray[np.float32]
    children: NDArray[np.int64]
    faces: NDArray[np.int32]
    block_bytes: int


def octree_of(octree: Octree) -> PlainTree:
    """Our tree."""
    tree = octree.tree
    words = tree.nodes.reshape(-1, NODE_WORDS)
    # In the mesh's units; a power of two changes no digit.
    boxes = np.ascontiguousarray(words[:, :CHILDREN]).reshape(-1, 6, 8) / np.float32(tree.scale)
    children = tree.links.reshape(-1, NODE_WORDS)[:, CHILDREN : CHILDREN + 8].astype(np.int64)
    return PlainTree(boxes, children, tree.faces.reshape(-1, BLOCK_FACES), BLOCK_WORDS * tree.blocks.itemsize)


def bvh8_of(octree: Octree) -> PlainTree:
    """The BVH8 that Embree's builder would make of the same mesh, see ``bvh8``."""
    corners = octree.mesh.triangles
    boxes, children, faces = build(corners.min(axis=1), corners.max(axis=1))
    return PlainTree(boxes, children, faces, BVH8_BLOCK_BYTES)
