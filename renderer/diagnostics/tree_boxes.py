"""The boxes of an octree's nodes, level by level, and those that one ray visits: for inspection, not for speed.

The root is level 0. An octant, node or leaf, is one level below its node. Boxes are in scene units, rounded outwards to
float32 as in the traversal.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.jit.decorators import kernel
from renderer.numerics.simd import splat8, store
from renderer.octree import BruteForce, Octree
from renderer.trace.batch import check_rays
from renderer.trace.best import NO_FACE, FaceHit, hit_on
from renderer.trace.intersect import Ray, box_limit, enter_boxes, largest_of, make_shear, make_slabs, round_down
from renderer.trace.layout import ANY_ORDER, CHILDREN, NODE_WORDS, ORDERS, Tree, root_box
from renderer.trace.leaf import nearest_carefully
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import blocks_of

Boxes = NDArray[np.float64]


class Visit(NamedTuple):
    """A node or leaf that a ray visited: its level, and its box's corners, each (3,) float64."""

    level: int
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    is_leaf: bool


def levels(octree: Octree | BruteForce) -> int:
    """The number of levels with boxes; 0 without nodes, as in ``BruteForce``, or without faces."""
    return octree.tree.depth + 1 if len(_root_box(octree.tree)) else 0


def boxes_at(octree: Octree | BruteForce, level: int) -> Boxes:
    """Boxes of all nodes and leaves of a level, (n, 6) float64: lower x, y, z, upper x, y, z. None below the last.

    Raises ``ValueError`` for a negative level.
    """
    count_argument("level", level)
    tree, scale = octree.tree, octree.tree.scale
    boxes = _root_box(tree)
    children = np.zeros(len(boxes), np.int64)
    for _ in range(level):
        boxes, children = _octants(tree, children[children >= 0])
    return boxes / scale


def _octants(tree: Tree, nodes: NDArray[np.int64]) -> tuple[Boxes, NDArray[np.int64]]:
    """Boxes and children of the used octants of ``nodes``, (n, 6) float64 and (n,) int64."""
    words = tree.nodes.reshape(-1, NODE_WORDS)[nodes, :CHILDREN].reshape(-1, 3, 2, 8)
    children = tree.links.reshape(-1, NODE_WORDS)[nodes, CHILDREN : CHILDREN + 8]
    used = words[:, 0, 0] <= words[:, 0, 1]
    return words.transpose(0, 3, 2, 1)[used].reshape(-1, 6).astype(np.float64), children[used].astype(np.int64)


def _root_box(tree: Tree) -> Boxes:
    """The box around the root's octants as the only row of (1, 6) float64; no row if there are none."""
    box = np.concatenate(root_box(tree.nodes)) if len(tree.nodes) else np.empty(0)
    return box.reshape(-1, 6) if len(box) and box[0] <= box[3] else np.empty((0, 6))


def visited(octree: Octree | BruteForce, origin: ArrayLike, direction: ArrayLike, t_max: float = np.inf) -> list[Visit]:
    """The nodes and leaves that the closest-hit search of one ray visits, in order.

    ``origin`` and ``direction`` (3,), ``t_max`` in units of |direction|. The octants of a node come in its order for
    the ray; one whose entry is beyond the best hit so far is not visited. The tests are the kernel's own, so these are
    the visits of a ray traced alone; a packet may visit more. A ray that misses the root visits nothing. Raises
    ``ValueError`` naming the argument.
    """
    rays, _ = check_rays(np.asarray(origin)[None], np.asarray(direction)[None], 0.0, t_max)
    octree.any_hit(rays.origins, rays.directions)  # raises for rays out of bounds
    tree, scale = octree.tree, octree.tree.scale
    (ox, oy, oz), (dx, dy, dz) = (scale * rays.origins[0]).tolist(), rays.directions[0].tolist()
    ray, t, face = Ray(ox, oy, oz, dx, dy, dz, 0.0), scale * float(rays.t_max[0]), NO_FACE
    opened: list[Visit] = []
    waiting = [o for box in _root_box(tree) for o in _met_octants(_above(tree, box), 0, -1, ray, t)]
    while waiting:
        distance, child, level, box = waiting.pop()
        if distance > _limit(ray, t):
            continue
        opened.append(Visit(level, box[:3] / scale, box[3:] / scale, child < 0))
        if child < 0:
            t, face = _best_in_leaf(tree.descriptor, child, ray, t, face)
        else:
            waiting += _met_octants(tree, child, level, ray, t)
    return opened


class _Waiting(NamedTuple):
    """An octant to be visited: the distance at which the ray enters it, its child, level and box."""

    distance: float
    child: int
    level: int
    box: NDArray[np.float64]


def _above(tree: Tree, box: NDArray[np.float64]) -> Tree:
    """A node above the root, whose only octant is the root in its ``box``, so that a ray enters it as any other."""
    words = np.full(NODE_WORDS, np.inf, np.float32)
    words[:CHILDREN].reshape(3, 2, 8)[:, 1] = -np.inf
    words[:CHILDREN].reshape(3, 2, 8)[:, :, 0] = box.reshape(2, 3).T
    words[CHILDREN:] = 0.0
    words.view(np.int32)[ORDERS : ORDERS + 8] = ANY_ORDER
    return replace(tree, nodes=words)


def _met_octants(tree: Tree, node: int, level: int, ray: Ray, t_max: float) -> list[_Waiting]:
    """The octants of ``node`` that the ray enters up to ``t_max``, in the node's order, nearest last."""
    # A copy, which can be written, as the node of ``_above`` can: the kernel is compiled for such arrays alone.
    words, distances = tree.nodes[node * NODE_WORDS : (node + 1) * NODE_WORDS].copy(), np.empty(8, np.float32)
    bits = _meet(words, ray, t_max, distances)
    boxes, links = words[:CHILDREN].reshape(3, 2, 8).astype(np.float64), words.view(np.int32)
    order = int(links[ORDERS + sum(int(np.signbit(d)) << k for k, d in enumerate((ray.dx, ray.dy, ray.dz)))])
    return [
        _Waiting(float(distances[i]), int(links[CHILDREN + i]), level + 1, boxes[:, :, i].T.ravel())
        for i in (order >> 3 * k & 7 for k in range(8))
        if bits >> i & 1
    ]


@kernel
def _meet(words: NDArray[np.float32], ray: Ray, t_max: float, distances: NDArray[np.float32]) -> int:
    """``enter_boxes`` of a node for Python: fills ``distances`` (8,) float32 and returns the bits of the octants
    entered.
    """
    largest = largest_of(ray)
    lower, upper = splat8(round_down(ray.t_min * largest)), splat8(box_limit(t_max, largest))
    t0, bits = enter_boxes(words, 0, make_slabs(ray, largest), lower, upper)
    store(distances, 0, t0)
    return bits


@kernel
def _limit(ray: Ray, t: float) -> float:
    """The distance beyond which an octant contains no hit at t or nearer."""
    return box_limit(t, largest_of(ray))


@kernel
def _best_in_leaf(descriptor: NDArray[np.int64], leaf: int, ray: Ray, t: float, face: int) -> tuple[float, int]:
    """t and face of the better of the best hit so far and the hits in a leaf."""
    tree, (first, count) = tree_pointers(descriptor), blocks_of(leaf)
    best = hit_on(np.int32(face), FaceHit(t, 0.0, 0.0, 1.0))
    best = nearest_carefully(tree, first, count, ray, make_shear(ray), best)
    return best.t, int(best.face)
