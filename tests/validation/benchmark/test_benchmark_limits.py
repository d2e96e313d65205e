"""Counts of what rays read: the model goes where rays must go, the caches forget in order, and the bounds add up."""

import numpy as np
import pytest

from renderer.mesh.shapes import lattice_faces
from renderer.octree import Octree
from validation.benchmark.limits import roofline
from validation.benchmark.limits.bvh8 import build
from validation.benchmark.limits.caches import caches, reads
from validation.benchmark.limits.counts import in_a_row
from validation.benchmark.limits.trees import PlainTree, bvh8_of, octree_of
from validation.benchmark.limits.walks import BEAM_NODES, BLOCKS, NODES, PACKETS, TRIANGLES, walk
from validation.benchmark.measures.families import families
from validation.benchmark.measures.meshes import named


@pytest.fixture(scope="module", params=["2000", "city_2000"])
def octree(request: pytest.FixtureRequest) -> Octree:
    return Octree.from_mesh(named(request.param))


@pytest.mark.parametrize("made", [octree_of, bvh8_of])
@pytest.mark.parametrize("together", [False, True])
def test_the_model_finds_the_hits_that_the_octree_finds(octree: Octree, made: object, together: bool) -> None:
    tree = made(octree)  # type: ignore[operator]
    for family in families(octree, 640):
        found = walk(tree, octree.mesh.triangles, family, together)
        expected = octree.closest_hit(family.origins, family.directions, t_max=family.t_max).t
        # The model rounds without bounds: near an edge it may miss a face, as few in a thousand do.
        differing = ~np.isclose(found.t, expected, rtol=1e-9, atol=1e-9)
        assert differing.sum() <= 3, family.name
        assert found.ends[-1] == len(found.records) and (np.diff(found.ends) >= 0).all()
        assert found.sums[TRIANGLES] <= 4 * found.sums[BLOCKS]


def test_the_model_alone_enters_the_nodes_that_a_ray_alone_enters(octree: Octree) -> None:
    tree = octree_of(octree)
    for family in families(octree, 640):
        found = walk(tree, octree.mesh.triangles, family, together=False)
        steps = octree.count_steps(family.origins, family.directions, t_max=family.t_max)
        # Boxes in float32 rounded outwards are met by few rays more.
        assert found.sums[NODES] == pytest.approx(steps.nodes.sum(), rel=0.01)
        assert found.sums[TRIANGLES] == pytest.approx(steps.triangles.sum(), rel=0.01)
        assert (found.records & 1 == 0).sum() == found.sums[NODES]


def test_rays_of_a_camera_travel_together_and_read_less(octree: Octree) -> None:
    camera = in_a_row(families(octree, 1 << 16)[0], 4096)
    alone, packed = (walk(octree_of(octree), octree.mesh.triangles, camera, together) for together in (False, True))
    assert alone.sums[PACKETS] == alone.sums[BEAM_NODES] == 0
    assert packed.sums[PACKETS] > 200 and packed.sums[BEAM_NODES] > 0
    assert len(packed.records) < len(alone.records) / 2


def test_a_bvh8_has_each_face_once_in_a_box_that_holds_it() -> None:
    corners = named("city_2000").triangles
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    boxes, children, faces = build(lower, upper)
    used = faces[faces >= 0]
    assert sorted(used) == list(range(len(corners)))
    leaves = 0
    for node, place in np.argwhere(boxes[:, 0] <= boxes[:, 1]):
        box, child = boxes[node, :, place], children[node, place]
        if child >= 0:
            inside = boxes[child][:, boxes[child, 0] <= boxes[child, 1]]
            assert (inside[0::2] >= box[0::2, None]).all() and (inside[1::2] <= box[1::2, None]).all()
            continue
        leaves += 1
        first, count = ~child >> 3, (~child & 7) + 1
        held = faces[first : first + count]
        held = held[held >= 0]
        assert len(held) <= 28
        assert np.allclose(lower[held].min(axis=0), box[0::2]) and np.allclose(upper[held].max(axis=0), box[1::2])
    assert leaves > len(corners) / 28
    # No node but the root has a single child, and equal boxes are cut too.
    assert ((boxes[:, 0] <= boxes[:, 1]).sum(axis=1) > 1).all()
    same = build(np.zeros((40, 3)), np.ones((40, 3)))
    assert sorted(same[2][same[2] >= 0]) == list(range(40))


def test_a_bvh8_of_a_grid_costs_what_its_surfaces_say() -> None:
    """A flat grid of 32 x 32 squares: eight children a node and nearly full blocks, as for any even mesh."""
    points = np.stack([*np.meshgrid(np.arange(33.0), np.arange(33.0)), np.zeros((33, 33))], axis=-1).reshape(-1, 3)
    corners = points[lattice_faces(33, 33)]
    boxes, _, faces = build(corners.min(axis=1), corners.max(axis=1))
    assert (boxes[:, 0] <= boxes[:, 1]).sum(axis=1).mean() > 6.0
    assert (faces >= 0).mean() > 0.6


def test_caches_forget_what_was_used_longest_ago() -> None:
    tree = PlainTree(np.zeros((64, 6, 8), np.float32), np.zeros((64, 8), np.int64), np.zeros((8, 4), np.int32), 176)
    # A cache of sixteen lines holds four nodes, one of 64 lines holds sixteen.
    levels = ((16 * 64, 16), (64 * 64, 64))
    twice = np.tile(2 * np.arange(4), 2)
    assert reads(tree, twice, 0, levels).from_.tolist() == [16, 0, 16]
    assert reads(tree, twice, 4, levels).waits.tolist() == [4, 0, 0]
    rounds = np.tile(2 * np.arange(5), 2)
    assert reads(tree, rounds, 5, levels).from_.tolist() == [0, 20, 0]
    many = np.tile(2 * np.arange(17), 2)
    assert reads(tree, many, 17, levels).waits.tolist() == [0, 0, 17]
    # A block of 176 bytes touches three lines, or four where it begins late in its first.
    assert [reads(tree, np.array([2 * b + 1]), 0, levels).lines for b in range(4)] == [3, 4, 4, 3]


def test_the_system_tells_caches_that_grow() -> None:
    sizes = [size for size, _ in caches().levels]
    assert sizes == sorted(sizes) and sizes[0] >= 8 << 10


def test_bounds_grow_with_what_they_count() -> None:
    counts = {"packed": 0.0, "nodes": 10.0, "blocks": 2.0, "beams": 0.0, "leaf_boxes": 0.0,
              "from": [10.0, 5.0, 2.0, 1.0], "waits": [5.0, 2.0, 1.0, 1.0]}  # fmt: skip
    rates = {"packet_ray": 1.0, "ray": 10.0, "node": 5.0, "block": 20.0, "beam": 2.0, "octant": 1.0,
             "overlapped": [1.0, 2.0, 8.0], "bandwidth": [16.0, 20.0]}  # fmt: skip
    found = roofline.bounds(counts, rates)
    assert found == {"compute": 100.0, "bandwidth": 176.0 / 16.0, "latency": 2.0 + 2.0 + 8.0}
    assert roofline.holds(found) == "compute"
    assert roofline.holds(roofline.bounds(counts | {"waits": [0.0, 0.0, 0.0, 90.0]}, rates)) == "latency"
    assert roofline.holds(roofline.bounds(counts | {"from": [0.0, 0.0, 0.0, 90.0]}, rates)) == "bandwidth"
    assert roofline.efficiency(counts, rates, 88.0, 16) == pytest.approx(20.0 / 32.0)
    assert roofline.efficiency(counts, rates, 88.0, 4) == 1.0
