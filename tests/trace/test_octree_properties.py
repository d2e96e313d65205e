"""Laws of the octree over random meshes and rays: it equals brute force, the exact oracle, and itself transformed."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import KINDS, assert_same_hits, make_mesh, meshes, options, rays_at

from renderer.mesh.shapes import icosphere
from renderer.octree import BruteForce, Octree
from validation.oracle import exact

pytestmark = pytest.mark.judges("BruteForce", "Hits", "Hits.normals", "Hits.points", "Octree", "Octree.closest_hit")


SEEDS = st.integers(0, 2**20)


def intervals(seed, count):
    """No interval, one for all rays, or one a ray."""
    rng = np.random.default_rng(seed)
    if seed % 3 == 0:
        return 0.0, np.inf
    if seed % 3 == 1:
        return rng.uniform(0, 0.8), rng.uniform(0.5, 2)
    return rng.uniform(0, 1, count), np.where(rng.random(count) < 0.3, np.inf, rng.uniform(0, 2, count))


@settings(max_examples=400)
@given(meshes, options, SEEDS)
def test_octree_equals_brute_force_bit_for_bit(mesh, chosen, seed):
    octree, brute = Octree(*mesh, **chosen), BruteForce(*mesh, threads=1)
    origins, directions = rays_at(*mesh, seed)
    t_min, t_max = intervals(seed, len(origins))
    expected = brute.closest_hit(origins, directions, t_min, t_max)
    got = octree.closest_hit(origins, directions, t_min, t_max)
    assert_same_hits(got, expected)
    np.testing.assert_array_equal(octree.any_hit(origins, directions, t_min, t_max), expected.hit)
    np.testing.assert_array_equal(brute.any_hit(origins, directions, t_min, t_max), expected.hit)
    assert ((got.t >= t_min) & (got.t <= t_max))[got.hit].all()
    assert np.isinf(got.t[~got.hit]).all() and np.isnan(got.u[~got.hit]).all() and np.isnan(got.v[~got.hit]).all()


@cases("kind", sorted(set(KINDS) - {"duplicates"}))
@cases("split", ["midpoint", "sah"])
def test_octree_equals_brute_force_on_thousands_of_faces(kind, split):
    mesh = make_mesh(kind, 3, 3000)
    rays = rays_at(*mesh, 4, 100)
    hits = Octree(*mesh, split=split).closest_hit(*rays)
    assert hits.hit.sum() > 350
    assert_same_hits(hits, BruteForce(*mesh).closest_hit(*rays))


@settings(max_examples=60)
@given(SEEDS, st.integers(1, 30), options)
def test_integer_scenes_equal_the_exact_oracle(seed, count, chosen):
    # Small integers over a power of two: every product and sum is exact, so faces and the rounded t must be too.
    mesh = make_mesh("lattice", seed, count)
    rng = np.random.default_rng(seed)
    origins = rng.integers(-6, 7, (60, 3)).astype(float)
    directions = rng.integers(-4, 5, (60, 3)).astype(float)
    directions[np.arange(60), rng.integers(0, 3, 60)] = rng.choice([-4.0, 4.0], 60)
    hits = Octree(*mesh, **chosen).closest_hit(origins, directions)
    for row, expected in enumerate(exact.closest_hits(*mesh, origins, directions)):
        assert hits.face[row] == (-1 if expected is None else expected.face)
        assert hits.t[row] == (np.inf if expected is None else float(expected.t))


def t_bounds(corners, origins, directions):
    """How far the t of a hit may be off: a ray through rounded edge functions, and t's own roundings.

    t is a mean of the corners' z over d_z, z the longest axis of d, with the edge functions as weights. Errors of
    the weights move it by at most the spread of z times their relative error; eight roundings follow.
    """
    relative = corners - origins[:, None]
    z = np.abs(directions).argmax(axis=1)
    depth = relative[np.arange(len(z)), :, z] / directions[np.arange(len(z)), z][:, None]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    determinant = np.abs(np.einsum("ij,ij->i", normal, directions))
    weights = exact.determinant_bounds(relative, directions).sum(axis=1) / determinant
    unit = exact.FLOAT64_ROUNDOFF
    return 2 * weights * np.ptp(depth, axis=1) + 8 * unit * np.abs(depth).max(axis=1)


def clearly_hit(corners, origin, direction):
    """Whether the three edge functions have one sign by more than any float64 kernel can err."""
    values = np.array([float(x) for x in exact.determinants(corners, origin, direction)[:3]])
    bounds = exact.determinant_bounds((corners - origin)[None], direction[None])[0]
    return (values > bounds).all() or (values < -bounds).all()


@settings(max_examples=40)
@given(st.sampled_from(["soup", "soup_float32", "sizes", "far_away", "scaled"]), SEEDS, options)
def test_general_scenes_agree_with_the_exact_oracle(kind, seed, chosen):
    mesh = make_mesh(kind, seed, 25)
    origins, directions = rays_at(*mesh, seed, 8)
    hits = Octree(*mesh, **chosen).closest_hit(origins, directions)
    judged = 0
    for row, expected in enumerate(exact.closest_hits(*mesh, origins, directions)):
        ray = origins[row], directions[row]
        possible = exact.possible_faces(*mesh, *ray)
        if not all(clearly_hit(mesh[0][mesh[1][f]], *ray) for f in possible):
            continue  # within rounding of an edge either answer is right
        judged += 1
        assert hits.hit[row] == (expected is not None)
        if expected is not None:
            corners = mesh[0][mesh[1][[hits.face[row]]]]
            assert hits.face[row] in possible
            bound = t_bounds(corners, origins[[row]], directions[[row]])[0]
            assert abs(hits.t[row] - float(expected.t)) <= bound
    assert judged >= len(origins) // 3


@settings(max_examples=60)
@given(meshes, options, SEEDS, st.integers(-100, 100), st.integers(-100, 100))
def test_scaling_by_powers_of_two_is_exact(mesh, chosen, seed, scene, direction):
    # Mesh coordinates stay below 2^126 and above float32's denormals.
    vertices, faces = mesh
    origins, directions = rays_at(*mesh, seed, 20)
    plain = Octree(vertices, faces, **chosen).closest_hit(origins, directions)
    larger = Octree(np.ldexp(vertices, scene), faces, **chosen)
    hits = larger.closest_hit(np.ldexp(origins, scene), np.ldexp(directions, direction))
    np.testing.assert_array_equal(hits.t, np.ldexp(plain.t, scene - direction))
    np.testing.assert_array_equal(hits.face, plain.face)
    np.testing.assert_array_equal(hits.u, plain.u)
    np.testing.assert_array_equal(hits.v, plain.v)


@settings(max_examples=60)
@given(meshes, options, SEEDS)
def test_the_order_of_faces_changes_nothing_but_their_names(mesh, chosen, seed):
    vertices, faces = mesh
    rays = rays_at(*mesh, seed, 20)
    order = np.random.default_rng(seed).permutation(len(faces))
    plain = Octree(vertices, faces, **chosen).closest_hit(*rays)
    shuffled = Octree(vertices, faces[order], **chosen).closest_hit(*rays)
    np.testing.assert_array_equal(shuffled.t, plain.t)
    # Among equal t either has the lowest of its own numbers.
    hit = plain.hit
    names, numbers = order[shuffled.face[hit]], np.argsort(order)[plain.face[hit]]
    assert (names >= plain.face[hit]).all() and (numbers >= shuffled.face[hit]).all()


@settings(max_examples=60)
@given(meshes, options, SEEDS, st.permutations(range(3)), st.tuples(*[st.sampled_from([-1.0, 1.0])] * 3))
def test_axes_may_be_permuted_and_negated(mesh, chosen, seed, axes, signs):
    vertices, faces = mesh
    origins, directions = rays_at(*mesh, seed, 20)
    # Where two components of the direction are the longest, another axis order may choose another one.
    length = np.sort(np.abs(directions), axis=1)
    one = length[:, 2] > length[:, 1]
    origins, directions = origins[one], directions[one]
    plain = Octree(vertices, faces, **chosen).closest_hit(origins, directions)
    turned = [(array * signs)[:, axes] for array in (vertices, origins, directions)]
    hits = Octree(turned[0], faces, **chosen).closest_hit(turned[1], turned[2])
    # t is a sum of three products and so the same bits; only its zero may change sign.
    np.testing.assert_array_equal(hits.t, plain.t)
    np.testing.assert_array_equal(hits.face, plain.face)


def test_threads_and_concurrent_callers_give_the_same_bits():
    mesh = icosphere(4)
    rng = np.random.default_rng(5)
    origins, directions = rng.normal(size=(2, 60_000, 3))
    expected = Octree.from_mesh(mesh, threads=1).closest_hit(origins, directions)
    anything = Octree.from_mesh(mesh, threads=1).any_hit(origins, directions)
    for threads in (2, 5):
        octree = Octree.from_mesh(mesh, threads=threads)
        with ThreadPoolExecutor(4) as callers:
            for hits in callers.map(lambda _, tree=octree: tree.closest_hit(origins, directions), range(6)):
                assert_same_hits(hits, expected)
            for hit in callers.map(lambda _, tree=octree: tree.any_hit(origins, directions), range(4)):
                np.testing.assert_array_equal(hit, anything)


@settings(max_examples=60)
@given(meshes, options, SEEDS)
def test_points_and_normals_belong_to_the_face_that_is_hit(mesh, chosen, seed):
    vertices, faces = mesh
    origins, directions = rays_at(*mesh, seed, 10)
    hits = Octree(vertices, faces, **chosen).closest_hit(origins, directions)
    hit = hits.hit
    assert (hits.u[hit] >= 0).all() and (hits.v[hit] >= 0).all()
    # u + v errs by the roundings of two quotients and their sum.
    assert (hits.u[hit] + hits.v[hit] <= 1 + 4 * np.finfo(float).eps).all()
    assert np.isnan(hits.points[~hit]).all() and np.isnan(hits.normals[~hit]).all()
    corners = vertices[faces[hits.face[hit]]].reshape(-1, 3, 3)
    points = hits.points[hit]
    slack = 8 * np.finfo(float).eps * np.abs(corners).max(axis=(1, 2), initial=0)[:, None]
    assert (points >= corners.min(axis=1) - slack).all() and (points <= corners.max(axis=1) + slack).all()
