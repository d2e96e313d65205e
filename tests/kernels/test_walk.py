"""What a walk through a tree puts onto its stack."""

import numpy as np
from cases import cases

from renderer import Octree
from renderer.jit.decorators import kernel
from renderer.mesh.shapes import icosphere
from renderer.numerics.simd import pointer
from renderer.trace.layout import CHILDREN
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import push_in_order, stack_size

TREE = Octree(icosphere(3)).tree
GUARD = -(1 << 40)


@kernel
def _push(descriptor, bits, order, stack, top):
    return push_in_order(tree_pointers(descriptor), np.int64(0), bits, np.int32(order), pointer(stack), top)


@cases("bits", [0, 1, 0x80, 0b1010_0110, 0xFF])
def test_octants_are_pushed_in_their_order_and_within_the_stack(bits):
    order = [3, 0, 7, 5, 1, 6, 2, 4]
    # The most that wait where a node of the lowest level is entered.
    top, stack = 7 * (TREE.depth - 1), np.full(stack_size(TREE.depth) + 64, GUARD)
    found = _push(TREE.descriptor, bits, sum(k << 3 * i for i, k in enumerate(order)), stack, top)
    expected = [int(TREE.links[CHILDREN + k]) for k in order if bits >> k & 1]
    assert stack[top:found].tolist() == expected
    assert (stack[:top] == GUARD).all() and (stack[stack_size(TREE.depth) :] == GUARD).all()
