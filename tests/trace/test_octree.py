"""Octree and BruteForce as objects: options, statistics, extreme meshes, ties, and the analytic hits they must give."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cases import cases
from meshes import arrays, assert_same_hits, make_mesh, rays_at

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.octree import MAX_DEPTH, MAX_LEAF_SIZE, BruteForce, Octree
from renderer.trace.layout import BLOCK_FACES, CHILDREN, NODE_WORDS
from renderer.tree.invariants import faults

pytestmark = pytest.mark.judges(
    "BruteForce.stats", "Hits", "Hits.normals", "Octree", "Octree.closest_hit", "Octree.from_mesh", "Octree.stats"
)


ROOT = Path(__file__).parents[2]
SPLIT = pytest.mark.parametrize("split", ["midpoint", "sah"])


def cast(accelerator, origin, direction):
    hits = accelerator.closest_hit([origin], [direction])
    return hits.t[0], hits.face[0]


@SPLIT
def test_one_triangle_with_flat_bounds(split):
    for axis in range(3):
        vertices = np.roll([[0, 0, 7], [1, 0, 7], [0, 1, 7]], axis, axis=1)
        origin, direction = np.roll([0.25, 0.5, 9], axis), np.roll([0, 0, -2], axis)
        octree = Octree(vertices, [[0, 1, 2]], split=split)
        hits = octree.closest_hit([origin], [direction])
        assert (hits.t[0], hits.face[0], hits.u[0], hits.v[0]) == (1, 0, 0.25, 0.5)
        np.testing.assert_array_equal(hits.points[0], np.roll([0.25, 0.5, 7], axis))
        np.testing.assert_array_equal(hits.normals[0], np.roll([0, 0, 1], axis))
        assert octree.stats.references == octree.stats.leaves == octree.stats.blocks == octree.stats.nodes == 1


@SPLIT
@pytest.mark.parametrize("leaf_size", [1, 3, 8, MAX_LEAF_SIZE])
@pytest.mark.parametrize("seed", range(5))
def test_the_lowest_of_equal_faces_wins(split, leaf_size, seed):
    rng = np.random.default_rng(seed)
    vertices, faces = make_mesh("soup", seed, 40)
    copies = np.repeat(faces, 10, axis=0)
    order = rng.permutation(len(copies))
    octree = Octree(vertices, copies[order], split=split, leaf_size=leaf_size)
    lowest = np.array([np.flatnonzero(order // 10 == face)[0] for face in range(len(faces))])
    origins, directions = rays_at(vertices, faces, seed)
    plain = Octree(vertices, faces).closest_hit(origins, directions)
    hits = octree.closest_hit(origins, directions)
    np.testing.assert_array_equal(hits.t, plain.t)
    np.testing.assert_array_equal(hits.face, np.where(plain.hit, lowest[plain.face], -1))


@SPLIT
def test_coincident_triangles_build_a_small_tree(split):
    count = 20_000
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    octree = Octree(vertices, np.tile([0, 1, 2], (count, 1)), split=split)
    assert octree.stats.references == count and octree.stats.nodes < count and octree.stats.depth <= MAX_DEPTH
    assert cast(octree, [0.25, 0.25, 2], [0, 0, -1]) == (2, 0)


@SPLIT
def test_bounds_of_two_ulp_far_from_the_origin(split):
    rng = np.random.default_rng(4)
    vertices = 1e6 + rng.integers(0, 3, (300, 3)) * np.spacing(1e6)
    octree = Octree(vertices, np.arange(300).reshape(-1, 3), split=split, leaf_size=1)
    assert octree.stats.references == 100 and faults(octree.tree, octree.mesh) == []
    origins, directions = rays_at(vertices, octree.mesh.faces, 5)
    brute = BruteForce(vertices, octree.mesh.faces)
    assert_same_hits(octree.closest_hit(origins, directions), brute.closest_hit(origins, directions))


def test_extreme_coordinates_build_and_trace():
    sphere = icosphere(2)
    rng = np.random.default_rng(8)
    origins = rng.uniform(-0.5, 0.5, (500, 3))
    directions = rng.normal(size=(500, 3))
    expected = Octree.from_mesh(sphere).closest_hit(origins, directions)
    for exponent in (-900, -149, -126, 125, 900):
        for split in ("midpoint", "sah"):
            mesh = Mesh(np.ldexp(sphere.vertices, exponent), sphere.faces)
            octree = Octree.from_mesh(mesh, split=split)
            scaled = Mesh(mesh.vertices * octree.tree.scale, mesh.faces)
            assert 0.5 <= np.abs(scaled.vertices).max() <= 1.0
            assert faults(octree.tree, scaled) == []
            hits = octree.closest_hit(np.ldexp(origins, exponent), directions)
            np.testing.assert_array_equal(hits.face, expected.face)
            np.testing.assert_array_equal(hits.t, np.ldexp(expected.t, exponent))


def test_large_scales_do_not_spoil_the_tree():
    # Areas of 2^150 do not fit a float32; the tree may come out deeper for that, but not larger.
    sphere = icosphere(4)
    for split in ("midpoint", "sah"):
        plain = Octree.from_mesh(sphere, split=split).stats
        for exponent in (-75, 75):
            stats = Octree(np.ldexp(sphere.vertices, exponent), sphere.faces, split=split).stats
            assert stats.nodes <= 1.1 * plain.nodes and stats.depth <= 3 * plain.depth


def run(script):
    """Run Python in a process of its own, because what it does has ended or hung the interpreter before."""
    subprocess.run([sys.executable, "-W", "ignore", "-c", script], cwd=ROOT, check=True, timeout=20)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_forked_process_can_trace():
    # multiprocessing forks by default on Linux; threads do not survive that, so their pool must be made anew.
    run("""
