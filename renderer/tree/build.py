"""Builds the tree: cuts the top level by level, builds the subtrees below in parallel, then joins both.

Faces are cut into a binary hierarchy with fitted boxes, by octants at the midpoint or by the surface area heuristic.
Parts of it then become leaves and children of nodes of eight. The end of the top depends only on the number of faces,
so the tree is the same for any number of threads.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.system.threads import for_chunks
from renderer.trace.layout import BLOCK_FACES, NODE_WORDS, Tree, cache_aligned
from renderer.tree.blocks import fill_blocks
from renderer.tree.bounds import BOX, Faces, face_boxes, fit
from renderer.tree.collapse import collapse
from renderer.tree.emit import emit_nodes, emit_scratch, moved_link, place_subtree
from renderer.tree.hierarchy import MIDPOINT, SAH, Hierarchy, Rule, add_part, first_parts, new_hierarchy
from renderer.tree.subtree import SubtreeScratch, build_subtree, cut_once, new_cut_scratch, new_subtree_scratch

SPLITS = {"midpoint": MIDPOINT, "sah": SAH}

# Parts of at most so many faces are subtrees: some milliseconds of work, in memory that stays in a core's cache.
_SUBTREE = 8192
# Faces per chunk when their boxes are computed: some tenths of a millisecond.
_BOXES = 1 << 14
# The most parts of one cut: itself, two halves, four quarters and eight octants.
_PARTS = 15


class _Subtree(NamedTuple):
    """A built subtree; links count from its own first node and block."""

    nodes: NDArray[np.float32]
    block_faces: NDArray[np.int32]
    link: int
    cost: float
    depth: int


def build_tree(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], rule: Rule, scale: float = 1.0, threads: int = 1
) -> Tree:
    """Build the tree over all faces; vertices are already multiplied by ``scale``. Without faces it has no nodes."""
    if not len(faces):
        return build_blocks(vertices, faces, scale, threads)
    nodes, block_faces, depth = build_nodes(boxes_of_faces(vertices, faces, threads), rule, threads)
    return Tree(nodes, fill_blocks(vertices, faces, block_faces, threads), block_faces, depth, scale)


def build_blocks(vertices: NDArray[np.float64], faces: NDArray[np.int32], scale: float = 1.0, threads: int = 1) -> Tree:
    """The blocks alone, in the order of the faces, for tracing without a tree."""
    block_faces = np.full(-(-len(faces) // BLOCK_FACES) * BLOCK_FACES, -1, np.int32)
    block_faces[: len(faces)] = np.arange(len(faces))
    return Tree(np.empty(0, np.float32), fill_blocks(vertices, faces, block_faces, threads), block_faces, 0, scale)


def boxes_of_faces(vertices: NDArray[np.float64], faces: NDArray[np.int32], threads: int) -> Faces:
    """The boxes of all faces."""
    order = new_faces(len(faces))
    for_chunks(
        lambda begin, end: face_boxes(vertices, faces, order.boxes, order.numbers, begin, end),
        len(faces),
        _BOXES,
        threads,
    )
    return order


def new_faces(count: int) -> Faces:
    """Memory for the boxes of so many faces, to be filled."""
    boxes = cache_aligned(count * BOX, np.float32)
    return Faces(boxes, boxes.view(np.int32), cache_aligned(len(boxes), np.float32))


def build_nodes(order: Faces, rule: Rule, threads: int) -> tuple[NDArray[np.float32], NDArray[np.int32], int]:
    """Nodes over boxes, at least one; the faces of all blocks; and the levels of nodes."""
    top, subtrees = build_parts(order, rule, threads)
    if len(subtrees) > 1:
        return _join(top, subtrees, rule, threads)
    (built,) = subtrees.values()
    nodes = cache_aligned(len(built.nodes), np.float32)
    nodes[:] = built.nodes
    return nodes, built.block_faces, built.depth


def build_parts(order: Faces, rule: Rule, threads: int) -> tuple[Hierarchy, dict[int, _Subtree]]:
    """The top of the hierarchy, and the subtree of each of its whole parts."""
    top, levels = _cut_top(order, rule, threads)
    return top, _build_subtrees(order, rule, top, levels, threads)


def _cut_top(order: Faces, rule: Rule, threads: int) -> tuple[Hierarchy, list[int]]:
    """Cut all faces until no part is larger than a subtree; also return the number of cuts above each part."""
    count = len(order.boxes) // BOX
    top, levels = new_hierarchy(1), [0]
    add_part.py_func(top, 0, 0, count)  # a few words, not worth a kernel
    waiting = [0] if count > _SUBTREE else []
    if waiting:
        fit(order.boxes, 0, count, top.boxes, 0)
    while waiting:
        pieces = _cut_each(order, rule, top, levels, waiting, threads)
        before = len(top.halves)
        top = _grafted(top, waiting, [piece for piece, _ in pieces])
        levels += [level for piece, level in pieces for _ in piece.halves[1:]]
        sizes = top.ranges[:, 1] - top.ranges[:, 0]
        waiting = [part for part in range(before, len(sizes)) if top.halves[part] < 0 and sizes[part] > _SUBTREE]
    return top, levels


def _cut_each(
    order: Faces, rule: Rule, top: Hierarchy, levels: list[int], parts: list[int], threads: int
) -> list[tuple[Hierarchy, int]]:
    """Cut each of ``parts`` once. Returns the resulting hierarchy of each, and the level of the new parts."""
    cut: dict[int, tuple[Hierarchy, int]] = {}

    def work(begin: int, end: int) -> None:
        for part in parts[begin:end]:
            piece = new_hierarchy(_PARTS)
            add_part(piece, 0, *top.ranges[part].tolist())
            piece.boxes[:BOX] = top.boxes[part * BOX : (part + 1) * BOX]
            count, level = cut_once(order, piece, rule, levels[part], new_cut_scratch())
            cut[part] = first_parts(piece, count), level

    for_chunks(work, len(parts), 1, threads)
    return [cut[part] for part in parts]


def _grafted(top: Hierarchy, parts: list[int], pieces: list[Hierarchy]) -> Hierarchy:
    """The hierarchy in which each of the whole ``parts`` is replaced by its piece; new parts come last."""
    halves, count = [top.halves.copy()], len(top.halves)
    for part, piece in zip(parts, pieces, strict=True):
        moved = np.where(piece.halves < 0, np.int32(-1), piece.halves + np.int32(count - 1))
        halves[0][part] = moved[0]
        halves.append(moved[1:])
        count += len(moved) - 1
    grown = new_hierarchy(count)
    grown.halves[:] = np.concatenate(halves)
    grown.boxes[:] = np.concatenate([top.boxes] + [piece.boxes[BOX:] for piece in pieces])
    grown.ranges[:] = np.concatenate([top.ranges] + [piece.ranges[1:] for piece in pieces])
    return grown


def _build_subtrees(order: Faces, rule: Rule, top: Hierarchy, levels: list[int], threads: int) -> dict[int, _Subtree]:
    """The subtree of each whole part, by the part's number in ascending order."""
    parts = np.flatnonzero(top.halves < 0).tolist()
    built: dict[int, _Subtree] = {}
    idle: list[SubtreeScratch] = []
    largest = int((top.ranges[parts, 1] - top.ranges[parts, 0]).max())

    def work(begin: int, end: int) -> None:
        scratch = idle.pop() if idle else new_subtree_scratch(largest)
        for part in parts[begin:end]:
            found = build_subtree(order, rule, *top.ranges[part].tolist(), levels[part], scratch)
            link, cost, nodes, blocks, depth = found
            built[part] = _Subtree(
                scratch.nodes[: nodes * NODE_WORDS].copy(),
                scratch.block_faces[: blocks * BLOCK_FACES].copy(),
                link,
                cost,
                depth,
            )
        idle.append(scratch)

    for_chunks(work, len(parts), 1, threads)
    return {part: built[part] for part in parts}


