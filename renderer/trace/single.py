"""Rays traced one by one: those of small batches, and those with uncertain hits."""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import apart, inlined, kernel
from renderer.numerics.kinds import of_none
from renderer.numerics.simd import (
    LOCAL_WORDS,
    address,
    bool_pointer,
    is_negative,
    load,
    local_words,
    offset,
    pointer,
    store,
)
from renderer.trace.best import NO_FACE, Best, no_hit
from renderer.trace.intersect import largest_of, make_shear
from renderer.trace.leaf import nearest_carefully, nearest_in_blocks
from renderer.trace.rays import HitPointers, first_bad_ray, ray_at, ray_pointers, write_hit, write_misses
from renderer.trace.single_ray import Found, SingleRay, enter_counted, prepare_single, push_entered
from renderer.trace.starts.record import PILE
from renderer.trace.starts.search import is_near_start, search_from, t_from
from renderer.trace.trees import call_pointers, tree_pointers
from renderer.trace.walk import always, stack_size, walk_nearest_first

# What ``trace_few`` returns where a hit is uncertain.
UNRESOLVED = -2
# The levels of the deepest tree whose stack fits into a kernel's own frame.
FEW_DEPTH = (LOCAL_WORDS - stack_size(0)) // 7


@kernel
def search_singly(tree, ray, t_max, stack):
    """The closest hit of one ray, with every uncertain hit resolved, as ``Found``.

    It compiles much faster than packets and streams.
    """
    # rule: first-limit
    best = no_hit(t_max)
    query = _Alone(prepare_single(ray), stack)
    return walk_nearest_first(tree, stack, query, Found(best, np.int64(0)), always, enter_counted, _visit)


class _Alone(NamedTuple):
    """A ray, and the stack of its walk."""

    single: SingleRay
    stack: Any


@inlined
def _visit(tree, query, first, count, found):
    # rule: blocks-of-leaf
    best = nearest_carefully(tree, first, count, query.single.ray, query.single.shear, found.best)
    return Found(best, found.steps + count), False


@apart
def search_carefully(tree, rays, i, stack, holders, any_hit):
    """``search_singly`` for ray ``i``, or ``search_from`` if it starts on the surface; the latter ends early for any
    hit.
    """
    ray, t_max = ray_at(rays, i)
    return of_none(rays.starts, _search_alone, _search)(tree, rays.starts, i, ray, t_max, stack, holders, any_hit)


@inlined
def _search_alone(tree, starts, i, ray, t_max, stack, holders, any_hit):
    return search_singly(tree, ray, t_max, stack)


@inlined
def _search(tree, starts, i, ray, t_max, stack, holders, any_hit):
    if ray.leaving >= 0.0:
        return search_from(tree, starts, i, ray, t_max, stack, holders, any_hit)
    return search_singly(tree, ray, t_max, stack)


@inlined
def write_best(tree, rays, found, i, best, slack, largest, dz, any_hit):
    """Write the best hit of ray ``i``, see ``write_hit``; t counts from its exact start. A miss is written already, see
    ``write_misses``.

    ``slack`` is the ray's, ``largest`` the largest component of its direction: for a near hit, the move of the origin
    is a part of t.
    """
    if best.face == NO_FACE:
        return
    of_none(rays.starts, _write_alone, _write)(tree, rays, found, i, best, slack, largest, dz, any_hit)


@inlined
def _write_alone(tree, rays, found, i, best, slack, largest, dz, any_hit):
    write_hit(found, i, rays.scale, best, dz, any_hit)


@inlined
def _write(tree, rays, found, i, best, slack, largest, dz, any_hit):
    if not any_hit and is_near_start(slack, best.t * largest):
        best = count_from_start(tree, rays, i, best)
    write_hit(found, i, rays.scale, best, dz, any_hit)
    if slack > 0.0 and not any_hit and best.t == 0.0 and is_negative(best.t):
        store(found.pile, i, np.int64(load(offset(rays.starts.rows, i * rays.starts.step), PILE)))


@kernel
def count_from_start(tree, rays, i, best):
    """A hit with t counted from the exact start of ray ``i``."""
    t = t_from(tree, rays.starts, i, ray_at(rays, i)[0], np.int64(best.face), best.t)
    return Best(t, best.face, best.u, best.v, best.w)


class _Certain(NamedTuple):
    """The best certain hit so far, and whether an uncertain one must be resolved."""

    best: Best
    unresolved: bool


@inlined
def _enter_certainly(tree, query, node, found, top):
    return found, push_entered(tree, query.single, node, found.best.t, query.stack, top)


@inlined
def _visit_certainly(tree, query, first, count, found):
    single = query.single
    best, unresolved = nearest_in_blocks(tree, first, count, single.ray.t_min, single.shear, found.best)
    return _Certain(best, unresolved), unresolved


@kernel
def trace_few(descriptor, origins, directions, t_min, t_max, t, face, u, v, side):
    """Closest hits of a few rays of a ``RayBatch``, none of which starts on the surface, one by one, to arrays as of a
    ``HitArrays``. The tree has at most FEW_DEPTH levels.

    Returns the row of the first ray out of range, for which nothing is traced; UNRESOLVED where ``trace_carefully`` has
    to trace them, for which most processes need not compile what resolves hits; or -1.
    """
    # Each array that Python passes takes a tenth of a microsecond, so none comes that is not needed.
    tree, count = tree_pointers(descriptor), len(t)
    source = ray_pointers(origins, directions, t_min, t_max, None, tree.scale)
    sides, no_bools = pointer(side), bool_pointer(address(side))
    found = HitPointers(pointer(t), pointer(face), pointer(u), pointer(v), sides, sides, no_bools)
    bad = first_bad_ray(source, 0, count)
    if bad >= 0:
        return bad
    stack = local_words()
    write_misses(found, 0, count, False)
    for i in range(count):
        ray, limit = ray_at(source, i)
        single, nothing = prepare_single(ray), _Certain(no_hit(limit), False)
        query = _Alone(single, stack)
        best, unresolved = walk_nearest_first(tree, stack, query, nothing, always, _enter_certainly, _visit_certainly)
        # rule: uncertain-of-few
        if unresolved:
            return UNRESOLVED
        write_best(tree, source, found, i, best, 0.0, single.largest, single.shear.direction_z, False)
    return -1


@kernel
def trace_carefully(descriptor, origins, directions, t_min, t_max, starts, t, face, u, v, side, pile, hit, holders):
    """``trace_few`` with uncertain hits resolved, also for rays that start on the surface; returns the row or -1."""
    call = call_pointers(descriptor, origins, directions, t_min, t_max, starts, t, face, u, v, side, pile, hit)
    (tree, source, found), count = call, len(t)
    bad = first_bad_ray(source, 0, count)
    if bad >= 0:
        return bad
    stack = local_words()
    write_misses(found, 0, count, False)
    for i in range(count):
        best = search_carefully(tree, source, i, stack, pointer(holders), False).best
        ray, _ = ray_at(source, i)
        write_best(tree, source, found, i, best, ray.slack, largest_of(ray), make_shear(ray).direction_z, False)
    return -1
