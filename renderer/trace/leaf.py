"""The triangles of a leaf's blocks, or of all blocks, against one ray."""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    extract,
    load8,
    lowest_bit,
    minimum,
    movemask,
    splat8,
)
from renderer.trace.best import NO_FACE, Best, hit_on, is_better, no_hit
from renderer.trace.intersect import bits_within, face_in, hit_in, hit_triangles, make_shear, room_of, round_both
from renderer.trace.layout import (
    BLOCK_FACES,
    BLOCK_WORDS,
)
from renderer.trace.resolve import resolve_uncertain
from renderer.trace.walk import boxes_of


@inlined
def octants_around(tree, node, low, high):
    """The bits of the octants of a node whose boxes overlap the box from ``low`` to ``high``."""
    (nodes, base), bits, room = boxes_of(tree, node), 0xFF, room_of(0.0)
    for k in range(3):
        down, up = round_both(low[k], room)[0], round_both(high[k], room)[1]
        bits &= movemask(
            (load8(nodes, base + 16 * k) <= splat8(up)) & (load8(nodes, base + 16 * k + 8) >= splat8(down))
        )
    return bits


# After each run of so many blocks a search of all blocks for any hit checks whether it has one.
_BLOCKS_AT_ONCE = 16


@inlined
def nearest_in_blocks(tree, first, count, t_min, shear, best):
    """The better of ``best`` and the certain hits in ``count`` blocks, and whether an uncertain hit must be resolved.

    Resolving it here would cost every ray registers; ``nearest_carefully`` does it.
    """
    t, face, u, v, w = best.t, best.face, best.u, best.v, best.w
    unresolved = np.int64(0)
    for block in range(first, first + count):
        hits = hit_triangles(tree, block * BLOCK_WORDS, shear, t_min, t)
        unresolved |= hits.must_resolve
        bits = hits.bits & ~hits.uncertain
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            ti, wi = extract(hits.t, i), extract(hits.w, i)
            fi = face_in(tree, block * BLOCK_FACES + i)
            # rule: tie-in-blocks
            nearer = ti >= t_min and (ti < t or (ti == t and fi < face))
            if nearer and tree.ways.admits(tree, wi, shear.direction_z):
                t, face, u, v, w = ti, fi, extract(hits.u, i), extract(hits.v, i), wi
    return Best(t, face, u, v, w), unresolved != 0


@inlined
def any_in_blocks(tree, first, count, t_min, t_max, shear):
    """Whether there is a certain hit in ``count`` blocks, and whether an uncertain one must be resolved."""
    unresolved = np.int64(0)
    for block in range(first, first + count):
        hits = hit_triangles(tree, block * BLOCK_WORDS, shear, t_min, t_max)
        unresolved |= hits.must_resolve
        bits = hits.bits & ~hits.uncertain & bits_within(hits.t, t_min, t_max)
        if is_any_admitted(tree, bits, hits.w, shear.direction_z):
            return True, unresolved != 0
    return False, unresolved != 0


@inlined
def is_any_admitted(tree, bits, w, dz):
    """Whether any of the hits ``bits`` of a block counts, given the w of its four faces and the ray's direction_z."""
    while bits != 0:
        if tree.ways.admits(tree, extract(w, lowest_bit(bits)), dz):
            return True
        bits &= bits - 1
    return False


@kernel
def nearest_carefully(tree, first, count, ray, shear, best):
    """``nearest_in_blocks`` with uncertain hits resolved by ``resolve_uncertain``."""
    for block in range(first, first + count):
        hits = hit_triangles(tree, block * BLOCK_WORDS, shear, ray.t_min, best.t)
        bits = hits.bits
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            face, hit = face_in(tree, block * BLOCK_FACES + i), resolved_hit(tree, block, hits, i, ray, shear)
            if is_better(hit.t, face, ray.t_min, best) and tree.ways.admits(tree, hit.w, shear.direction_z):
                best = hit_on(face, hit)
    return best


@inlined
def resolved_hit(tree, block, hits, i, ray, shear):
    """The i-th of the ``BlockHits`` of a block, resolved where it is uncertain."""
    hit = hit_in(hits, i)
    if (hits.uncertain >> i) & 1 != 0:
        determinant_uncertain = (hits.determinant_uncertain >> i) & 1 != 0
        hit = resolve_uncertain(tree, block * BLOCK_WORDS + i, ray, shear, hit, determinant_uncertain)
    return hit


@kernel
def search_all_blocks(tree, ray, t_max, any_hit):
    """The best hit over all blocks, or with ``any_hit`` any hit; and whether an uncertain one must be resolved."""
    shear, best, unresolved = make_shear(ray), no_hit(t_max), False
    for first in range(0, tree.count, _BLOCKS_AT_ONCE):
        count = minimum(_BLOCKS_AT_ONCE, tree.count - first)
        best, some = nearest_in_blocks(tree, first, count, ray.t_min, shear, best)
        unresolved = unresolved or some
        if any_hit and best.face != NO_FACE:
            return best, False
    return best, unresolved
