"""The checker of a tree: silent on every tree that is built, and loud on every fault that is put into one."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from meshes import KINDS, make_mesh, meshes, options

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CHILDREN, LEAF_BITS, NODE_WORDS, ORDERS, Tree
from renderer.tree.invariants import check_safe, faults


@pytest.mark.judges("Octree")
@settings(max_examples=200)
@given(meshes, options)
def test_every_tree_is_sound(mesh, chosen):
    octree = Octree(*mesh, **chosen)
    assert faults(octree.tree, octree.mesh) == []
    check_safe(octree.tree, len(octree.mesh.faces))


@cases("split", ["midpoint", "sah"])
@cases("kind", sorted(KINDS))
def test_larger_trees_are_sound(kind, split):
    octree = Octree(*make_mesh(kind, 1, 2000), split=split)
    assert faults(octree.tree, octree.mesh) == []
    check_safe(octree.tree, len(octree.mesh.faces))


@cases("seed", range(15))
def test_what_a_traversal_could_crash_at_is_a_fault_too(seed):
    """Links and faces are changed by little, so that some of it is found by both checks, and some by the slow one."""
    rng, broken = np.random.default_rng(seed), Broken()
    words, places = ((broken.links, broken.used), (broken.tree.faces, broken.tree.faces >= -1))[seed % 2]
    for at in rng.permutation(np.argwhere(places))[: 1 + seed // 4]:
        words[tuple(at)] += rng.integers(-9, 9)
    try:
        check_safe(broken.tree, len(broken.mesh.faces))
    except ValueError:
        with np.errstate(invalid="ignore"):
            assert broken.found()


class Broken:
    """A sound octree of several levels whose arrays may be changed, with names for their parts."""

    def __init__(self, kind="soup"):
        octree = Octree(*make_mesh(kind, 2, 301))
        self.mesh = octree.mesh
        nodes = octree.tree.nodes.copy()
        self.tree = Tree(nodes, octree.tree.blocks.copy(), octree.tree.faces.copy(), octree.tree.depth)
        self.links = self.tree.links.reshape(-1, NODE_WORDS)[:, CHILDREN : CHILDREN + 8]
        self.boxes = nodes.reshape(-1, NODE_WORDS)[:, :CHILDREN].reshape(-1, 3, 2, 8)
        self.used = self.boxes[:, 0, 0] < np.inf
        assert self.tree.depth == 4 and (~self.used).any() and (self.tree.faces < 0).any()

    def found(self):
        return faults(self.tree, self.mesh)

    def some_node(self):
        """(node, place) of a child of the root that is a node."""
        return 0, int(np.flatnonzero(self.used[0] & (self.links[0] > 0))[0])

    def some_leaf(self):
        """(node, place) of a leaf."""
        return tuple(int(i) for i in np.argwhere(self.used & (self.links < 0))[3])

    def unused_octant(self):
        return tuple(int(i) for i in np.argwhere(~self.used)[0])

    def unused_place(self):
        return int(np.flatnonzero(self.tree.faces < 0)[0])

    def corners(self, place):
        """The nine words of one place of the blocks, as indices."""
        return place // BLOCK_FACES * BLOCK_WORDS + place % BLOCK_FACES + BLOCK_FACES * np.arange(9)


def shrink(side):
    def inject(broken, at):
        for axis in range(3):
            plane = broken.boxes[at[0], axis, :, at[1]]
            plane[side] = (plane[0] + plane[1]) / 2

    return inject


def shrink_by_one_ulp(broken, at):
    plane = broken.boxes[at[0], 1, :, at[1]]
    plane[1] = np.nextafter(plane[1], plane[0])


def invert(broken, at):
    broken.boxes[at[0], 2, :, at[1]] = broken.boxes[at[0], 2, ::-1, at[1]].copy()


def nan_box(broken, at):
    broken.boxes[at[0], 0, 0, at[1]] = np.nan


def grow(broken, at):
    broken.boxes[at[0], 0, 1, at[1]] += 100


def hide(broken, at):
    broken.boxes[at[0], :, 0, at[1]], broken.boxes[at[0], :, 1, at[1]] = np.inf, -np.inf


def link_to(target):
    def inject(broken, at):
        broken.links[at] = target

    return inject


# What is put in, and what is said of it.
ON_A_CHILD = {
    "lower shrunk": (shrink(0), "reaches outside"),
    "upper shrunk": (shrink(1), "reaches outside"),
    "inverted": (invert, "octant {place}: inverted box"),
    "nan": (nan_box, "octant {place}: inverted box"),
    "hidden": (hide, "reached 0 times"),
    "to the root": (link_to(0), "node 0: reached 2 times"),
    "to no node": (link_to(10**6), "a link to node 1000000 of"),
    "to the largest number": (link_to(2**31 - 1), "a link to node 2147483647 of"),
    "to no block": (link_to(~(10**6 << LEAF_BITS)), "octant {place}: leaf of blocks 1000000 to"),
    "to the smallest number": (link_to(-(2**31)), "octant {place}: leaf of blocks 268435455 to"),
    "to the first block": (link_to(~0), "octant {place}: a face reaches outside the leaf's box"),
}


@cases("fault", ON_A_CHILD)
@cases("child", ["some_node", "some_leaf"])
def test_a_fault_in_a_child_is_found(fault, child):
    broken = Broken()
    inject, said = ON_A_CHILD[fault]
    node, place = getattr(broken, child)()
    inject(broken, (node, place))
    assert any(said.format(place=place) in found for found in broken.found())


@pytest.mark.judges("Octree")
@pytest.mark.parametrize("inject", [shrink_by_one_ulp, grow])
def test_a_fault_in_a_leaf_of_a_lower_node_is_found(inject):
    broken = Broken("soup_float32")  # whose boxes are not rounded, so that one ulp matters
    node, place = next((n, p) for n, p in np.argwhere(broken.used & (broken.links < 0)) if n > 0)
    inject(broken, (int(node), int(place)))
    assert any(f"node {node}, octant {place}" in fault for fault in broken.found())


def test_swapped_links_are_found():
    broken = Broken()
    a, b = np.argwhere(broken.used & (broken.links < 0))[[0, -1]]
    broken.links[tuple(a)], broken.links[tuple(b)] = broken.links[tuple(b)], broken.links[tuple(a)]
    assert any("outside" in fault for fault in broken.found())


def test_a_cycle_is_found_and_ends():
    broken = Broken()
    place = broken.some_node()
    inner = int(broken.links[place])
    broken.links[inner] = inner
    assert any("reached" in fault for fault in broken.found())


@pytest.mark.parametrize("change", [-1, 1, 4])
def test_a_wrong_number_of_blocks_is_found(change):
    broken = Broken()
    place = broken.some_leaf()
    code = ~int(broken.links[place])
    first, count = code >> LEAF_BITS, (code & 7) + 1
    broken.links[place] = ~((first << LEAF_BITS) | ((count - 1 + change) & 7))
    assert any("block" in fault for fault in broken.found())


def test_wrong_orders_are_found():
    broken = Broken()
    orders = broken.tree.links.reshape(-1, NODE_WORDS)[:, ORDERS : ORDERS + 8]
    first, second = orders[0, 3] & 7, orders[0, 3] >> 3 & 7
    orders[0, 3] ^= first ^ second
    assert broken.found() == ["node 0: order 3 lacks an octant"]
    with pytest.raises(ValueError, match="nodes: expected orders with all octants, got 1 that lack one"):
        check_safe(broken.tree, len(broken.mesh.faces))
    orders[0, 3] ^= (first ^ second) << 3
    assert broken.found() == ["node 0: order 3 has a near octant first"]


def test_an_understated_depth_is_found():
    broken = Broken()
    broken.tree = replace(broken.tree, depth=broken.tree.depth - 1)
    assert any("deeper" in fault for fault in broken.found())


def test_an_unused_octant_with_a_box_is_found():
    for lower, upper in ((0.0, 1.0), (1.0, 0.0), (np.inf, np.inf), (-np.inf, np.inf), (np.nan, np.nan)):
        broken = Broken()
        node, place = broken.unused_octant()
        broken.boxes[node, :, 0, place], broken.boxes[node, :, 1, place] = lower, upper
        assert broken.found()


def test_a_lost_a_doubled_and_an_unknown_face_are_found():
    faces = Broken().mesh.faces
    place = int(np.flatnonzero(Broken().tree.faces >= 0)[5])
    for value in (-1, 0, 1, len(faces), len(faces) + 7, -(2**31)):
        broken = Broken()
        if broken.tree.faces[place] == value:
            continue
        broken.tree.faces[place] = value
        assert broken.found()


@pytest.mark.parametrize("beyond", [0, 1, 1000])
def test_an_unknown_face_in_an_unused_place_is_found(beyond):
    # Every other face is in its place, so that only its own number tells.
    broken = Broken()
    broken.tree.faces[broken.unused_place()] = len(broken.mesh.faces) + beyond
    assert broken.found()


def test_a_huge_face_number_takes_no_memory():
    broken = Broken()
    broken.tree.faces[broken.unused_place()] = 10**6
    tracemalloc.start()
    try:
        assert broken.found()
        assert tracemalloc.get_traced_memory()[1] < 2 * 10**6
    finally:
        tracemalloc.stop()


def test_an_unused_place_has_the_face_that_says_so():
    broken = Broken()
    broken.tree.faces[broken.unused_place()] = -2
    assert broken.found()


@cases("word", range(9))
def test_a_changed_vertex_is_found(word):
    broken = Broken()
    place = int(np.flatnonzero(broken.tree.faces >= 0)[7])
    at = broken.corners(place)[word]
    broken.tree.blocks[at] = np.nextafter(broken.tree.blocks[at], np.inf, dtype=broken.tree.blocks.dtype)
    assert any(f"face {broken.tree.faces[place]}:" in fault for fault in broken.found())


@cases("value", [0.0, 1e3])
@cases("word", range(9))
def test_an_unused_place_that_is_not_empty_is_found(word, value):
    broken = Broken()
    place = broken.unused_place()
    broken.tree.blocks[broken.corners(place)[word]] = value
    assert any("unused" in fault for fault in broken.found())


def test_swapped_corners_are_found():
    # The same triangle, but u and v would change places.
    broken = Broken()
    words = broken.corners(int(np.flatnonzero(broken.tree.faces >= 0)[0]))
    broken.tree.blocks[words[3:6]], broken.tree.blocks[words[6:]] = (
        broken.tree.blocks[words[6:]],
        broken.tree.blocks[words[3:6]],
    )
    assert broken.found()


def test_another_mesh_is_found():
    broken = Broken()
    for other in (
        Mesh(broken.mesh.vertices, broken.mesh.faces[:-1]),
        Mesh(broken.mesh.vertices, np.concatenate([broken.mesh.faces, broken.mesh.faces[:1]])),
        Mesh(broken.mesh.vertices[::-1], broken.mesh.faces),
        Mesh([], []),
    ):
        assert faults(broken.tree, other)


@cases("seed", range(15))
def test_random_words_are_found_and_crash_nothing(seed):
    rng = np.random.default_rng(seed)
    broken = Broken()
    for _ in range(20):
        words = (broken.links, broken.tree.faces, broken.tree.links)[rng.integers(3)]
        at = tuple(rng.integers(0, size) for size in words.shape)
        words[at] = rng.integers(-9999, 9999)
    with np.errstate(invalid="ignore"):
        assert broken.found()
