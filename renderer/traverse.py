"""Closest and any hit of one ray, through the tree or over every block.

All of them share ``nearest_in_blocks`` and its triangle test, so they cannot disagree on what a hit is.
"""

import numpy as np

from renderer.intersect import FAR_PADDING, enter_boxes, hit_triangles, make_shear, make_slabs, round_down, round_up
from renderer.jit import kernel
from renderer.layout import BLOCK_WORDS, CHILDREN, LANES, LEAF_BITS, MAX_LEAF_BLOCKS, NODE_WORDS
from renderer.simd import bits_float, float_bits, lane, lowest_bit, splat8

NO_FACE = np.iinfo(np.int32).max
_LOW_WORD = 0xFFFFFFFF


@kernel
def nearest_in_blocks(tree, first, count, shear, t_min, t, face, u, v):
    """The best of a hit so far and of ``count`` blocks from ``first``: smallest t, then lowest face."""
    for block in range(first, first + count):
        bits, t4, u4, v4 = hit_triangles(tree.blocks, block * BLOCK_WORDS, shear)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            ti = lane(t4, i)
            fi = tree.faces[block * LANES + i]
            if ti >= t_min and (ti < t or (ti == t and fi < face)):
                t, face, u, v = ti, fi, lane(u4, i), lane(v4, i)
    return t, face, u, v


@kernel
def push_octants(tree, node, t0, bits, stack, top):
    """Push the octants in ``bits``, nearest last. An entry is the bits of its float32 distance above its child."""
    bottom = top
    base = node * NODE_WORDS + CHILDREN
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        entry = (float_bits(lane(t0, i)) << 32) | (np.int64(tree.links[base + i]) & _LOW_WORD)
        at = top
        while at > bottom and stack[at - 1] < entry:
            stack[at] = stack[at - 1]
            at -= 1
        stack[at] = entry
        top += 1
    return top


@kernel
def closest_hit(tree, ox, oy, oz, dx, dy, dz, t_min, t_max, stack):
    """Closest hit of one ray: (t, face, u, v), with face = NO_FACE and t = t_max on a miss.

    The interval [t_min, t_max] is closed; t counts in units of |direction|; no face is culled. Among equal t the
    lowest face wins: a node is left behind only when its entry is beyond the best t, never at it, so the answer does
    not depend on the order of the visits. ``stack`` is int64 scratch of 7 * depth + 8 entries: each level leaves at
    most seven octants waiting. Watertight and deterministic (Woop et al. 2013); see ``intersect`` for the bounds.
    """
    largest = max(abs(dx), abs(dy), abs(dz))
    slabs = make_slabs(ox, oy, oz, dx, dy, dz, largest)
    shear = make_shear(ox, oy, oz, dx, dy, dz)
    t, face, u, v = t_max, np.int32(NO_FACE), 0.0, 0.0
    lower = splat8(round_down(t_min * largest))
    limit = round_up(t_max * largest) * FAR_PADDING
    top = 0
    child = np.int64(0)
    while True:
        if child >= 0:
            # Enter the node: go on with its nearest octant, leave the others on the stack.
            t0, bits = enter_boxes(tree.nodes, child, slabs, lower, splat8(limit))
            if bits != 0:
                if bits & (bits - 1) == 0:
                    child = np.int64(tree.links[child * NODE_WORDS + CHILDREN + lowest_bit(bits)])
                    continue
                top = push_octants(tree, child, t0, bits, stack, top)
        else:
            # Test the leaf's blocks.
            code = ~child
            before = t
            t, face, u, v = nearest_in_blocks(
                tree, code >> LEAF_BITS, (code & (MAX_LEAF_BLOCKS - 1)) + 1, shear, t_min, t, face, u, v
            )
            if t < before:
                limit = round_up(t * largest) * FAR_PADDING
        # Take the next octant that is not beyond the best hit.
        while top > 0:
            top -= 1
            if bits_float(stack[top] >> 32) <= limit:
                break
        else:
            return t, face, u, v
        child = np.int64(np.int32(stack[top] & _LOW_WORD))


@kernel
def any_hit(tree, ox, oy, oz, dx, dy, dz, t_min, t_max, stack):
    """Whether anything lies within [t_min, t_max] of one ray: the same test, in no order, ended by the first hit."""
    largest = max(abs(dx), abs(dy), abs(dz))
    slabs = make_slabs(ox, oy, oz, dx, dy, dz, largest)
    shear = make_shear(ox, oy, oz, dx, dy, dz)
    lower = splat8(round_down(t_min * largest))
    upper = splat8(round_up(t_max * largest) * FAR_PADDING)
    top = 1
    stack[0] = 0
    while top > 0:
        top -= 1
        child = stack[top]
        if child < 0:
            code = ~child
            if any_in_blocks(tree, code >> LEAF_BITS, (code & (MAX_LEAF_BLOCKS - 1)) + 1, shear, t_min, t_max):
                return True
            continue
        _, bits = enter_boxes(tree.nodes, child, slabs, lower, upper)
        while bits != 0:
            stack[top] = tree.links[child * NODE_WORDS + CHILDREN + lowest_bit(bits)]
            bits &= bits - 1
            top += 1
    return False


@kernel
def any_in_blocks(tree, first, count, shear, t_min, t_max):
    """Whether a triangle of ``count`` blocks from ``first`` is hit within [t_min, t_max]."""
    for block in range(first, first + count):
        bits, t4, _, _ = hit_triangles(tree.blocks, block * BLOCK_WORDS, shear)
        while bits != 0:
            ti = lane(t4, lowest_bit(bits))
            bits &= bits - 1
            if t_min <= ti <= t_max:
                return True
    return False


@kernel
def closest_hit_brute(tree, ox, oy, oz, dx, dy, dz, t_min, t_max, stack):
    """``closest_hit`` over every block; the nodes and the stack are not read."""
    shear = make_shear(ox, oy, oz, dx, dy, dz)
    count = len(tree.faces) // LANES
    return nearest_in_blocks(tree, 0, count, shear, t_min, t_max, np.int32(NO_FACE), 0.0, 0.0)


@kernel
def any_hit_brute(tree, ox, oy, oz, dx, dy, dz, t_min, t_max, stack):
    """``any_hit`` over every block; the nodes and the stack are not read."""
    return any_in_blocks(tree, 0, len(tree.faces) // LANES, make_shear(ox, oy, oz, dx, dy, dz), t_min, t_max)
