"""Rays that travel together find what each finds alone: packets of coherent rays, streams of others."""

import numpy as np
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import KINDS, assert_same_hits, make_mesh, meshes, options, rays_at

from renderer.jit.decorators import kernel
from renderer.mesh.shapes import icosphere
from renderer.numerics.simd import movemask, pointer, splat8
from renderer.octree import BruteForce, Octree
from renderer.trace.batch import RayBatch
from renderer.trace.intersect import Ray, box_limit, enter_boxes, make_slabs, round_down
from renderer.trace.layout import NODE_WORDS
from renderer.trace.packet import are_coherent, enter_beam, make_beam
from renderer.trace.ray_lanes import GROUP_STRIDE, WIDTH, Prepared, prepare_eight, prepare_ray
from renderer.trace.rays import batch_pointers, ray_at

SEEDS = st.integers(0, 2**20)


def fans(vertices, faces, seed, fans=6):
    """Sixteens of rays that differ little, or not at all, from a ray at the mesh; some slopes are exactly 0."""
    rng = np.random.default_rng(seed)
    origins, directions = (np.repeat(a[:fans], WIDTH, axis=0) for a in rays_at(vertices, faces, seed))
    size = np.abs(directions).max(axis=1, keepdims=True)
    turn, shift = 10.0 ** rng.uniform(-9, -1, (2, len(origins), 1)) * (rng.random((2, len(origins), 1)) < 0.8)
    directions = directions + size * turn * rng.normal(size=directions.shape)
    directions[rng.random(directions.shape) < 0.1] *= 0.0
    directions[~directions.any(axis=1)] = [0.0, -0.0, 1.0]
    return origins + (np.abs(vertices).max(initial=0.0) + 1.0) * shift * rng.normal(size=origins.shape), directions


@settings(max_examples=200)
@given(meshes, options, SEEDS)
def test_fans_equal_brute_force_bit_for_bit(mesh, chosen, seed):
    octree, brute = Octree(*mesh, **chosen), BruteForce(*mesh, threads=1)
    origins, directions = fans(*mesh, seed)
    t_max = np.inf if seed % 2 else np.random.default_rng(seed).uniform(0, 2, len(origins))
    expected = brute.closest_hit(origins, directions, 0.0, t_max)
    assert_same_hits(octree.closest_hit(origins, directions, 0.0, t_max), expected)
    np.testing.assert_array_equal(octree.any_hit(origins, directions, 0.0, t_max), expected.hit)


@cases("kind", sorted(set(KINDS) - {"duplicates", "far_away"}))
@cases("split", ["midpoint", "sah"])
def test_fans_equal_single_rays_on_thousands_of_faces(kind, split):
    octree = Octree(*make_mesh(kind, 3, 3000), split=split)
    origins, directions = fans(octree.mesh.vertices, octree.mesh.faces, 5, 40)
    together = octree.closest_hit(origins, directions)
    assert together.hit.sum() > 80
    # Fewer than sixteen are no packet.
    alone = [octree.closest_hit(origins[i : i + 1], directions[i : i + 1]) for i in range(len(origins))]
    for name in ("t", "face", "u", "v"):
        np.testing.assert_array_equal(getattr(together, name), np.concatenate([getattr(h, name) for h in alone]))


def test_any_order_and_number_of_rays_finds_the_same():
    """Packets, streams, a stream's refill and its end: rays in order, shuffled, and in batches of every size."""
    octree, rng = Octree.from_mesh(icosphere(5), leaf_size=32), np.random.default_rng(1)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1.1, 1.1, 40), np.linspace(-1.1, 1.1, 40)))
    origins, directions = np.column_stack([x, y, np.full(1600, 3.0)]), np.tile([0.0, 0.0, -1.0], (1600, 1))
    hits, any_hits = octree.closest_hit(origins, directions), octree.any_hit(origins, directions)
    assert 0.5 < hits.hit.mean() < 0.9 and np.array_equal(any_hits, hits.hit)
    shuffled = rng.permutation(1600)
    got = octree.closest_hit(origins[shuffled], directions[shuffled])
    np.testing.assert_array_equal(got.t, hits.t[shuffled])
    np.testing.assert_array_equal(got.face, hits.face[shuffled])
    np.testing.assert_array_equal(octree.any_hit(origins[shuffled], directions[shuffled]), any_hits[shuffled])
    for count in (1, 2, 15, 16, 17, 31, 33, 47):
        few = shuffled[:count]
        np.testing.assert_array_equal(octree.closest_hit(origins[few], directions[few]).t, hits.t[few])
        np.testing.assert_array_equal(octree.any_hit(origins[few], directions[few]), any_hits[few])