def _join(
    top: Hierarchy, subtrees: dict[int, _Subtree], rule: Rule, threads: int
) -> tuple[NDArray[np.float32], NDArray[np.int32], int]:
    """The nodes of the top followed by those of each subtree, the faces of all blocks, and the levels of nodes."""
    for part, built in subtrees.items():
        top.costs[8 * part] = built.cost
    collapse(top, len(top.halves), rule.leaf_size)
    # The top's own nodes, written once to count them, and again with the links that follow from their number.
    above, _ = _emit_top(top, subtrees, [(0, 0)] * len(subtrees))
    parts = list(subtrees.values())
    nodes_before = np.cumsum([len(above)] + [len(built.nodes) for built in parts]) // NODE_WORDS
    blocks_before = np.cumsum([0] + [len(built.block_faces) for built in parts]) // BLOCK_FACES
    starts = list(zip(nodes_before.tolist(), blocks_before.tolist(), strict=True))
    above, depth = _emit_top(top, subtrees, starts[:-1])
    nodes = cache_aligned(int(nodes_before[-1]) * NODE_WORDS, np.float32)
    block_faces = np.empty(int(blocks_before[-1]) * BLOCK_FACES, np.int32)
    nodes[: len(above)] = above
    links = nodes.view(np.int32)

    def place(begin: int, end: int) -> None:
        for built, (node, block) in zip(parts[begin:end], starts[begin:end], strict=True):
            place_subtree(built.nodes.view(np.int32), built.block_faces, node, block, links, block_faces)

    for_chunks(place, len(parts), 1, threads)
    return nodes, block_faces, depth


def _emit_top(
    top: Hierarchy, subtrees: dict[int, _Subtree], starts: list[tuple[int, int]]
) -> tuple[NDArray[np.float32], int]:
    """The nodes above the subtrees, whose first nodes and blocks are ``starts``, and the levels of all nodes."""
    ends = np.zeros((len(top.halves), 2), np.int32)
    for (part, built), start in zip(subtrees.items(), starts, strict=True):
        ends[part] = moved_link.py_func(built.link, *start), built.depth
    nodes = np.empty(len(top.halves) * NODE_WORDS, np.float32)
    none = np.empty(0, np.int32)
    used, _, depth = emit_nodes(top, none, ends, nodes, nodes.view(np.int32), none, emit_scratch())
    return nodes[: used * NODE_WORDS], depth
