"""The build: the same tree for any number of threads, parts that are what they say, and the cheapest collapse."""

import tracemalloc
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st
from meshes import KINDS, arrays, make_mesh

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere, torus
from renderer.octree import Octree
from renderer.trace.layout import BLOCK_FACES
from renderer.tree.bounds import BOX, FACE, Faces, face_boxes
from renderer.tree.build import SPLITS, boxes_of_faces, build_parts, build_tree
from renderer.tree.collapse import BLOCK_COST, NODE_COST, collapse
from renderer.tree.hierarchy import Rule, add_part, first_parts, new_hierarchy
from renderer.tree.invariants import faults
from renderer.tree.subtree import cut_once, new_cut_scratch

pytestmark = pytest.mark.judges("Octree")


SPLIT = pytest.mark.parametrize("split", sorted(SPLITS))
# Several subtrees and a top of several levels, which begin beyond 8192 faces.
MANY = 30_000


@SPLIT
@pytest.mark.parametrize("kind", ["soup", "sizes", "duplicates"])
def test_the_tree_does_not_depend_on_the_threads(kind, split):
    mesh = Mesh(*make_mesh(kind, 5, MANY))
    rule = Rule(SPLITS[split], 4, 32)
    expected = build_tree(mesh.vertices, mesh.faces, rule, threads=1)
    assert faults(expected, mesh) == []
    for threads in (2, 3, 7):
        tree = build_tree(mesh.vertices, mesh.faces, rule, threads=threads)
        assert tree.depth == expected.depth
        for a, b in zip(arrays(tree), arrays(expected), strict=True):
            assert a.dtype == b.dtype and a.tobytes() == b.tobytes()


@SPLIT
@pytest.mark.parametrize("max_depth", [1, 32])
def test_faces_that_nothing_separates_are_shared_out(split, max_depth):
    # All centres are one point, in boxes of two sizes.
    corners = np.tile([[[0.0, 0, 0], [1, 0, 0], [0, 1, 1]]], (10_000, 1, 1)) - [0.5, 0.5, 0.5]
    corners[::3] *= 2
    octree = Octree(corners.reshape(-1, 3), np.arange(30_000).reshape(-1, 3), split=split, max_depth=max_depth)
    assert faults(octree.tree, octree.mesh) == []
    assert octree.stats.depth <= 8 and octree.stats.fill > 0.5


@SPLIT
def test_one_far_face_at_a_time_ends(split):
    # Each cut at a midpoint takes off one face of a geometric row: the worst shape for the top.
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]) * 2.0 ** -(np.arange(9000) % 100 / 1.0)[:, None, None]
    corners[:, :, 2] += 2.0 ** -(np.arange(9000) % 100 / 1.0)[:, None]
    octree = Octree(corners.reshape(-1, 3), np.arange(27_000).reshape(-1, 3), split=split, threads=2)
    assert faults(octree.tree, octree.mesh) == []


def cut(kind, seed, count, split):
    """``cut_of`` a mesh of some kind."""
    return cut_of(Mesh(*make_mesh(kind, seed, count)), split)


def cut_of(mesh, split):
    """The faces (sorted by the cut), their boxes as (F, 2, 3) in the mesh's order, and the parts of one cut."""
    count = len(mesh.faces)
    boxes = np.empty(count * BOX, np.float32)
    order = Faces(boxes, boxes.view(np.int32), np.empty_like(boxes))
    face_boxes(mesh.vertices, mesh.faces, boxes, order.numbers, 0, count)
    own = boxes.reshape(-1, 2, 4)[:, :, :3].copy()
    own[:, 1] *= -1
    tree = new_hierarchy(15)
    add_part(tree, 0, 0, count)
    tree.boxes[:BOX] = boxes.reshape(-1, BOX).min(axis=0)
    parts, _ = cut_once(order, tree, Rule(SPLITS[split], 4, 32), 0, new_cut_scratch())
    return order.numbers.reshape(-1, BOX)[:, FACE], own, first_parts(tree, parts)


@SPLIT
@pytest.mark.parametrize("kind", sorted(KINDS))
@pytest.mark.parametrize("count", [5, 33, 200])
def test_a_cut_sorts_the_faces_into_parts_with_fitted_boxes(kind, split, count):
    numbers, own, tree = cut(kind, 3, count, split)
    assert sorted(numbers) == list(range(count))
    assert len(tree.halves) >= 3
    for part, (begin, end) in enumerate(tree.ranges):
        lower, upper = own[numbers[begin:end], 0].min(axis=0), own[numbers[begin:end], 1].max(axis=0)
        box = tree.boxes[part * BOX : (part + 1) * BOX]
        np.testing.assert_array_equal(box[:3], lower)
        np.testing.assert_array_equal(-box[4:7], upper)
        if tree.halves[part] >= 0:
            first, second = tree.ranges[tree.halves[part] : tree.halves[part] + 2]
            assert first[0] == begin < first[1] == second[0] < second[1] == end


