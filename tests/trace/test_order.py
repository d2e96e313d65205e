"""One answer whatever the order: every tree, brute force, a refit, any threads, any batch and any order of the rays.

Rays beside planes and edge-on to faces, where the t of a hit errs by more than a box is wide.
"""

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import assert_same_hits, make_mesh, options, separate
from numpy.random import Generator

from renderer.jit.decorators import kernel
from renderer.mesh.shapes import box
from renderer.numerics.simd import extract
from renderer.octree import BruteForce, Octree
from renderer.results.hits import Hits
from renderer.trace.best import FaceHit
from renderer.trace.intersect import FAR_PADDING, Ray, box_limit, hit_triangles, largest_of, make_shear, round_down
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.resolve import _meet_slab, resolve_uncertain
from renderer.trace.trees import tree_pointers
from validation.oracle import exact

SIDE = 36


def flat_overlapping(count):
    """Triangles with x = 0 that overlap, and where all float32 boxes are flat."""
    corners = np.random.default_rng(0).uniform(-0.5, 0.5, (count, 3, 3))
    corners[..., 0] = 0.0
    return separate(corners)


def beside(distance):
    """Rays from a grid beside the plane x = 0, nearly along it."""
    y, z = np.meshgrid(np.linspace(-0.5, 0.5, SIDE), np.linspace(-0.5, 0.5, SIDE))
    origins = np.stack([np.full(y.size, distance), y.ravel(), z.ravel()], axis=1)
    return origins, np.tile([-0.1, 1.0, 0.3], (y.size, 1))


@pytest.fixture(scope="module")
def flat():
    return flat_overlapping(1000)


@pytest.fixture(scope="module")
def expected(flat):
    """The hits of rays that begin 1e-12 beside the triangles, one at a time."""
    octree = Octree(*flat, threads=1)
    origins, directions = beside(1e-12)
    rows = [octree.closest_hit(origins[i : i + 1], directions[i : i + 1]) for i in range(SIDE**2)]
    columns = [np.concatenate([getattr(row, name) for row in rows]) for name in ("t", "face", "u", "v")]
    hits = Hits(*columns, octree.mesh)
    assert hits.hit.mean() > 0.5 and abs(hits.t[hits.hit] - 1e-11).max() < 1e-15
    return hits


@pytest.mark.judges("BruteForce", "Octree.closest_hit")
def test_rays_beside_a_plane_hit_the_same_by_brute_force(flat, expected):
    """And by any rule of splitting, with any threads, after a refit, and without the first eight rays."""
    vertices, faces = flat
    refitted = Octree(vertices[:, [0, 2, 1]] * [1.0, 3.0, 0.5], faces)
    refitted.refit(vertices)
    octrees = [Octree(*flat, split=split, threads=threads) for split in ("midpoint", "sah") for threads in (2, 3)]
    origins, directions = beside(1e-12)
    for queries in (BruteForce(*flat), refitted, *octrees):
        assert_same_hits(queries.closest_hit(origins, directions), expected)
        hits = queries.closest_hit(origins[8:], directions[8:])
        for name in ("t", "face", "u", "v"):
            np.testing.assert_array_equal(getattr(hits, name), getattr(expected, name)[8:])


@cases("factor", [1 - 1e-6, 1 - 1e-9, 1.0, 1 + 1e-9, 1 + 1e-6])
@cases("bound", ["t_min", "t_max"])
def test_bounds_close_to_a_hit_mean_the_same_to_all(flat, expected, bound, factor):
    bounds = {bound: np.where(expected.hit, expected.t, 1.0) * factor}
    rays = beside(1e-12)
    octree = Octree(*flat, threads=1)
    hits = octree.closest_hit(*rays, **bounds)
    if bound == "t_max":
        np.testing.assert_array_equal(hits.hit, expected.hit & (factor >= 1.0))
    for other in (Octree(*flat, threads=3), Octree(*flat, split="sah", leaf_size=32), BruteForce(*flat)):
        assert_same_hits(other.closest_hit(*rays, **bounds), hits)
        np.testing.assert_array_equal(other.any_hit(*rays, **bounds), hits.hit)