def test_a_packet_that_gives_up_is_traced_all_the_same():
    """Parallel rays from everywhere: one beam as wide as the mesh, which no packet can finish."""
    mesh, rng = icosphere(6), np.random.default_rng(2)
    origins = np.column_stack([rng.uniform(-1, 1, (640, 2)), np.full(640, 2.0)])
    directions = np.tile([0.0, 0.0, -1.0], (640, 1))
    octree, brute = Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)
    expected = brute.closest_hit(origins, directions)
    assert_same_hits(octree.closest_hit(origins, directions), expected)
    np.testing.assert_array_equal(octree.any_hit(origins, directions), expected.hit)


@kernel
def _prepare_both(rays, numbers, together, alone):
    floats, doubles, integers = together
    source = batch_pointers(rays, 0.25)
    prepare_eight(
        source, Prepared(pointer(floats), pointer(doubles), pointer(integers), source.starts), 8, pointer(numbers)
    )
    floats, doubles, integers = alone
    for k in range(8):
        ray, t_max = ray_at(source, numbers[k])
        prepare_ray(Prepared(pointer(floats), pointer(doubles), pointer(integers), source.starts), 8 + k, ray, t_max)


@cases("seed", range(10))
def test_eight_rays_are_prepared_as_each_is_alone(seed):
    """Bit for bit: directions along axes, of equal components and of -0.0, origins and bounds of any size."""
    rng = np.random.default_rng(seed)
    origins = rng.choice([0.0, -0.0, 1.0, -(2.0**126), 1e-310, *rng.normal(size=9)], (20, 3))
    directions = rng.choice([0.0, -0.0, 1.0, -1.0, 1e-200, -1e200, *rng.normal(size=9)], (20, 3))
    t_max = rng.choice([0.0, 1e-320, 3.0, 1e308, np.inf], 20)
    rays = RayBatch(origins, directions, rng.choice([0.0, 1e-320, 0.5], 20), t_max)
    together, alone = ([np.zeros(GROUP_STRIDE, kind) for kind in (np.float32, float, np.int64)] for _ in range(2))
    _prepare_both(rays, rng.integers(0, 20, 8), tuple(together), tuple(alone))
    for one, other in zip(together, alone, strict=True):
        assert one.tobytes() == other.tobytes() and one.reshape(16, 16)[:, 8:].any()
        assert not one.reshape(16, 16)[:, :8].any()


@kernel
def _are_coherent(rays):
    return are_coherent(batch_pointers(rays, 1.0), 0)


def _coherent(origins, directions):
    return _are_coherent(RayBatch(origins, directions, np.zeros(1), np.zeros(1)))


def test_what_is_coherent():
    straight = np.tile([0.1, -0.2, -1.0], (WIDTH, 1))
    assert _coherent(straight, straight)
    for change in ([0.1, -0.2, 1.0], [0.4, -0.2, -1.0], [0.1, -2.0, -1.0], [1.0, -0.2, -1.0]):
        for row in (0, 7, WIDTH - 1):
            other = straight.copy()
            other[row] = change
            assert not _coherent(straight, other), f"{change} in row {row}"
    assert not _coherent(straight, np.tile([1.0, 0.5, 1.0], (WIDTH, 1))), "two dominant axes"


@kernel
def _slopes_of_beam(directions, slopes, room):
    floats, doubles, integers = room
    rays = Prepared(pointer(floats), pointer(doubles), pointer(integers), None)
    for r in range(WIDTH):
        d = directions[r]
        prepare_ray(rays, r, Ray(0.0, 0.0, 0.0, d[0], d[1], d[2], 0.0, 0.0, -1.0), np.inf)
    beam = make_beam(rays)
    slopes[0], slopes[1], slopes[2], slopes[3] = beam.least_u, beam.most_u, beam.least_v, beam.most_v


