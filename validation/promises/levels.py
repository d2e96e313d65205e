"""A tree as its layout says that it lies in memory: octants level by level, and the places of each leaf's faces."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.trace.layout import Tree

Floats = NDArray[np.float32]
Indices = NDArray[np.int64]


class Level(NamedTuple):
    """The used octants of the nodes of one level.

    boxes   (n, 2, 3) float32, lower and upper corners
    above   (n,) which octant of the level above is their node, 0 for the root
    links   (n,) the node that each is, or the code of its leaf, below 0
    """

    boxes: Floats
    above: Indices
    links: Indices


def octants(tree: Tree) -> tuple[Floats, Indices]:
    """The boxes (nodes, 8, 2, 3) and links (nodes, 8) of all places of all nodes."""
    boxes = tree.nodes.reshape(-1, 64)[:, :48].reshape(-1, 3, 2, 8).transpose(0, 3, 2, 1)
    return boxes, tree.links.reshape(-1, 64)[:, 48:56].astype(np.int64)


def levels(tree: Tree) -> list[Level]:
    """The octants of the root, those of the nodes among them, and so on; none deeper than the tree says to be."""
    boxes, links = octants(tree)
    found: list[Level] = []
    nodes = above = np.zeros(min(1, len(links)), np.int64)
    while len(nodes) and len(found) <= tree.depth:
        node, place = np.nonzero(boxes[nodes, :, 0, 0] <= boxes[nodes, :, 1, 0])
        found.append(Level(boxes[nodes[node], place], above[node], links[nodes[node], place]))
        above = np.flatnonzero(found[-1].links >= 0)
        nodes = found[-1].links[above]
    return found


def joined(found: list[Level]) -> Level:
    """The octants of all levels."""
    boxes, above, links = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
    return Level(boxes, above, links)


def places(links: Indices) -> tuple[Indices, Indices]:
    """The places of the blocks of some leaves: the row of ``links`` and the number among ``tree.faces`` of each."""
    first, count = ~links >> 3, 4 * ((~links & 7) + 1)
    leaf = np.repeat(np.arange(len(links)), count)
    return leaf, 4 * first[leaf] + np.arange(len(leaf)) - (np.cumsum(count) - count)[leaf]
