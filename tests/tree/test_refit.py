"""Refit: the hits of a new build, the same leaves, nothing torn for concurrent queries, and what it refuses."""

from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import answers, arrays, assert_same_hits, make_mesh, meshes, options, rays_at, separate

import renderer.tree.refit
from renderer.errors import MeshError
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.octree import BruteForce, Octree
from renderer.tree.invariants import faults
from renderer.tree.refit import refit_tree

pytestmark = pytest.mark.judges("BruteForce.refit", "Octree.refit")


SPLIT = pytest.mark.parametrize("split", ["midpoint", "sah"])
ACCELERATORS = pytest.mark.parametrize("accelerator", [Octree, BruteForce])


def moved_vertices(vertices, seed):
    """Positions that keep few neighbours together, of float32 or float64 and of another size."""
    rng = np.random.default_rng(seed)
    moved = vertices * 10.0 ** rng.integers(-2, 3) + rng.normal(size=vertices.shape)
    return moved.astype(np.float32).astype(np.float64) if seed % 2 else moved


def assert_like_new(octree, vertices, faces, seed):
    """Sound, and with the hits of a new build."""
    assert faults(octree.tree, octree.mesh) == []
    fresh = Octree(vertices, faces, threads=1)
    origins, directions = rays_at(vertices, faces, seed)
    assert_same_hits(octree.closest_hit(origins, directions), fresh.closest_hit(origins, directions))
    np.testing.assert_array_equal(octree.any_hit(origins, directions), fresh.any_hit(origins, directions))
    assert octree.tree.blocks.dtype == fresh.tree.blocks.dtype
    return fresh


@settings(max_examples=200)
@given(meshes, options, st.integers(0, 2**20))
def test_a_refitted_tree_hits_like_a_new_one(mesh, chosen, seed):
    vertices, faces = mesh
    octree = Octree(vertices, faces, **chosen)
    for step in range(2):
        vertices = moved_vertices(mesh[0], seed + step)
        octree.refit(vertices)
        assert_like_new(octree, vertices, faces, seed)


@SPLIT
@pytest.mark.parametrize("kind", ["soup", "duplicates", "sizes"])
def test_larger_refitted_trees_hit_like_new_ones(kind, split):
    vertices, faces = make_mesh(kind, 1, 10_000)
    octree = Octree(vertices, faces, split=split, threads=2)
    moved = moved_vertices(vertices, 2)
    octree.refit(moved)
    assert_like_new(octree, moved, faces, 3)


def test_every_query_of_a_closed_mesh_answers_as_a_new_tree():
    ball, rays = icosphere(3), np.random.default_rng(1).normal(size=(2, 200, 3))
    octree, moved = Octree.from_mesh(ball), ball.vertices * [1.0, 2.0, 0.5] + 0.25
    octree.winding_number(rays[0])  # with what it keeps for the tree
    octree.refit(moved)
    found, fresh = answers(octree, *rays), answers(Octree(moved, ball.faces), *rays)
    assert found == fresh and "signed_distance" in found
    numbers = Octree(moved, ball.faces).winding_number(rays[0], 0.0)
    np.testing.assert_allclose(octree.winding_number(rays[0]), numbers, rtol=0, atol=1e-3)


@SPLIT
def test_refit_without_a_move_changes_nothing(split):
    octree = Octree(*make_mesh("soup", 1, 10_000), split=split)
    before, stats = octree.tree, octree.stats
    octree.refit(octree.mesh.vertices)
    for a, b in zip(arrays(octree.tree), arrays(before), strict=True):
        np.testing.assert_array_equal(a, b)
    assert octree.stats == stats and octree.tree is not before


@SPLIT
def test_the_refitted_tree_does_not_depend_on_the_threads(split):
    vertices, faces = make_mesh("sizes", 4, 30_000)
    moved = moved_vertices(vertices, 5)
    trees = []
    for threads in (1, 2, 7):
        octree = Octree(vertices, faces, split=split, threads=threads)
        octree.refit(moved)
        trees.append([array.tobytes() for array in arrays(octree.tree)])
    assert trees[0] == trees[1] == trees[2]


def test_blocks_are_as_narrow_as_the_new_vertices_allow():
    vertices, faces = make_mesh("soup_float32", 1, 100)
    octree = Octree(vertices, faces)
    for chosen, dtype in ((vertices + 0.1, np.float64), (vertices, np.float32)):
        octree.refit(chosen)
        assert octree.tree.blocks.dtype == dtype


@ACCELERATORS
@pytest.mark.parametrize("exponent", [-1000, -100, 100, 900])
def test_extreme_scales_are_brought_near_one_as_at_a_build(accelerator, exponent):
    sphere = icosphere(3)
    vertices = np.ldexp(sphere.vertices, exponent)
    moved = accelerator.from_mesh(sphere)
    moved.refit(vertices)
    fresh = accelerator(vertices, sphere.faces)
    assert moved.tree.scale == fresh.tree.scale != 1.0
    origins, directions = rays_at(sphere.vertices, sphere.faces, 1)
    near = np.abs(origins).max(axis=1) < 100
    origins, directions = np.ldexp(origins[near], exponent), directions[near]
    hits = moved.closest_hit(origins, directions)
    assert_same_hits(hits, fresh.closest_hit(origins, directions))
    assert hits.hit.any()
    moved.refit(sphere.vertices)
    assert moved.tree.scale == 1.0


def test_empty_meshes_refit():
    for octree in (Octree(np.empty((0, 3)), np.empty((0, 3), int)), Octree(np.zeros((2, 3)), np.empty((0, 3), int))):
        octree.refit(octree.mesh.vertices + 1.0)
        assert not octree.any_hit([[0, 0, 0]], [[0, 0, 1]]).any()
        assert faults(octree.tree, octree.mesh) == []


