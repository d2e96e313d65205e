"""Rays traced one by one: those of small batches, and those whose hits are in doubt."""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import LOCAL_WORDS, at, get, is_negative, local_words, pointer, put, splat8
from renderer.trace.intersect import box_limit, enter_boxes, largest_of, make_shear, make_slabs, round_down
from renderer.trace.leaf import NO_FACE, blocks_of, nearest_carefully, push_children, tree_pointers
from renderer.trace.rays import first_bad_ray, hit_pointers, ray_at, ray_pointers, write_hit
from renderer.trace.starts.record import EDGE, PILE
from renderer.trace.starts.search import NEAR_HIT, search_from, t_from


def stack_size(depth: int) -> int:
    """Entries of one stack: each level leaves at most seven octants waiting, and some are written beyond the top."""
    return 7 * depth + 24


# The levels of the deepest tree whose stack fits into a kernel's own frame.
FEW_DEPTH = (LOCAL_WORDS - stack_size(0)) // 7


@kernel
def search_singly(tree, ray, t_max, stack):
    """The closest hit (t, face, u, v, w) of one ray, with every doubt settled; face = NO_FACE for none. Also returns
    the number of nodes and blocks that it took.

    The octants of a node are visited from the last to the first, not by their distance. That suits few rays and
    compiles in a fraction of the time that packets and streams take.
    """
    largest = largest_of(ray)
    slabs, shear = make_slabs(ray, largest), make_shear(ray)
    lower = splat8(round_down(ray.t_min * largest))
    # rule: first-limit
    best = (t_max, np.int32(NO_FACE), 0.0, 0.0, 1.0)
    if not tree.has_nodes:
        return nearest_carefully(tree, 0, tree.count, ray, shear, best), tree.count
    top, steps = 1, np.int64(0)
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            first, count = blocks_of(child)
            # rule: blocks-of-leaf
            best = nearest_carefully(tree, first, count, ray, shear, best)
            steps += count
            continue
        _, bits = enter_boxes(tree.nodes, child, slabs, lower, splat8(box_limit(best[0], largest)))
        top = push_children(tree, child, bits, stack, top)
        steps += 1
    return best, steps


@kernel
def search_carefully(tree, rays, i, stack, holders, any_hit):
    """``search_singly`` for ray ``i``, or ``search_from`` where it starts on the surface; with ``any_hit`` any hit."""
    ray, t_max = ray_at(rays, i)
    if ray.leaving >= 0.0:
        return search_from(tree, rays.starts, i, ray, t_max, stack, holders, any_hit)
    return search_singly(tree, ray, t_max, stack)


@inlined
def write_best(tree, rays, found, i, best, start, dz, any_hit):
    """Write the best hit (t, face, u, v, w) of ray ``i``, see ``write_hit``; t counts from its exact start.

    ``start`` is (the ray's slack, its largest component): where the hit is near, the way that its origin was moved is a
    part of t.
    """
    slack, largest = start
    if not any_hit and 0.0 < slack < EDGE and best[0] * largest < NEAR_HIT * slack:
        best = count_from_start(tree, rays, i, best)
    write_hit(found, i, rays.scale, best, dz, any_hit)
    if slack > 0.0 and not any_hit and best[0] == 0.0 and is_negative(best[0]):
        put(found.pile, i, np.int64(get(at(rays.starts.rows, i * rays.starts.step), PILE)))


@kernel
def count_from_start(tree, rays, i, best):
    """A hit with t counted from the exact start of ray ``i``."""
    t, face, u, v, w = best
    if face != NO_FACE:
        t = t_from(tree, rays.starts, i, ray_at(rays, i)[0], np.int64(face), t)
    return t, face, u, v, w


@kernel
def trace_few(words, rays, out, holders):
    """Closest hits of a few rays, one by one, into the rows t, u, v, face and side of ``out``.

    Bounds and return value are those of ``trace_chunk``. The tree has at most FEW_DEPTH levels.
    """
    tree, count = tree_pointers(words), out.shape[1]
    source, found = ray_pointers(rays, tree.scale), hit_pointers(out, count)
    bad = first_bad_ray(source, 0, count)
    if bad >= 0:
        return bad
    stack = local_words()
    for i in range(count):
        best, _ = search_carefully(tree, source, i, stack, pointer(holders), False)
        ray, _ = ray_at(source, i)
        write_best(tree, source, found, i, best, (ray.slack, largest_of(ray)), make_shear(ray).direction_z, False)
    return -1