def near_plane(rng: Generator, count: int):
    """Rays that begin near the plane of a face, at it or at an edge of it, and go nearly along it or anywhere."""

    def rays_near(vertices, faces):
        if not len(faces):
            return rng.normal(size=(2, count, 3))
        corners = vertices[faces[rng.integers(0, len(faces), count)]]
        size = np.abs(corners).max(axis=(1, 2), keepdims=True)[:, 0] + 1e-300
        weights = rng.dirichlet(np.ones(3), (2, count))
        weights[:, :, 0] *= rng.choice([1.0, 0.0, -1e-12], (2, count))
        weights[0] *= rng.choice([1.0, 3.0], (count, 1))
        origins, targets = np.einsum("mnk,nkj->mnj", weights, corners)
        tiny = size * 10.0 ** rng.uniform(-18, 0, (count, 1)) * rng.choice([0.0, 1.0], (count, 1))
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        origins = origins + tiny * normals / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-300)
        directions = targets - origins
        directions[np.abs(directions).max(axis=1) < 1e-280] = [0.0, 0.0, 1.0]
        same = rng.random(count) < 0.3  # so that packets form
        directions[same] = directions[0]
        return origins, directions

    return rays_near


def flattened(seed, count, kind):
    """A mesh in one plane: across an axis at a float32, at no float32, or tilted."""
    rng = np.random.default_rng(seed)
    vertices, faces = make_mesh(kind, seed, count)
    if not len(vertices):
        return vertices, faces
    axis = rng.integers(3)
    vertices = vertices.copy()
    style = seed % 5
    if style < 3:
        vertices[:, axis] = (0.0, 1.0, 0.1)[style]
    elif style == 3:
        vertices[:, axis] = vertices[:, (axis + 1) % 3] * 0.3 + vertices[:, (axis + 2) % 3] * 0.7
    return vertices, faces


@settings(max_examples=200)
@given(
    st.sampled_from(["soup", "soup_float32", "lattice", "duplicates", "sizes", "flat", "far_away", "scaled"]),
    st.integers(0, 2**20),
    st.integers(0, 60),
    options,
)
def test_every_way_to_ask_has_the_same_answer(kind, seed, count, chosen):
    rng = np.random.default_rng(seed)
    vertices, faces = flattened(seed, count, kind)
    origins, directions = near_plane(rng, 64)(vertices, faces)
    first = BruteForce(vertices, faces, threads=1)
    t_min = rng.choice([0.0, 1e-16, 1e-9])
    expected = first.closest_hit(origins, directions, t_min)
    close = np.where(expected.hit, expected.t * rng.choice([1 - 1e-7, 1.0, 1 + 1e-7], 64), np.inf)
    asked = t_min, np.where(rng.random(64) < 0.5, close, np.inf)
    expected = first.closest_hit(origins, directions, *asked)

    octree = Octree(vertices, faces, **chosen)
    moved = Octree(vertices[::-1] * 2.0, faces, **chosen)
    moved.refit(vertices)
    for accelerator in (octree, moved):
        assert_same_hits(accelerator.closest_hit(origins, directions, *asked), expected)
        np.testing.assert_array_equal(accelerator.any_hit(origins, directions, *asked), expected.hit)
    np.testing.assert_array_equal(first.any_hit(origins, directions, *asked), expected.hit)
    order = rng.permutation(64)
    turned = octree.closest_hit(origins[order], directions[order], t_min, asked[1][order])
    parts = [octree.closest_hit(origins[a:b], directions[a:b], t_min, asked[1][a:b]) for a, b in ((0, 8), (8, 64))]
    for name in ("t", "face", "u", "v"):
        np.testing.assert_array_equal(getattr(turned, name), getattr(expected, name)[order])
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(expected, name))


@kernel
def within_own_box(tree, at, ray, t):
    """Whether a ray at t is within the box of the face at ``at``, in the arithmetic of boxes."""
    largest, first, last = largest_of(ray), np.float32(0.0), np.float32(np.inf)
    first, last = _meet_slab(tree, at, 0, ray.ox, ray.dx, largest, first, last)
    first, last = _meet_slab(tree, at, 1, ray.oy, ray.dy, largest, first, last)
    first, last = _meet_slab(tree, at, 2, ray.oz, ray.dz, largest, first, last)
    return first <= box_limit(t, largest) and round_down(t * largest) <= np.float32(last * FAR_PADDING)


