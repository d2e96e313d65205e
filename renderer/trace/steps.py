"""The steps of the search for a ray's closest hit, counted: what heat maps of a tree's quality are made of."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import at, get, lowest_bit, pointer, put, splat8, store
from renderer.system.threads import for_chunks
from renderer.trace.batch import CHUNK, RayBatch, reject
from renderer.trace.intersect import box_limit, enter_boxes, largest_of, make_shear, make_slabs, round_down
from renderer.trace.layout import BLOCK_FACES, CHILDREN, NODE_WORDS, Tree
from renderer.trace.leaf import NO_FACE, blocks_of, nearest_carefully, tree_pointers
from renderer.trace.rays import first_bad_ray, ray_at, ray_pointers
from renderer.trace.single import stack_size

_WORD = 0xFFFFFFFF
# The nodes and triangles that a call tests, beside those of one ray: some milliseconds, so that Ctrl-C need not wait
# for long.
_WORK = 1 << 18


@dataclass(eq=False, slots=True)
class Steps:
    """Steps of the search for each ray's closest hit, of a ray that travels alone and goes to the nearest boxes first.

    nodes      (...) int64, the nodes entered, whose eight boxes are tested at once
    triangles  (...) int64, the triangles tested

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> steps = Octree.from_mesh(box()).count_steps([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
    >>> steps.nodes, steps.triangles
    (array([1, 1]), array([4, 0]))
    """

    nodes: NDArray[np.int64]
    triangles: NDArray[np.int64]


def count_steps(tree: Tree, rays: RayBatch, shape: tuple[int, ...], threads: int) -> Steps:
    """Steps of a batch of rays of some dimensions, see ``Octree.count_steps``."""
    counts, bad = np.zeros((2, rays.number), np.int64), list[int]()

    def count(begin: int, end: int) -> Iterator[None]:
        size = stack_size(tree.depth)
        stack, near = np.empty(size, np.int64), np.empty(size + 8, np.float32)
        while begin < end:
            begin, row = _count_chunk(tree.words, rays, counts, stack, near, (begin, end))
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
def _count_chunk(words, rays, counts, stack, near, bounds):
    """Write nodes and triangles of the rays from bounds[0] to bounds[1] to ``counts`` (2, n).

    stack  memory for ``singly.stack_size`` int64
    near   for as many float32 and eight more

    Returns the ray before which it ended, early after _WORK; and the row of a ray out of range, or -1.
    """
    tree, source = tree_pointers(words), ray_pointers(rays, tree_pointers(words).scale)
    bad, work = first_bad_ray(source, bounds[0], bounds[1]), np.int64(0)
    if bad < 0 and tree.has_nodes:
        for i in range(bounds[0], bounds[1]):
            ray, t_max = ray_at(source, i)
            distances = at(pointer(near), len(stack))
            counts[0, i], counts[1, i] = _count(tree, ray, t_max, pointer(stack), pointer(near), distances)
            work += counts[0, i] + counts[1, i]
            if work > _WORK:
                return i + 1, bad
    return bounds[1], bad


@kernel
def _count(tree, ray, t_max, stack, near, distances):
    """Nodes and triangles of one ray; ``near`` has the distances of the boxes that wait on the stack."""
    largest = largest_of(ray)
    slabs, shear = make_slabs(ray, largest), make_shear(ray)
    lower = splat8(round_down(ray.t_min * largest))
    best = (t_max, np.int32(NO_FACE), 0.0, 0.0, 1.0)
    nodes, triangles, top = np.int64(0), np.int64(0), 1
    put(stack, 0, 0)
    put(near, 0, np.float32(0.0))
    while top > 0:
        top -= 1
        limit = box_limit(best[0], largest)
        if get(near, top) > limit:
            continue
        child = get(stack, top)
        if child < 0:
            first, count = blocks_of(child)
            best = nearest_carefully(tree, first, count, ray, shear, best)
            triangles += _faces_in(tree, first, count)
            continue
        nodes += 1
        t0, bits = enter_boxes(tree.nodes, child, slabs, lower, splat8(limit))
        store(distances, 0, t0)
        top = _push_sorted(tree.links, child * NODE_WORDS + CHILDREN, bits, stack, near, distances, top)
    return nodes, triangles


@kernel
def _faces_in(tree, first, count):
    faces = np.int64(0)
    for place in range(first * BLOCK_FACES, (first + count) * BLOCK_FACES):
        faces += np.int64(get(tree.faces, place) >= 0)
    return faces


@inlined
def _push_sorted(links, base, bits, stack, near, distances, top):
    """``push_children`` with the nearest on top, as in streams; ``base`` is where a node's links begin.

    ``near`` has the distances of what waits, ``distances`` those of the octants.
    """
    first = top
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        distance, child, k = get(distances, i), np.int64(get(links, base + i)), top
        while k > first and _precedes(get(near, k - 1), get(stack, k - 1), distance, child):
            put(near, k, get(near, k - 1))
            put(stack, k, get(stack, k - 1))
            k -= 1
        put(near, k, distance)
        put(stack, k, child)
        top += 1
    return top


@inlined
def _precedes(distance, child, other_distance, other):
    """Whether a box is nearer than another; of equal ones nodes come before leaves."""
    return distance < other_distance or (distance == other_distance and (child & _WORD) < (other & _WORD))