def test_a_repaired_mesh_refits():
    octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, np.nan, 0]], [[0, 1, 3], [0, 1, 2]], repair=True)
    octree.refit(octree.mesh.vertices + np.array([0, 0, 1]))
    assert octree.closest_hit([[0.25, 0.25, 3]], [[0, 0, -1]]).t.tolist() == [2.0]
    assert octree.repairs.dropped_faces.tolist() == [0]


@ACCELERATORS
@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        (np.zeros((3, 3)), ["expected shape (4, 3)", "got (3, 3)"]),
        (np.zeros((5, 3)), ["expected shape (4, 3)", "got (5, 3)"]),
        (np.zeros((4, 2)), ["expected shape (4, 3)", "got (4, 2)"]),
        (np.zeros(12), ["expected shape (4, 3)", "got (12,)"]),
        (np.full((4, 3), np.nan), ["finite", "row 0"]),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, np.inf]], ["finite", "row 3"]),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0]], ["expected"]),
        (np.full((4, 3), "1"), ["expected"]),
        ([[0, 0, 0], [1e-320, 0, 0], [0, 1e300, 0], [0, 0, 1]], ["within 2^900", "row 1"]),
        (None, ["expected"]),
    ],
)
def test_what_is_no_move_is_refused_and_changes_nothing(accelerator, vertices, words):
    built = accelerator([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [0, 1, 3]])
    before = built.mesh, built.tree
    with pytest.raises(MeshError, match=r"^vertices: ") as error:
        built.refit(vertices)
    assert all(word in str(error.value) for word in words)
    assert (built.mesh, built.tree) == before


def test_the_caller_may_change_its_array_afterwards():
    octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    moved = octree.mesh.vertices + np.array([0, 0, 1])
    octree.refit(moved)
    moved[:] = 9
    assert octree.closest_hit([[0.25, 0.25, 3]], [[0, 0, -1]]).t.tolist() == [2.0]


def test_hits_keep_the_mesh_that_they_hit():
    octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    hits = octree.closest_hit([[0.25, 0.25, 3]], [[0, 0, -1]])
    octree.refit(octree.mesh.vertices + np.array([0, 0, 1]))
    assert hits.points.tolist() == [[0.25, 0.25, 0]]


def test_a_query_meanwhile_sees_one_mesh_or_the_other():
    sphere = icosphere(5)
    octree, far = Octree.from_mesh(sphere, threads=1), sphere.vertices * 3.0
    rng = np.random.default_rng(1)
    origins = 10.0 * rng.normal(size=(500, 3))
    expected = [Octree(vertices, sphere.faces).closest_hit(origins, -origins) for vertices in (sphere.vertices, far)]
    answers = [(hits.t.tobytes(), hits.points.tobytes()) for hits in expected]
    assert answers[0] != answers[1]
    done, seen = Event(), set()

    def ask():
        while not done.is_set():
            hits = octree.closest_hit(origins, -origins)
            seen.add(answers.index((hits.t.tobytes(), hits.points.tobytes())))

    with ThreadPoolExecutor(2) as pool:
        asking = [pool.submit(ask) for _ in range(2)]
        for step in range(60):
            octree.refit((far, sphere.vertices)[step % 2])
        done.set()
        for future in asking:
            future.result()
    assert seen == {0, 1}


def test_mesh_and_arrays_change_at_once():
    class Watched(Octree):
        def __setattr__(self, name, value):
            super().__setattr__(name, value)
            if "seen" in self.__dict__:
                self.seen.append((self.mesh, self.tree))

    octree = Watched([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    octree.__dict__["seen"] = []
    octree.refit(octree.mesh.vertices * 2.0)
    assert octree.seen == [(octree.mesh, octree.tree)]


@pytest.mark.parametrize("forgotten", ["_fit_leaves", "_fit_nodes"])
def test_boxes_that_were_forgotten_are_noticed(monkeypatch, forgotten):
    vertices, faces = make_mesh("soup", 1, 300)
    octree, moved = Octree(vertices, faces), vertices * 2.0 + 1.0
    monkeypatch.setattr(renderer.tree.refit, forgotten, lambda *arguments: None)
    tree = refit_tree(octree.tree, moved, octree.mesh.faces, 1.0, 1)
    assert faults(tree, Mesh(moved, faces))


def test_the_cost_tells_when_to_build_anew():
    vertices, faces = separate(icosphere(4).triangles)
    octree, rng = Octree(vertices, faces), np.random.default_rng(1)
    built = octree.stats.cost
    assert 2.0 < built < 50.0
    # A box keeps its share of the bounds when all move alike.
    octree.refit(vertices * 4.0)
    assert octree.stats.cost == built
    # Each triangle moves a little, or to another one's place, where only a new build has them side by side again.
    octree.refit(vertices + np.repeat(0.02 * rng.normal(size=(len(faces), 3)), 3, axis=0))
    wobbled = octree.stats.cost
    octree.refit(rng.permutation(vertices.reshape(-1, 3, 3)).reshape(-1, 3))
    assert built < wobbled < 2.0 * built < 10.0 * built < octree.stats.cost
    assert Octree.from_mesh(octree.mesh).stats.cost == pytest.approx(built, rel=1e-6)


def test_the_cost_of_what_has_no_area_counts_all():
    point = np.zeros((3, 3))
    octree = Octree(point, [[0, 1, 2]] * 40)
    assert octree.stats.cost == octree.stats.blocks + octree.stats.nodes
    assert BruteForce(point, [[0, 1, 2]] * 40).stats.cost == 10
    assert Octree([], []).stats.cost == 0