import os
import numpy as np
from renderer.octree import Octree
octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], threads=2)
octree.any_hit(np.zeros((20_000, 3)), np.ones((20_000, 3)))
pid = os.fork()
if pid == 0:
    import signal
    signal.alarm(10)
    octree.any_hit(np.zeros((20_000, 3)), np.ones((20_000, 3)))
    os._exit(0)
assert os.waitpid(pid, 0)[1] == 0, "the child hangs"
""")


def test_stats_count_what_is_there():
    mesh = icosphere(3)
    octree = Octree.from_mesh(mesh, leaf_size=8)
    stats, tree = octree.stats, octree.tree
    assert stats.faces == stats.references == 1280
    assert stats.bytes == tree.nodes.nbytes + tree.blocks.nbytes + tree.faces.nbytes
    assert stats.fill == 1280 / (BLOCK_FACES * stats.blocks)
    assert stats.nodes * NODE_WORDS * 4 == tree.nodes.nbytes and stats.blocks * BLOCK_FACES == len(tree.faces)
    # Each leaf and each node but the root hangs in one place of a node.
    used = int((tree.nodes.reshape(stats.nodes, -1)[:, :8] < np.inf).sum())
    assert used == stats.leaves + stats.nodes - 1
    assert np.log(stats.leaves) / np.log(8) <= stats.depth <= 12
    assert Octree([], []).stats.references == 0 and Octree([], []).stats.fill == 1
    brute = BruteForce.from_mesh(mesh).stats
    assert (brute.nodes, brute.leaves, brute.depth, brute.blocks, brute.references) == (0, 0, 0, 320, 1280)


@SPLIT
def test_options_shape_the_tree(split):
    mesh = icosphere(4)
    nodes = [Octree.from_mesh(mesh, split=split, leaf_size=size).stats.nodes for size in (1, 4, 32)]
    assert nodes == sorted(nodes, reverse=True) and nodes[0] > nodes[2]
    deep, shallow = (Octree.from_mesh(mesh, split=split, max_depth=depth).stats for depth in (32, 1))
    assert deep != shallow
    for size in (1, 3, 4, 7, 32):
        octree = Octree.from_mesh(mesh, split=split, leaf_size=size)
        links = octree.tree.links.reshape(-1, NODE_WORDS)[:, CHILDREN : CHILDREN + 8]
        used = octree.tree.nodes.reshape(-1, NODE_WORDS)[:, :8] < np.inf
        for code in ~links[used & (links < 0)]:
            first, count = code >> 3, (code & 7) + 1
            assert (octree.tree.faces[first * BLOCK_FACES : (first + count) * BLOCK_FACES] >= 0).sum() <= size


def test_float32_vertices_take_half_the_memory_and_give_the_same_hits():
    vertices, faces = make_mesh("soup_float32", 9, 500)
    narrow, wide = Octree(vertices, faces), Octree(np.concatenate([vertices, [[0.1, 0, 0]]]), faces)
    assert narrow.tree.blocks.dtype == np.float32 and wide.tree.blocks.dtype == np.float64
    rays = rays_at(vertices, faces, 10)
    assert_same_hits(narrow.closest_hit(*rays), wide.closest_hit(*rays))


def test_the_tree_is_the_same_every_time_and_for_every_entrance():
    mesh = icosphere(3)
    first, second = Octree.from_mesh(mesh), Octree(mesh.vertices.tolist(), mesh.faces.tolist())
    for a, b in zip(arrays(first.tree), arrays(second.tree), strict=True):
        assert a.tobytes() == b.tobytes()
    assert first.mesh is mesh


def test_the_caller_may_change_its_arrays_afterwards():
    vertices, faces = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])
    octree = Octree(vertices, faces)
    vertices[:], faces[:] = 9, 0
    assert cast(octree, [0.25, 0.25, 1], [0, 0, -1]) == (1, 0)


@cases("exponent", [-140, -110, 0, 110])
def test_normals_are_unit_at_every_scale(exponent):
    vertices = np.ldexp([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], exponent)
    hits = Octree(vertices, [[0, 1, 2]]).closest_hit(np.ldexp([[0.25, 0.25, 1]], exponent), [[0, 0, -1]])
    np.testing.assert_array_equal(hits.normals, [[0, 0, 1]])


@cases("accelerator", [Octree, BruteForce])
@cases("scale", [1e-300, 1e-40, 1e-30, 1e30, 1e40, 1e300])
def test_meshes_beyond_float32_are_traced_exactly(accelerator, scale):
    """Their vertices are brought near 1 by a power of two, and t comes back by the same."""
    sphere = icosphere(2)
    inside = accelerator(sphere.vertices * scale, sphere.faces)
    directions = np.random.default_rng(3).normal(size=(200, 3))
    hits = inside.closest_hit(np.zeros((200, 3)), directions)
    plain = accelerator(sphere.vertices, sphere.faces).closest_hit(np.zeros((200, 3)), directions)
    np.testing.assert_array_equal(hits.face, plain.face)
    np.testing.assert_allclose(hits.t / scale, plain.t, rtol=8 * 2.0**-53)
    assert inside.any_hit(np.zeros((200, 3)), directions, t_max=1.1 * plain.t * scale).all()
    assert not inside.any_hit(np.zeros((200, 3)), directions, t_max=0.9 * plain.t * scale).any()