@cases("axis", range(3))
def test_products_with_slopes_of_a_beam_along_an_axis_are_normal_numbers(axis):
    """Below them each takes a processor a hundred cycles: packets straight down took three times as long."""
    room = np.empty(GROUP_STRIDE, np.float32), np.empty(GROUP_STRIDE), np.empty(GROUP_STRIDE, np.int64)
    slopes = np.zeros(4, np.float32)
    for direction in (np.eye(3)[axis], -np.eye(3)[axis]):
        _slopes_of_beam(np.tile(direction, (WIDTH, 1)), slopes, room)
        assert (slopes[::2] < 0.0).all() and (slopes[1::2] > 0.0).all()
        assert (np.abs(slopes) * 2.0**-60 >= np.finfo(np.float32).tiny).all() and (np.abs(slopes) < 1e-9).all()


@kernel
def _meet_beam_and_rays(nodes, origins, directions, t_max, room):
    floats, doubles, integers = room
    rays, alone, limit = Prepared(pointer(floats), pointer(doubles), pointer(integers), None), 0, np.float32(0.0)
    for r in range(WIDTH):
        o, d = origins[r], directions[r]
        ray = Ray(o[0], o[1], o[2], d[0], d[1], d[2], 0.0, 0.0, -1.0)
        prepare_ray(rays, r, ray, t_max)
        largest = max(abs(d[0]), max(abs(d[1]), abs(d[2])))
        farthest = box_limit(t_max, largest)
        limit = max(limit, farthest)
        alone |= enter_boxes(nodes, 0, make_slabs(ray, largest), splat8(round_down(0.0)), splat8(farthest))[1]
    return movemask(enter_beam(pointer(nodes), 0, make_beam(rays), limit)[1]), alone


def _beam_and_rays(nodes, origins, directions, t_max):
    """The bits of the octants that the beam of sixteen rays meets, and those that any of them meets alone."""
    room = np.empty(GROUP_STRIDE, np.float32), np.empty(GROUP_STRIDE), np.empty(GROUP_STRIDE, np.int64)
    return _meet_beam_and_rays(nodes, origins, directions, t_max, room)


@cases("seed", range(6))
def test_a_beam_meets_every_box_that_one_of_its_rays_meets(seed):
    rng = np.random.default_rng(seed)
    met = missed = 0
    for _ in range(300):
        # On a coarse lattice, rays run along faces and through corners of boxes.
        corners = (rng.integers(-3, 4, (2, 8, 3)) / 4 if seed % 2 else rng.normal(size=(2, 8, 3))).astype(np.float32)
        node = np.zeros(NODE_WORDS, np.float32)
        node[:48] = np.stack([corners.min(axis=0).T, corners.max(axis=0).T], axis=1).ravel()
        slopes = rng.normal(size=3) * (rng.random(3) < 0.7) + rng.choice([0, 1e-7, 0.05], (WIDTH, 1)) * rng.normal(
            size=(WIDTH, 3)
        )
        directions = np.clip(slopes, -0.99, 0.99) * rng.choice([1e-40, 1.0, 1e30], (WIDTH, 1)) * (rng.random() < 0.9)
        axis, sign = rng.integers(3), rng.choice([-1.0, 1.0])
        directions[:, axis] = sign * np.maximum(np.abs(directions).max(axis=1) * 1.01, 1e-45)
        at = np.where(rng.random(3) < 0.5, *corners[:, rng.integers(8)].astype(float))
        origins = at - sign * rng.choice([0.0, 1.0, 50.0]) * directions / np.abs(directions[:, axis : axis + 1]) * sign
        origins += rng.choice([0.0, 1e-9, 0.1]) * rng.normal(size=(WIDTH, 3))
        t_max = np.inf if rng.random() < 0.5 else rng.uniform(0, 2) / np.abs(directions).max()
        bits, alone = _beam_and_rays(node, origins, directions, t_max)
        assert alone & ~bits == 0
        met, missed = met + alone.bit_count(), missed + 8 - bits.bit_count()
    # Both happen: the law is not kept by meeting nothing, nor by meeting everything.
    assert met > 400 and missed > 400