@pytest.mark.parametrize("kind", ["soup", "soup_float32", "sizes"])
def test_octants_lie_on_their_sides_of_the_middle(kind):
    numbers, own, tree = cut(kind, 4, 300, "midpoint")
    above = own.sum(axis=1) > own[:, 0].min(axis=0) + own[:, 1].max(axis=0)
    whole = [tree.ranges[part] for part in np.flatnonzero(tree.halves < 0)]
    sides = [{tuple(side) for side in above[numbers[begin:end]]} for begin, end in whole]
    # A part of several octants has no more faces than a block.
    assert all(len(found) == 1 or end - begin <= BLOCK_FACES for found, (begin, end) in zip(sides, whole, strict=True))
    assert len(whole) == 8


@cases(("extent", "octants"), [((9, 5, 5), 8), ((5, 9, 4), 4), ((2, 4, 9), 2), ((9, 4, 5), 4)])
def test_flat_parts_are_not_cut_across(extent, octants):
    """An axis less than half as long as the longest: its cuts fall to the cells within."""
    rng = np.random.default_rng(1)
    corners = rng.uniform(0.0, 1.0, (400, 1, 3)) * extent + rng.uniform(-0.05, 0.05, (400, 3, 3))
    numbers, own, tree = cut_of(Mesh(corners.reshape(-1, 3), np.arange(1200).reshape(-1, 3)), "midpoint")
    assert (tree.halves < 0).sum() == octants and len(numbers) == 400 and own.shape == (400, 2, 3)


@cases("kind", ["soup", "soup_float32", "sizes", "lattice"])
def test_the_last_few_faces_are_cut_by_the_heuristic_under_either_rule(kind):
    """Of 32 faces the first cut is the same, of 33 it is not."""
    for count, same in ((8, True), (32, True), (33, False)):
        (first, _, one), (second, _, other) = (cut(kind, 5, count, split) for split in ("midpoint", "sah"))
        alike = np.array_equal(first, second) and np.array_equal(one.ranges, other.ranges)
        assert alike == same


