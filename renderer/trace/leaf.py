"""The triangles of a leaf's blocks, or of all blocks, against one ray; ``doubt`` settles the hits in doubt."""

from typing import Any, NamedTuple

import numpy as np

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.pairs import (
    as_pairs,
    cross_pairs,
    dot_pairs,
    heads,
    minus,
    power_below,
    product,
    scaled_difference,
)
from renderer.kernels.simd import (
    double_of,
    extract,
    float32_pointer,
    float64_pointer,
    get,
    int32_pointer,
    larger,
    lowest_bit,
    pointer,
    put,
    smaller,
)
from renderer.kernels.vec3 import largest_component, scale, sub
from renderer.trace.doubt import settled
from renderer.trace.intersect import hit_triangles, make_shear
from renderer.trace.layout import (
    BLOCK_COUNT,
    BLOCK_FACES,
    BLOCK_WORDS,
    BLOCKS,
    CHILDREN,
    DEPTH,
    FACES,
    LEAF_BITS,
    MAX_LEAF_BLOCKS,
    NODE_WORDS,
    NODES,
    SCALE,
    WIDE,
)
from renderer.trace.sides import corner


class TreePointers(NamedTuple):
    """A ``Tree`` as the traversal reads it.

    ``blocks`` and ``wide_blocks`` point to the same memory: float64 where ``wide`` is 1, float32 where it is 0.
    """

    nodes: Any
    links: Any
    blocks: Any
    wide_blocks: Any
    wide: Any
    faces: Any
    count: int
    has_nodes: bool
    scale: float


@inlined
def tree_pointers(words):
    """The pointers in ``Tree.words``, whose tree the caller must keep alive."""
    at = pointer(words)
    nodes, blocks = get(at, NODES), get(at, BLOCKS)
    return TreePointers(
        float32_pointer(nodes),
        int32_pointer(nodes),
        float32_pointer(blocks),
        float64_pointer(blocks),
        get(at, WIDE),
        int32_pointer(get(at, FACES)),
        get(at, BLOCK_COUNT),
        get(at, DEPTH) > 0,
        double_of(get(at, SCALE)),
    )


@inlined
def blocks_of(leaf):
    """The first block of a leaf, and how many it has."""
    return ~leaf >> LEAF_BITS, (~leaf & (MAX_LEAF_BLOCKS - 1)) + 1


@inlined
def push_children(tree, node, bits, stack, top):
    """Let the children in the octants ``bits`` of a node wait on a stack, the last on top; returns the new top."""
    while bits != 0:
        put(stack, top, np.int64(get(tree.links, node * NODE_WORDS + CHILDREN + lowest_bit(bits))))
        bits &= bits - 1
        top += 1
    return top


NO_FACE = np.iinfo(np.int32).max
# The place of no face.
NOWHERE = -1
# Two hits are ordered with twice the digits where their t are nearer to each other than this share: 2^-46 of t is what
# a sure t errs by where the ray does not graze the face. They are equal where that leaves no more than its own
# rounding.
TIE, _EQUAL = 2.0**-44, 2.0**-90
# After each run of so many blocks a search of all blocks for any hit checks whether it has one.
_BLOCKS_AT_ONCE = 16


@inlined
def nearest_in_blocks(tree, first, count, t_min, shear, best):
    """The better of ``best`` = (t, face, u, v, w) and the sure hits in ``count`` blocks: smallest t, then lowest face.

    The barycentrics are u / w and v / w; only those of the final hit are divided. Also returns whether a hit was in
    doubt, or so near to another that rounding may have ordered the two. A call here that settles it would cost every
    ray its registers, so that is left to ``nearest_carefully``.
    """
    t, face, u, v, w = best
    doubtful = np.int64(0)
    for block in range(first, first + count):
        bits, doubts, _, due, t4, u4, v4, w4 = hit_triangles(tree, block * BLOCK_WORDS, shear, t_min, t)
        doubtful |= due
        bits &= ~doubts
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            ti = extract(t4, i)
            fi = get(tree.faces, block * BLOCK_FACES + i)
            doubtful |= np.int64(face != NO_FACE and ti >= t_min and abs(ti - t) <= ti * TIE)
            if ti >= t_min and (ti < t or (ti == t and fi < face)):
                t, face, u, v, w = ti, fi, extract(u4, i), extract(v4, i), extract(w4, i)
    return t, face, u, v, w, doubtful


