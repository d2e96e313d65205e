"""Counts the steps of a ray's search for its closest hit, for heat maps of a tree's quality."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load, offset, pointer, store
from renderer.results.steps import Steps
from renderer.system.threads import for_chunks
from renderer.trace.batch import CHUNK, RayBatch, reject
from renderer.trace.best import Best, no_hit
from renderer.trace.intersect import box_limit, face_in
from renderer.trace.layout import BLOCK_FACES, Tree
from renderer.trace.leaf import nearest_carefully
from renderer.trace.rays import batch_pointers, first_bad_ray, ray_at
from renderer.trace.single_ray import SingleRay, enter_node, prepare_single
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import child_in, stack_size, walk_nearest_first

# The nodes and triangles that a call tests, beside those of one ray: some milliseconds, so that Ctrl-C need not wait
# for long.
_WORK = 1 << 18


def count_steps(tree: Tree, rays: RayBatch, shape: tuple[int, ...], threads: int) -> Steps:
    """Steps of a batch of rays, see ``Octree.count_steps``."""
    counts, bad = np.zeros((2, rays.number), np.int64), list[int]()

    def count(begin: int, end: int) -> Iterator[None]:
        size = stack_size(tree.depth)
        stack, near = np.empty(size, np.int64), np.empty(size + 8, np.float32)
        while begin < end:
            begin, row = _count_chunk(tree.descriptor, rays, counts, stack, near, begin, end)
            if row >= 0:
                bad.append(row)
                return
            yield

    for_chunks(count, rays.number, CHUNK // 8, threads)
    if bad:
        reject(rays, min(bad), tree.scale)
    if not tree.has_nodes:
        counts[1] = (tree.faces >= 0).sum()
    return Steps(counts[0].reshape(shape), counts[1].reshape(shape))


@kernel
def _count_chunk(descriptor, rays, counts, stack, near, begin, end):
    """Write nodes and triangles of the rays begin:end to ``counts`` (2, n).

    stack  memory for ``walk.stack_size`` int64
    near   for as many float32 and eight more

    Returns the ray before which it ended, early after _WORK, and the row of a ray out of range, or -1.
    """
    tree = tree_pointers(descriptor)
    source = batch_pointers(rays, tree.scale)
    bad, work = first_bad_ray(source, begin, end), np.int64(0)
    if bad < 0 and tree.has_nodes:
        waiting = _Waiting(pointer(stack), pointer(near), offset(pointer(near), len(stack)))
        for i in range(begin, end):
            ray, t_max = ray_at(source, i)
            counts[0, i], counts[1, i] = _count(tree, ray, t_max, waiting)
            work += counts[0, i] + counts[1, i]
            if work > _WORK:
                return i + 1, bad
    return end, bad


class _Waiting(NamedTuple):
    """Pointers to the waiting children, to the distances of their boxes, and to those of eight octants."""

    stack: Any
    near: Any
    distances: Any


class _Query(NamedTuple):
    """A ray, and its waiting children."""

    single: SingleRay
    waiting: _Waiting


class TraversalCounts(NamedTuple):
    """The best hit so far, and the numbers of nodes and triangles tested."""

    best: Best
    nodes: int
    triangles: int


@kernel
def _count(tree, ray, t_max, waiting):
    """Nodes and triangles of one ray."""
    store(waiting.near, 0, np.float32(0.0))
    nothing = TraversalCounts(no_hit(t_max), np.int64(0), np.int64(0))
    query = _Query(prepare_single(ray), waiting)
    found = walk_nearest_first(tree, waiting.stack, query, nothing, _reaches, _enter, _visit)
    return found.nodes, found.triangles


@inlined
def _reaches(query, k, found):
    # Nothing is beyond a limit of NaN.
    return not load(query.waiting.near, k) > box_limit(found.best.t, query.single.largest)


@inlined
def _enter(tree, query, node, found, top):
    t0, bits, order = enter_node(tree, node, query.single, found.best.t)
    store(query.waiting.distances, 0, t0)
    top = _push_in_order(tree, node, bits, np.int64(order), query.waiting, top)
    return TraversalCounts(found.best, found.nodes + 1, found.triangles), top


@inlined
def _visit(tree, query, first, count, found):
    best = nearest_carefully(tree, first, count, query.single.ray, query.single.shear, found.best)
    return TraversalCounts(best, found.nodes, found.triangles + _faces_in(tree, first, count)), False


@kernel
def _faces_in(tree, first, count):
    faces = np.int64(0)
    for place in range(first * BLOCK_FACES, (first + count) * BLOCK_FACES):
        faces += np.int64(face_in(tree, place) >= 0)
    return faces


@inlined
def _push_in_order(tree, node, bits, order, waiting, top):
    """``push_children`` with the nearest on top, as in streams."""
    for k in range(8):
        i = order >> 3 * k & 7
        if bits >> i & 1 != 0:
            store(waiting.near, top, load(waiting.distances, i))
            store(waiting.stack, top, child_in(tree, node, i))
            top += 1
    return top
