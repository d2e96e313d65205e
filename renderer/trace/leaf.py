"""The triangles of a leaf's blocks, or of all blocks, against one ray; ``doubt`` settles the hits in doubt."""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    double_of,
    extract,
    float32_pointer,
    float64_pointer,
    get,
    int32_pointer,
    load8,
    lowest_bit,
    movemask,
    pointer,
    smaller,
    splat8,
)
from renderer.trace.intersect import hit_triangles, make_shear, room_of, round_both
from renderer.trace.layout import (
    BLOCK_COUNT,
    BLOCK_FACES,
    BLOCK_WORDS,
    BLOCKS,
    DEPTH,
    FACES,
    NODE_WORDS,
    NODES,
    SCALE,
    WIDE,
)
from renderer.trace.resolve import settled


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
    count: int  # type: ignore[assignment]  # tuples have a method of that name
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
def octants_around(tree, node, low, high):
    """The bits of the octants of a node whose boxes reach into the one from corner ``low`` to corner ``high``."""
    base, bits, room = node * NODE_WORDS, 0xFF, room_of(0.0)
    for k in range(3):
        down, up = round_both(low[k], room)[0], round_both(high[k], room)[1]
        bits &= movemask(
            (load8(tree.nodes, base + 16 * k) <= splat8(up)) & (load8(tree.nodes, base + 16 * k + 8) >= splat8(down))
        )
    return bits


NO_FACE = np.iinfo(np.int32).max
# After each run of so many blocks a search of all blocks for any hit checks whether it has one.
_BLOCKS_AT_ONCE = 16


@inlined
def nearest_in_blocks(tree, first, count, t_min, shear, best):
    """The better of ``best`` = (t, face, u, v, w) and the sure hits in ``count`` blocks: smallest t, then lowest face.

    The barycentrics are u / w and v / w; only those of the final hit are divided. Also returns whether a hit was in
    doubt. A call here that settles it would cost every ray its registers, so that is left to ``nearest_carefully``.
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
            # rule: tie-in-blocks
            if ti >= t_min and (ti < t or (ti == t and fi < face)):
                t, face, u, v, w = ti, fi, extract(u4, i), extract(v4, i), extract(w4, i)
    return t, face, u, v, w, doubtful


@kernel
def nearest_carefully(tree, first, count, ray, shear, best):
    """``nearest_in_blocks`` with the hits in doubt too, as ``settled`` makes them."""
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
            if is_better(hit[0], face, ray, best):
                best = hit[0], face, hit[1], hit[2], hit[3]
    return best


@inlined
def is_better(t, face, ray, best):
    """Whether a hit counts and is before the best one: a smaller t, or a lower face."""
    return t >= ray.t_min and (t < best[0] or (t == best[0] and face < best[1]))


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