@kernel
def judged(descriptor, origins, directions, out):
    """Of ray i at face i: 0 for a miss, 1 for a hit, 2 where t is uncertain, 3 where the determinant is; then t, t
    resolved, and 1 where t, or that of an uncertain hit resolved, is within the face's own box.
    """
    tree = tree_pointers(descriptor)
    for i in range(len(origins)):
        o, d = origins[i], directions[i]
        ray = Ray(o[0], o[1], o[2], d[0], d[1], d[2], 0.0, 0.0, -1.0)
        base, place = (i // BLOCK_FACES) * BLOCK_WORDS, i % BLOCK_FACES
        hits = hit_triangles(tree, base, make_shear(ray), 0.0, np.inf)
        t = extract(hits.t, place)
        if (hits.bits >> place) & 1 == 1 and t >= 0.0:
            of_determinant = (hits.determinant_uncertain >> place) & 1
            out[i, 0], out[i, 1] = 1 + ((hits.uncertain >> place) & 1) + of_determinant, t
            # A certain hit is resolved too, to see that its t stays.
            hit = FaceHit(t, 0.0, 0.0, 1.0)
            out[i, 2] = resolve_uncertain(tree, base + place, ray, make_shear(ray), hit, of_determinant != 0).t
            out[i, 3] = within_own_box(tree, base + place, ray, t if out[i, 0] == 1 else out[i, 2])


def rays_close_to_planes(rng, count):
    """Faces of all sizes and distances, flat in an axis at times, and a ray at each, many nearly in its plane."""
    size = 10.0 ** rng.uniform(-9, 3, (count, 1, 1))
    middle = rng.normal(size=(count, 1, 3)) * 10.0 ** rng.uniform(-3, 3, (count, 1, 1))
    corners = middle + size * rng.normal(size=(count, 3, 3))
    flat, axis = np.arange(0, count, 2), rng.integers(0, 3, (count + 1) // 2)
    corners[flat, :, axis] = rng.choice([0.0, 1.0, 0.1, -3.3], (len(flat), 1))
    targets = np.einsum("nk,nkj->nj", rng.dirichlet(np.full(3, 0.3), count), corners)
    within = rng.normal(size=(count, 3))
    along = np.einsum("nk,nkj->nj", within / within.sum(axis=1, keepdims=True), corners) - targets
    slope = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-12, 0, (count, 1))
    directions = np.where(rng.random((count, 1)) < 0.7, along + slope, rng.normal(size=(count, 3)))
    return corners, targets - 10.0 ** rng.uniform(-10, 2, (count, 1)) * directions, directions


@pytest.mark.parametrize("seed", range(3))
def test_a_hit_beyond_doubt_lies_within_its_own_box_and_so_within_all(seed):
    """The law of the order: see ``DOUBT``. Sure hits satisfy it by the bound of their error, others are moved."""
    corners, origins, directions = rays_close_to_planes(np.random.default_rng(seed), 100_000)
    brute = BruteForce(*separate(corners))
    assert brute.tree.scale == 1.0
    np.testing.assert_array_equal(brute.tree.faces[: len(corners)], np.arange(len(corners)))
    found = np.zeros((len(corners), 4))
    judged(brute.tree.descriptor, origins, directions, found)
    sure, doubtful = found[:, 0] == 1, found[:, 0] == 2
    assert sure.sum() > 50_000
    assert doubtful.sum() > 2_000
    assert (found[:, 0] == 3).sum() > 20_000
    assert found[sure, 3].all()
    # A certain hit that is resolved all the same stays, but where its t is counted with twice the digits.
    for row in np.flatnonzero(sure & (found[:, 1] != found[:, 2])):
        u, v, w, t = exact.determinants(corners[row], origins[row], directions[row])
        assert found[row, 2] == float(t / (u + v + w))
    counted = doubtful & ~np.isnan(found[:, 2])
    assert found[counted, 3].all()
    assert (found[counted, 2] > found[counted, 1]).any()
    assert (found[counted, 2] < found[counted, 1]).any()


@cases("seed", range(5))
def test_few_rays_amid_corners_and_edges_have_the_hits_of_many(seed):
    """Where one of a few rays has an uncertain hit, all of them are traced by another kernel."""
    rng, ends = np.random.default_rng(seed), np.tile([0.0, 0.5, 1.0, 0.3], 60)
    octree, origins = Octree.from_mesh(box()), rng.permuted(ends).reshape(-1, 3)
    origins[:, 2] += 3.0
    directions = np.where(rng.random((len(origins), 1)) < 0.5, [0.0, 0.0, -1.0], rng.integers(-2, 3, (len(origins), 3)))
    directions[~directions.any(axis=1)] = (0.0, 0.0, -1.0)
    many = octree.closest_hit(origins, directions)
    assert 0.2 < many.hit.mean() < 1.0
    for count in (1, 3, 15):
        for begin in range(0, len(origins) - count, count):
            some = slice(begin, begin + count)
            few = octree.closest_hit(origins[some], directions[some])
            for name in ("t", "face", "u", "v", "side"):
                np.testing.assert_array_equal(getattr(few, name), getattr(many, name)[some])
