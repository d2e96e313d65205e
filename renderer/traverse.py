"""Closest and any hit of one ray, through the tree or over every block.

All of them share ``nearest_in_blocks`` and its triangle test, so they cannot disagree on what a hit is.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.intersect import (
    box_limit,
    enter_boxes,
    hit_triangles,
    make_shear,
    make_slabs,
    meets_face_box,
    round_down,
)
from renderer.jit import inlined, kernel
from renderer.layout import BLOCK_WORDS, CHILDREN, LANES, LEAF_BITS, MAX_LEAF_BLOCKS, NODE_WORDS
from renderer.simd import bits_float, float_bits, get, lane, lowest_bit, pointer, put, splat8


class View(NamedTuple):
    """A ``Tree`` as the traversal reads it: pointers, and the number of blocks."""

    nodes: Any
    links: Any
    blocks: Any
    faces: Any
    count: int


@inlined
def view(tree):
    """Pointers into a tree, which the caller must keep alive."""
    return View(
        pointer(tree.nodes), pointer(tree.links), pointer(tree.blocks), pointer(tree.faces), len(tree.faces) // LANES
    )


NO_FACE = np.iinfo(np.int32).max
_LOW_WORD = 0xFFFFFFFF


@inlined
def nearest_in_blocks(tree, first, count, t_min, shear, best):
    """The better of ``best`` = (t, face, u, v) and the sure hits in ``count`` blocks: smallest t, then lowest face.

    Also returns whether a hit was in doubt. A call to settle it here would cost every ray its registers, so it is left
    to ``_closest_carefully``.
    """
    t, face, u, v = best
    doubtful = np.int64(0)
    for block in range(first, first + count):
        bits, doubts, t4, u4, v4, w4 = hit_triangles(tree.blocks, block * BLOCK_WORDS, shear)
        doubtful |= doubts
        bits &= ~doubts
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            ti = lane(t4, i)
            fi = get(tree.faces, block * LANES + i)
            if ti >= t_min and (ti < t or (ti == t and fi < face)):
                t, face, u, v = ti, fi, lane(u4, i) / lane(w4, i), lane(v4, i) / lane(w4, i)
    return t, face, u, v, doubtful


@kernel
def _nearest_carefully(tree, first, count, ray, shear, best):
    """``nearest_in_blocks`` with the hits in doubt that the boxes of their own faces confirm."""
    t, face, u, v = best
    for block in range(first, first + count):
        base = block * BLOCK_WORDS
        bits, doubts, t4, u4, v4, w4 = hit_triangles(tree.blocks, base, shear)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            ti = lane(t4, i)
            fi = get(tree.faces, block * LANES + i)
            better = ti >= ray.t_min and (ti < t or (ti == t and fi < face))
            if better and ((doubts >> i) & 1 == 0 or meets_face_box(tree.blocks, base + i, ray, ti)):
                t, face, u, v = ti, fi, lane(u4, i) / lane(w4, i), lane(v4, i) / lane(w4, i)
    return t, face, u, v


@kernel
def _closest_carefully(tree, ray, t_max, stack):
    """The closest hit with every doubt settled; in no order, because it is needed for few rays."""
    largest = max(abs(ray.dx), abs(ray.dy), abs(ray.dz))
    slabs, shear = make_slabs(ray, largest), make_shear(ray)
    lower = splat8(round_down(ray.t_min * largest))
    best = (t_max, np.int32(NO_FACE), 0.0, 0.0)
    top = 1
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            code = ~child
            best = _nearest_carefully(
                tree, code >> LEAF_BITS, (code & (MAX_LEAF_BLOCKS - 1)) + 1, ray, shear, best
            )
            continue
        _, bits = enter_boxes(tree.nodes, child, slabs, lower, splat8(box_limit(best[0], largest)))
        while bits != 0:
            put(stack, top, np.int64(get(tree.links, child * NODE_WORDS + CHILDREN + lowest_bit(bits))))
            bits &= bits - 1
            top += 1
    return best


@inlined
def _entry(tree, base, place, t0):
    """An octant as it waits on the stack: the bits of its float32 distance above its child."""
    return (float_bits(lane(t0, place)) << 32) | (np.int64(get(tree.links, base + place)) & _LOW_WORD)


@kernel
def push_octants(tree, base, t0, bits, stack, top):
    """Push the octants in ``bits`` of the node whose children begin at ``base``, nearest last."""
    bottom = top
    while bits != 0:
        entry = _entry(tree, base, lowest_bit(bits), t0)
        bits &= bits - 1
        at = top
        while at > bottom and get(stack, at - 1) < entry:
            put(stack, at, get(stack, at - 1))
            at -= 1
        put(stack, at, entry)
        top += 1
    return top


@kernel
def closest_hit(tree, ray, t_max, stack):
    """Closest hit of one ray: (t, face, u, v), with face = NO_FACE and t = t_max on a miss.

    The interval [t_min, t_max] is closed; t counts in units of |direction|; no face is culled. Among equal t the
    lowest face wins: a node is left behind only when its entry is beyond the best t, never at it, so the answer does
    not depend on the order of the visits. ``stack`` is int64 scratch of 7 * depth + 8 entries: each level leaves at
    most seven octants waiting. Watertight and deterministic (Woop et al. 2013); see ``intersect`` for the bounds.
    """
    t, face, u, v, doubtful = _closest_surely(tree, ray, t_max, stack)
    if doubtful != 0:
        return _closest_carefully(tree, ray, t_max, stack)
    return t, face, u, v


@kernel
def _closest_surely(tree, ray, t_max, stack):
    """The closest hit that is in no doubt, and whether there was any doubt."""
    largest = max(abs(ray.dx), abs(ray.dy), abs(ray.dz))
    slabs, shear = make_slabs(ray, largest), make_shear(ray)
    t, face, u, v, doubtful = t_max, np.int32(NO_FACE), 0.0, 0.0, np.int64(0)
    lower = splat8(round_down(ray.t_min * largest))
    limit = box_limit(t_max, largest)
    top = 0
    child = np.int64(0)
    while True:
        if child >= 0:
            # Enter the node: go on with its nearest octant, leave the others on the stack.
            t0, bits = enter_boxes(tree.nodes, child, slabs, lower, splat8(limit))
            if bits != 0:
                # One octant: go on there. Two, the usual case: order them without a branch. More: sort them all.
                base = child * NODE_WORDS + CHILDREN
                first = lowest_bit(bits)
                others = bits & (bits - 1)
                if others == 0:
                    child = np.int64(get(tree.links, base + first))
                    continue
                if others & (others - 1) == 0:
                    a, b = _entry(tree, base, first, t0), _entry(tree, base, lowest_bit(others), t0)
                    put(stack, top, max(a, b))
                    top += 1
                    child = np.int64(np.int32(min(a, b) & _LOW_WORD))
                    continue
                top = push_octants(tree, base, t0, bits, stack, top)
        else:
            # Test the leaf's blocks.
            code = ~child
            before = t
            t, face, u, v, doubts = nearest_in_blocks(
                tree, code >> LEAF_BITS, (code & (MAX_LEAF_BLOCKS - 1)) + 1, ray.t_min, shear, (t, face, u, v)
            )
            doubtful |= doubts
            if t < before:
                limit = box_limit(t, largest)
        # Take the next octant that is not beyond the best hit.
        while top > 0:
            top -= 1
            if bits_float(get(stack, top) >> 32) <= limit:
                break
        else:
            return t, face, u, v, doubtful
        child = np.int64(np.int32(get(stack, top) & _LOW_WORD))


@kernel
def any_hit(tree, ray, t_max, stack):
    """Whether anything lies within [t_min, t_max] of one ray: the same test, in no order, ended by the first hit."""
    found, doubtful = _any_surely(tree, ray, t_max, stack)
    if not found and doubtful != 0:
        return _closest_carefully(tree, ray, t_max, stack)[1] != NO_FACE
    return found


@kernel
def _any_surely(tree, ray, t_max, stack):
    """Whether there is a hit in no doubt, and whether there was any doubt before."""
    largest = max(abs(ray.dx), abs(ray.dy), abs(ray.dz))
    slabs, shear = make_slabs(ray, largest), make_shear(ray)
    lower, upper = splat8(round_down(ray.t_min * largest)), splat8(box_limit(t_max, largest))
    doubtful = np.int64(0)
    top = 1
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            code = ~child
            found, doubts = any_in_blocks(
                tree, code >> LEAF_BITS, (code & (MAX_LEAF_BLOCKS - 1)) + 1, ray.t_min, t_max, shear
            )
            if found:
                return True, doubtful
            doubtful |= doubts
            continue
        _, bits = enter_boxes(tree.nodes, child, slabs, lower, upper)
        while bits != 0:
            put(stack, top, np.int64(get(tree.links, child * NODE_WORDS + CHILDREN + lowest_bit(bits))))
            bits &= bits - 1
            top += 1
    return False, doubtful


@inlined
def any_in_blocks(tree, first, count, t_min, t_max, shear):
    """Whether a triangle of ``count`` blocks from ``first`` is surely hit within [t_min, t_max]; any doubts."""
    doubtful = np.int64(0)
    for block in range(first, first + count):
        bits, doubts, t4, _, _, _ = hit_triangles(tree.blocks, block * BLOCK_WORDS, shear)
        doubtful |= doubts
        bits &= ~doubts
        while bits != 0:
            ti = lane(t4, lowest_bit(bits))
            bits &= bits - 1
            if t_min <= ti <= t_max:
                return True, doubtful
    return False, doubtful


@kernel
def closest_hit_brute(tree, ray, t_max, stack):
    """``closest_hit`` over every block; the nodes and the stack are not read."""
    shear, miss, count = make_shear(ray), (t_max, np.int32(NO_FACE), 0.0, 0.0), tree.count
    t, face, u, v, doubtful = nearest_in_blocks(tree, 0, count, ray.t_min, shear, miss)
    if doubtful != 0:
        return _nearest_carefully(tree, 0, count, ray, shear, miss)
    return t, face, u, v


@kernel
def any_hit_brute(tree, ray, t_max, stack):
    """``any_hit`` over every block; the nodes and the stack are not read."""
    shear, count = make_shear(ray), tree.count
    found, doubtful = any_in_blocks(tree, 0, count, ray.t_min, t_max, shear)
    if not found and doubtful != 0:
        miss = (t_max, np.int32(NO_FACE), 0.0, 0.0)
        return _nearest_carefully(tree, 0, count, ray, shear, miss)[1] != NO_FACE
    return found
