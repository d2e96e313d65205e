"""Checks of what a traversal relies on: complete and slow for tests and reports, and quick for trees from files."""

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.trace.intersect import ROOM
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CHILDREN, NODE_WORDS, ORDERS, Tree
from renderer.trace.walk import blocks_of


def faults(tree: Tree, mesh: Mesh) -> list[str]:
    """The faults of ``tree`` as the octree of ``mesh``, in words; empty if all of these hold.

    Every node and block is reached exactly once; without faces there is none. A child's box contains its descendants'
    and the boxes of its faces, see ``intersect.face_range``. Every face, with its own vertices, is in exactly one
    place. No path is longer than ``tree.depth``. Unused places have no face and no area; unused octants have inverted
    boxes. The orders of a node have all octants, the farthest first.
    """
    found = _block_faults(tree, mesh) + _order_faults(tree)
    nodes = len(tree.nodes) // NODE_WORDS
    reached, blocks_reached = np.zeros(nodes, np.int64), np.zeros(len(tree.faces) // BLOCK_FACES, np.int64)
    infinite = (np.full(3, -np.inf), np.full(3, np.inf))
    pending = [(0, 1, *infinite)] if nodes or len(mesh.faces) else []
    while pending:
        node, level, lower, upper = pending.pop()
        if not 0 <= node < nodes:
            found.append(f"a link to node {node} of {nodes}")
            continue
        reached[node] += 1
        if reached[node] > 1:
            continue
        if level > tree.depth:
            found.append(f"node {node}: level {level} is deeper than {tree.depth}")
        for place in range(8):
            low, high, child = _octant(tree, node, place)
            where = f"node {node}, octant {place}"
            if not (low <= high).all():
                if not (np.isposinf(low).all() and np.isneginf(high).all()):
                    found.append(f"{where}: inverted box that is not the empty one")
                continue
            if (low < lower).any() or (high > upper).any():
                found.append(f"{where}: box reaches outside its parent's")
            if child >= 0:
                pending.append((child, level + 1, low, high))
            else:
                found += _leaf_faults(tree, mesh, child, (low, high), blocks_reached, where)
    found += [f"node {i}: reached {n} times" for i, n in enumerate(reached) if n != 1]
    found += [f"block {i}: reached {n} times" for i, n in enumerate(blocks_reached) if n != 1]
    return found


def _octant(tree: Tree, node: int, place: int) -> tuple[NDArray[np.float32], NDArray[np.float32], int]:
    words = tree.nodes[node * NODE_WORDS : node * NODE_WORDS + CHILDREN].reshape(6, 8)
    return words[0::2, place], words[1::2, place], int(tree.links[node * NODE_WORDS + CHILDREN + place])


def _leaf_faults(
    tree: Tree,
    mesh: Mesh,
    leaf: int,
    box: tuple[NDArray[np.float32], NDArray[np.float32]],
    blocks_reached: NDArray[np.int64],
    where: str,
) -> list[str]:
    first, count = blocks_of.py_func(leaf)
    if first + count > len(blocks_reached):
        return [f"{where}: leaf of blocks {first} to {first + count - 1} of {len(blocks_reached)}"]
    blocks_reached[first : first + count] += 1
    faces = tree.faces[first * BLOCK_FACES : (first + count) * BLOCK_FACES]
    faces = faces[(faces >= 0) & (faces < len(mesh.faces))]
    corners = mesh.vertices[mesh.faces[faces]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    room = (high - low) * ROOM
    outside = (low - room < box[0]).any() or (high + room > box[1]).any()
    return [f"{where}: a face reaches outside the leaf's box"] if outside else []


def _block_faults(tree: Tree, mesh: Mesh) -> list[str]:
    """Faults in the blocks by themselves: each face exactly once, with its vertices."""
    found: list[str] = []
    used = tree.faces >= 0
    known = used & (tree.faces < len(mesh.faces))
    bad = (used & ~known) | (tree.faces < -1)
    found += [f"place {p}: face {tree.faces[p]} of {len(mesh.faces)}" for p in np.flatnonzero(bad)]
    counts = np.bincount(tree.faces[known], minlength=len(mesh.faces))
    found += [f"face {f}: expected in 1 place, is in {counts[f]}" for f in np.flatnonzero(counts != 1)]
    rows = tree.blocks.reshape(-1, BLOCK_WORDS // BLOCK_FACES, BLOCK_FACES).transpose(0, 2, 1).reshape(-1, 3, 3)
    wrong = (rows[known] != mesh.vertices[mesh.faces[tree.faces[known]]]).any(axis=(1, 2))
    found += [f"face {f}: its vertices in the block differ from the mesh's" for f in tree.faces[known][wrong]]
    idle = rows[~used]
    empty = np.isnan(idle).all(axis=(1, 2))
    found += [f"place {p}: unused but not NaN" for p in np.flatnonzero(~used)[~empty]]
    return found


def _order_faults(tree: Tree) -> list[str]:
    """Orders of nodes that lack an octant, or have one before another that is farther, see ``tree.order``."""
    words, links = tree.nodes.reshape(-1, NODE_WORDS), tree.links.reshape(-1, NODE_WORDS)
    found: list[str] = []
    for place in range(8):
        signs = np.where(place >> np.arange(3) & 1, np.float32(-1.0), np.float32(1.0))
        octants = links[:, ORDERS + place, None] >> 3 * np.arange(8) & 7
        with np.errstate(invalid="ignore", over="ignore"):
            x, y, z = words[:, :CHILDREN].reshape(-1, 3, 2, 8).sum(axis=2).swapaxes(0, 1) * signs[:, None, None]
            far = x + y + z
        far[np.isnan(far)] = 0.0
        near_first = (np.diff(np.take_along_axis(far, octants, axis=1)) > 0.0).any(axis=1)
        lacking = _octants_in(links[:, ORDERS + place]) != 0xFF
        found += [f"node {node}: order {place} lacks an octant" for node in np.flatnonzero(lacking)]
        found += [f"node {node}: order {place} has a near octant first" for node in np.flatnonzero(near_first)]
    return found


def check_safe(tree: Tree, face_count: int) -> None:
    """Raise ``ValueError`` for a tree that leads a traversal out of the arrays, into a cycle or beyond its stack.

    Quick, for trees from files. Boxes and blocks are not compared with the mesh: wrong ones cause wrong hits, and
    nothing worse.
    """
    blocks = len(tree.faces) // BLOCK_FACES
    stored = len(tree.blocks) // BLOCK_WORDS
    expect(stored == blocks, "blocks", f"{blocks}, as block_faces has", stored)
    used = tree.faces[tree.faces != -1]
    least, last = int(used.min(initial=0)), int(used.max(initial=-1))
    expect(least >= 0 and last < face_count, "block_faces", f"faces of {face_count}, or -1", f"{least} to {last}")
    once = len(used) == face_count and bool((np.bincount(used, minlength=face_count) == 1).all())
    expect(once, "block_faces", f"each of {face_count} faces once", f"{len(used)} places with other faces")
    links = tree.links.reshape(-1, NODE_WORDS)[:, CHILDREN : CHILDREN + 8]
    expect((len(links) > 0) == (face_count > 0), "nodes", "some where there are faces, else none", len(links))
    first, count = blocks_of.py_func(links[links < 0])
    last = int((first + count - 1).max(initial=-1))
    expect(last < blocks, "nodes", f"leaves within {blocks} blocks", f"one up to block {last}")
    _check_levels(links, tree.depth)
    ordered = _octants_in(tree.links.reshape(-1, NODE_WORDS)[:, ORDERS : ORDERS + 8])
    lacking = int((ordered != 0xFF).sum())
    expect(lacking == 0, "nodes", "orders with all octants", f"{lacking} that lack one")


def _octants_in(orders: NDArray[np.int32]) -> NDArray[np.int32]:
    """The bits of the octants that orders have."""
    found = np.zeros(orders.shape, np.int32)
    for k in range(8):
        found |= 1 << (orders >> 3 * k & 7)
    return found


def _check_levels(links: NDArray[np.int32], depth: int) -> None:
    """Raise ``ValueError`` unless the nodes are a tree of ``depth`` levels, each after its parent in memory."""
    count = len(links)
    parents, places = np.nonzero(links >= 0)
    children = links[parents, places]
    last = int(children.max(initial=-1))
    expect(last < count, "nodes", f"links to {count} nodes", f"one to node {last}")
    before = int((children <= parents).sum())
    expect(before == 0, "nodes", "children after their parents", f"{before} before")
    once = int((np.bincount(children, minlength=count)[1:] == 1).sum())
    expect(once == max(count - 1, 0), "nodes", "one link to each but the first", f"that for {once} of {count}")
    levels, current = 0, np.zeros(min(count, 1), np.int32)
    while len(current) and levels <= depth:
        below = links[current]
        levels, current = levels + 1, below[below >= 0]
    more = " or more" if len(current) else ""
    expect(levels == depth, "depth", f"the levels of nodes, {levels}{more}", depth)