@cases("seed", range(5))
def test_the_sah_cut_is_as_cheap_as_the_best_of_its_planes(seed):
    count = 200
    numbers, own, tree = cut("soup", seed, count, "sah")

    def cost(faces):
        x, y, z = own[faces, 1].max(axis=0) - own[faces, 0].min(axis=0)
        return (x * y + y * z + z * x) * -(-len(faces) // BLOCK_FACES)

    found = sum(cost(numbers[begin:end]) for begin, end in tree.ranges[1:3])
    centres = own.sum(axis=1)
    planes = []
    for axis in range(3):
        low, high = centres[:, axis].min(), centres[:, axis].max()
        for plane in np.linspace(low, high, 17)[1:-1]:
            left = centres[:, axis] < plane
            if left.any() and not left.all():
                planes.append(cost(np.flatnonzero(left)) + cost(np.flatnonzero(~left)))
    # Where a centre lies within rounding of a plane it may fall on either side.
    assert found == pytest.approx(min(planes), rel=1e-2)


def cheapest(tree, leaf_size):
    """The least cost of part 0 as one child, by trying every way to cut every part."""

    @cache
    def forest(part, children):
        if children == 1:
            return single(part)
        ways = [forest(part, children - 1)]
        first = int(tree.halves[part])
        if first >= 0:
            ways += [forest(first, k) + forest(first + 1, children - k) for k in range(1, children)]
        return min(ways)

    @cache
    def single(part):
        box = tree.boxes[part * BOX : (part + 1) * BOX].astype(float)
        x, y, z = -box[4:7] - box[:3]
        area = x * y + y * z + z * x
        size = int(tree.ranges[part, 1] - tree.ranges[part, 0])
        ways = []
        first = int(tree.halves[part])
        if size <= leaf_size or first < 0:
            ways.append(area * float(BLOCK_COST) * -(-size // BLOCK_FACES))
        if first >= 0:
            ways.append(area * float(NODE_COST) + min(forest(first, k) + forest(first + 1, 8 - k) for k in range(1, 8)))
        return min(ways)

    return single(0)


@st.composite
def hierarchies(draw):
    """A random binary tree of parts with random nested boxes."""
    rng = np.random.default_rng(draw(st.integers(0, 2**20)))
    leaves = draw(st.integers(1, 40))
    tree = new_hierarchy(2 * leaves - 1)
    sizes = np.zeros(2 * leaves - 1, int)
    add_part(tree, 0, 0, 0)
    tree.boxes[:BOX] = [0, 0, 0, 0, *-rng.uniform(1, 2, 3), 0]
    count = 1
    while count < 2 * leaves - 1:
        part = rng.choice(np.flatnonzero(tree.halves[:count] < 0))
        tree.halves[part] = count
        for child in (count, count + 1):
            add_part(tree, child, 0, 0)
            box = tree.boxes[part * BOX : (part + 1) * BOX].copy()
            box[4 + rng.integers(3)] *= rng.uniform(0.2, 1.0)
            tree.boxes[child * BOX : (child + 1) * BOX] = box
        count += 2
    # Sizes from the leaves up; the ranges need not be disjoint for a cost.
    for part in range(count - 1, -1, -1):
        first = tree.halves[part]
        sizes[part] = rng.integers(1, 5) if first < 0 else sizes[first] + sizes[first + 1]
        tree.ranges[part] = 0, sizes[part]
        if first < 0:
            box = tree.boxes[part * BOX : (part + 1) * BOX]
            x, y, z = -box[4:7] - box[:3]
            tree.costs[8 * part] = (x * y + y * z + z * x) * BLOCK_COST
    return tree


@given(hierarchies(), st.sampled_from([1, 4, 8, 32]))
def test_collapse_finds_the_least_cost(tree, leaf_size):
    collapse(tree, len(tree.halves), leaf_size)
    # Sums of a hundred float32 areas.
    assert tree.costs[0] == pytest.approx(cheapest(tree, leaf_size), rel=100 * 2.0**-24)


@SPLIT
@pytest.mark.parametrize("leaf_size", [1, 4, 8, 32])
def test_the_tree_costs_what_the_collapse_said(split, leaf_size):
    """The nodes as written have the cost that was chosen: what emission writes is what collapse means."""
    for kind in ("soup", "sizes"):
        mesh = Mesh(*make_mesh(kind, 8, 1000))
        octree = Octree.from_mesh(mesh, split=split, leaf_size=leaf_size)
        _, subtrees = build_parts(boxes_of_faces(mesh.vertices, mesh.faces, 1), Rule(SPLITS[split], leaf_size, 32), 1)
        x, y, z = mesh.triangles.max(axis=(0, 1)) - mesh.triangles.min(axis=(0, 1))
        assert octree.stats.cost * (x * y + y * z + z * x) == pytest.approx(subtrees[0].cost, rel=1e-4)


def test_a_larger_leaf_size_never_costs_more():
    for split in SPLITS:
        costs = [Octree.from_mesh(icosphere(4), split=split, leaf_size=size).stats.cost for size in (4, 8, 16, 32)]
        assert all(b <= a * (1 + 1e-6) for a, b in pairwise(costs))


def test_a_tree_is_no_deeper_where_centres_are_too_close_for_bins():
    """One face in each cut had made it 109 levels deep."""
    corners = np.random.default_rng(0).random((9000, 3, 3)) * 1e-38
    corners[0] = np.eye(3)
    octree = Octree(corners.reshape(-1, 3), np.arange(27_000).reshape(-1, 3), split="sah")
    assert octree.stats.depth < 20


def test_sah_expects_less_than_the_midpoint():
    # Of a surface that octants do not suit; a sphere costs the same either way.
    for mesh in (torus(), torus(1.0, 0.1, 200, 40)):
        assert Octree.from_mesh(mesh, split="sah").stats.cost < Octree.from_mesh(mesh, split="midpoint").stats.cost


@SPLIT
def test_memory_at_peak_and_at_rest(split):
    # Sorted boxes take 64 bytes a face and go before blocks are filled; the subtrees' nodes lie beside both.
    mesh = icosphere(6)
    Octree.from_mesh(mesh, split=split, threads=1)
    tracemalloc.start()
    try:
        octree = Octree.from_mesh(mesh, split=split, threads=1)
        at_rest, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    faces = len(mesh.faces)
    assert octree.stats.bytes <= at_rest <= octree.stats.bytes + 100_000
    assert peak < 160 * faces