@kernel
def nearest_carefully(tree, first, count, ray, shear, best):
    """``nearest_in_blocks`` with the hits in doubt too, as ``settled`` makes them."""
    return nearest_placed(tree, first, count, ray, shear, best, NOWHERE)[0]


@kernel
def nearest_placed(tree, first, count, ray, shear, best, place):
    """``nearest_carefully`` of a best hit whose place in the blocks is known; returns both anew."""
    for block in range(first, first + count):
        base = block * BLOCK_WORDS
        bits, doubts, blurred, _, t4, u4, v4, w4 = hit_triangles(tree, base, shear, ray.t_min, best[0])
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            face = get(tree.faces, block * BLOCK_FACES + i)
            hit = extract(t4, i), extract(u4, i), extract(v4, i), extract(w4, i)
            if (doubts >> i) & 1 != 0:
                hit = settled(tree, base + i, ray, shear, hit, (blurred >> i) & 1 != 0)
            if is_better(tree, ray, hit[0], face, base + i, best, place):
                best, place = (hit[0], face, hit[1], hit[2], hit[3]), base + i
    return best, place


@inlined
def is_better(tree, ray, t, face, place, best, best_place):
    """Whether a hit counts and is before the best one: a smaller t, or a lower face."""
    if not t >= ray.t_min:
        return False
    if best_place != NOWHERE and t != best[0] and abs(t - best[0]) <= t * TIE:
        return is_before(tree, ray, place, face, best_place, best[1])
    return t < best[0] or (t == best[0] and face < best[1])


@kernel
def is_before(tree, ray, place, face, other_place, other):
    """Whether a ray meets the plane of one face before that of another, with twice the digits, or at once and it is the
    lower one.
    """
    o, d = (ray.ox, ray.oy, ray.oz), (ray.dx, ray.dy, ray.dz)
    unit = 1.0 / power_below(largest_component(d))
    height, slope, size = _plane(tree, place, o, scale(d, unit))
    other_height, other_slope, other_size = _plane(tree, other_place, o, scale(d, unit))
    # Of t the slopes are the denominators: where their signs differ the order turns round.
    apart = minus(product(height, other_slope), product(other_height, slope))[0]
    if abs(apart) <= _EQUAL * (size * abs(other_slope[0]) + other_size * abs(slope[0])):
        return face < other
    return apart < 0.0 if (slope[0] > 0.0) == (other_slope[0] > 0.0) else apart > 0.0


@kernel
def _plane(tree, place, o, d):
    """normal . (p0 - o) and normal . d of the face at a place, as pairs in a unit of its own; and the first's size."""
    p0, p1, p2 = corner(tree, place), corner(tree, place + 12), corner(tree, place + 24)
    side = 1.0 / power_below(larger(largest_component(sub(p1, p0)), largest_component(sub(p2, p0))))
    normal = cross_pairs(scaled_difference(p1, p0, side), scaled_difference(p2, p0, side))
    size = largest_component(heads(normal)) * largest_component(sub(p0, o))
    return dot_pairs(normal, scaled_difference(p0, o, 1.0)), dot_pairs(normal, as_pairs(d)), size


@kernel
def search_all_blocks(tree, ray, t_max, any_hit):
    """The best hit (t, face, u, v, w) over all blocks, and whether one was in doubt; with ``any_hit`` it may be any
    hit.
    """
    shear, best, doubtful = make_shear(ray), (t_max, np.int32(NO_FACE), 0.0, 0.0, 1.0), np.int64(0)
    for first in range(0, tree.count, _BLOCKS_AT_ONCE):
        count = smaller(_BLOCKS_AT_ONCE, tree.count - first)
        t, face, u, v, w, doubts = nearest_in_blocks(tree, first, count, ray.t_min, shear, best)
        best = t, face, u, v, w
        doubtful |= doubts
        if any_hit and face != NO_FACE:
            return best, False
    return best, doubtful != 0
