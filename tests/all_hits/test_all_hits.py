"""All hits: against exact contacts, the laws that tie them to closest and any hits, and their memory and order."""

import threading

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import meshes, options, rays_at

from renderer import Mesh
from renderer.all_hits import all_hits as module
from renderer.all_hits.candidates import LISTED
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.octree import BruteForce, Octree
from validation.meshes import loose
from validation.oracle.contacts import contacts, hits

pytestmark = pytest.mark.judges(
    "AllHits", "AllHits.counts", "AllHits.normals", "AllHits.ray", "BruteForce.all_hits", "BruteForce.count_hits",
    "Octree.all_hits", "Octree.count_hits",
)  # fmt: skip


SEEDS = st.integers(0, 2**20)
BOTH = pytest.mark.parametrize("accelerator", [Octree, BruteForce])


def rounded(mesh, size):
    """A mesh whose corners are small integers: rays of small integers pass its edges and corners exactly."""
    return Mesh(np.round(mesh.vertices * size), mesh.faces)


def flattened(mesh):
    """Each side of a wall in one plane: the two stay two contacts, and rays in the plane meet neither."""
    return Mesh(np.floor(mesh.vertices / [1, 1, 2]), mesh.faces)


SOLIDS = {
    "box": box((-2, -2, -2), (2, 2, 2)),
    "nested": Mesh.concatenate([box((-2, -2, -2), (2, 2, 2)), box((-1, -1, -1), (1, 1, 1))]),
    "touching": Mesh.concatenate([box((-2, -2, -2), (0, 2, 2)), box((0, -2, -2), (2, 2, 2))]),
    "doubled": Mesh.concatenate([box((-2, -2, -2), (2, 2, 2)), box((-2, -2, -2), (2, 2, 2))]),
    "thin": flattened(Mesh.concatenate([box((-2, -2, -2), (2, 2, 2)), box((-1, -1, -2), (2, 2, 3))])),
    "star": rounded(icosphere(1), 4),
    "ring": rounded(torus(around=6, across=4), 3),
    "grid": rounded(grid(6, 6), 6),
    "soup": loose(rounded(icosphere(1), 3).triangles),
    "slivers": Mesh(
        [[0, 0, 0], [4, 0, 0], [2, 0, 0], [2, 3, 0], [2, -3, 1], [1, 1, 1], [1, 1, 1]],
        [[0, 1, 3], [0, 2, 1], [0, 4, 2], [2, 4, 1], [5, 6, 5], [5, 3, 6]],
    ),
}


def whole_rays(count, seed):
    """Rays of small integers whose slopes float64 holds exactly: sheared corners are not rounded."""
    rng = np.random.default_rng(seed)
    origins, directions = rng.integers(-6, 7, (count, 3)).astype(float), rng.integers(-4, 5, (count, 3)).astype(float)
    rows = np.arange(count)
    directions[rows, rng.integers(0, 3, count)] = rng.choice([-4.0, 4.0], count)
    directions[: count // 3] = np.where(np.abs(directions[: count // 3]) == 4.0, directions[: count // 3], 0.0)
    return origins, directions


@BOTH
@pytest.mark.parametrize("name", sorted(SOLIDS))
def test_contacts_and_hits_are_those_of_exact_arithmetic(name, accelerator):
    mesh = SOLIDS[name]
    origins, directions = whole_rays(150, len(name))
    queries = accelerator.from_mesh(mesh)
    met, each = queries.all_hits(origins, directions), queries.all_hits(origins, directions, contacts=False)
    for i, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        expected = contacts(mesh.vertices, mesh.faces, origin, direction)
        rows, all_rows = slice(*met.offsets[i : i + 2]), slice(*each.offsets[i : i + 2])
        # All numbers here are exact until the division, so t is rounded once and equal t are equal.
        assert [(float(c.t), c.faces[0]) for c in expected] == list(zip(met.t[rows], met.face[rows], strict=True))
        assert [face for _, face in hits(expected)] == each.face[all_rows].tolist()
    assert met.counts.max() > (0 if name == "grid" else 1) and (met.counts == 0).any()


def rows_of(found, i):
    return slice(found.offsets[i], found.offsets[i + 1])


def assert_laws(octree, brute, rays):
    """First row = closest hit, a row = any hit, rows sorted, contacts among the hits, octree = brute force, in bits."""
    closest, any_hit = octree.closest_hit(*rays), octree.any_hit(*rays)
    for merged in (True, False):
        found, other = octree.all_hits(*rays, contacts=merged), brute.all_hits(*rays, contacts=merged)
        for name in ("offsets", "t", "face", "u", "v"):
            assert getattr(found, name).tobytes() == getattr(other, name).tobytes(), name
        np.testing.assert_array_equal(found.counts > 0, any_hit)
        np.testing.assert_array_equal(found.counts, octree.count_hits(*rays, contacts=merged))
        first = found.offsets[:-1][any_hit]
        for name in ("t", "face", "u", "v"):
            assert getattr(found, name)[first].tobytes() == getattr(closest, name)[any_hit].tobytes(), name
        later = np.diff(found.ray) == 0
        t, face = found.t, found.face
        assert ((t[1:] > t[:-1]) | ((t[1:] == t[:-1]) & (face[1:] > face[:-1])))[later].all()
    each = set(zip(found.ray.tolist(), found.face.tolist(), strict=True))
    met = octree.all_hits(*rays)
    assert set(zip(met.ray.tolist(), met.face.tolist(), strict=True)) <= each


@settings(max_examples=300)
@given(meshes, options, SEEDS)
def test_laws(mesh, chosen, seed):
    rng = np.random.default_rng(seed)
    origins, directions = rays_at(*mesh, seed, 12)
    count = len(origins)
    bounds = [(0.0, np.inf), (0.3, 1.5), (rng.random(count), 2 * rng.random(count))][seed % 3]
    assert_laws(Octree(*mesh, **chosen), BruteForce(*mesh, threads=1), (origins, directions, *bounds))


@cases("scale", [1e-300, 1e-6, 1.0, 1e6, 1e150])
def test_laws_at_any_size(scale):
    rng = np.random.default_rng(1)
    for mesh in (icosphere(2), loose(torus(around=12, across=8).triangles)):
        mesh = Mesh(mesh.vertices * scale, mesh.faces)
        corners = mesh.triangles[rng.integers(0, len(mesh.faces), 600)]
        share = rng.choice([0.0, 0.3, 0.5, 1.0], (600, 1))
        targets = corners[:, 0] * share + corners[:, 1] * (1 - share)
        origins = 2 * scale * rng.normal(size=(600, 3))
        assert_laws(Octree.from_mesh(mesh), BruteForce.from_mesh(mesh), (origins, (targets - origins) / scale))


def test_rays_through_a_closed_mesh_pass_it_an_even_number_of_times():
    """At any of its edges and corners, from outside to outside. No ray comes near the ball's outline."""
    ball, rng = icosphere(3), np.random.default_rng(2)
    corners = ball.triangles[rng.integers(0, len(ball.faces), 20_000)]
    share = rng.choice([0.0, 0.25, 0.5, 1.0, rng.random()], (20_000, 1))
    targets = 0.9 * (corners[:, 0] * share + corners[:, 1] * (1 - share))
    origins = 3.0 * targets / np.linalg.norm(targets, axis=1)[:, None]
    for mesh in (ball, loose(ball.triangles)):
        assert (Octree.from_mesh(mesh).count_hits(origins, -origins) == 2).all()


@BOTH
def test_a_ray_at_a_corner_of_many_faces_has_one_contact(accelerator):
    count = 100_000 if accelerator is Octree else 1000
    angle = 2 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    faces = np.stack([np.full(count, count), np.arange(count), (np.arange(count) + 1) % count], axis=1)
    queries = accelerator(np.concatenate([rim, [[0, 0, 0]]]), faces)
    down = [[0.0, 0.0, 1.0]], [[0.0, 0.0, -1.0]]
    met = queries.all_hits(*down)
    assert met.counts.tolist() == [1] and met.face.tolist() == [0] and met.t.tolist() == [1.0]
    assert queries.count_hits(*down, contacts=False).tolist() == [count]


def test_one_ray_may_hit_more_than_the_memory_holds_at_first():
    count = 3 * module._CAPACITY + 5
    layers = np.tile([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], (count, 1))
    layers[:, 2] = np.repeat(np.random.default_rng(0).permutation(count), 3)
    octree = Octree(layers, np.arange(3 * count).reshape(-1, 3))
    origins = [[0.5, 0.5, -1.0], [9.0, 9.0, -1.0], [1.0, 1.0, -1.0]]
    met = octree.all_hits(origins, [[0, 0, 1]] * 3)
    assert met.counts.tolist() == [count, 0, count] == octree.count_hits(origins, [[0, 0, 1]] * 3).tolist()
    np.testing.assert_array_equal(met.t[:count], 1.0 + np.arange(count))
    np.testing.assert_array_equal(layers[3 * met.face, 2], np.tile(np.arange(count), 2))


def test_the_nearest_are_kept():
    octree, rng = Octree.from_mesh(torus(around=40, across=20)), np.random.default_rng(3)
    rays = 3 * rng.normal(size=(500, 3)), rng.normal(size=(500, 3))
    whole = octree.all_hits(*rays)
    for most in (1, 2, 3, 10**30):
        some = octree.all_hits(*rays, max_hits=most)
        np.testing.assert_array_equal(some.counts, np.minimum(whole.counts, min(most, 10**9)))
        for name in ("t", "face", "u", "v", "points", "normals"):
            kept = np.concatenate([getattr(whole, name)[rows_of(whole, i)][:most] for i in range(500)])
            np.testing.assert_array_equal(getattr(some, name), kept)


def test_the_same_bits_with_any_threads_and_any_cut():
    mesh, rng = torus(around=60, across=30), np.random.default_rng(4)
    rays = 2 * rng.normal(size=(20_000, 3)), rng.normal(size=(20_000, 3))
    whole = Octree.from_mesh(mesh, threads=1).all_hits(*rays)
    for threads in (2, 3):
        other = Octree.from_mesh(mesh, threads=threads).all_hits(*rays)
        assert all(getattr(whole, n).tobytes() == getattr(other, n).tobytes() for n in ("offsets", "t", "face", "u"))
    octree = Octree.from_mesh(mesh)
    parts = [octree.all_hits(rays[0][i : i + 7000], rays[1][i : i + 7000]) for i in range(0, 20_000, 7000)]
    assert np.concatenate([part.t for part in parts]).tobytes() == whole.t.tobytes()


def test_points_lie_on_their_faces_and_rays():
    octree, rng = Octree.from_mesh(icosphere(4)), np.random.default_rng(5)
    origins, directions = 2 * rng.normal(size=(2, 1000, 3))
    found = octree.all_hits(origins, directions)
    along = origins[found.ray] + found.t[:, None] * directions[found.ray]
    np.testing.assert_allclose(found.points, along, atol=1e-13 * 50)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0, rtol=1e-15)
    assert found.counts.sum() == len(found.t) == len(found.ray)


def test_nothing_met_and_nothing_asked():
    octree = Octree.from_mesh(box())
    for rays in (np.empty((0, 3)), np.full((5, 3), 9.0)):
        found = octree.all_hits(rays, rays)
        assert len(found.t) == 0 and found.points.shape == found.normals.shape == (0, 3)
        assert found.offsets.tolist() == [0] * (len(rays) + 1) and found.ray.dtype == np.int64
    assert Octree(np.empty((0, 3)), np.empty((0, 3), int)).count_hits([[0, 0, 0]], [[0, 0, 1]]).tolist() == [0]


@cases(
    ("options", "told"),
    [
        ({"max_hits": 0}, "max_hits: expected an integer >= 1 or None, got 0"),
        ({"max_hits": 1.5}, "max_hits: .* got 1.5"),
        ({"max_hits": True}, "max_hits: .* got True"),
        ({"contacts": 1}, "contacts: expected True or False, got 1"),
        ({"t_min": -1.0}, "t_min: .* row 0"),
    ],
)
def test_bad_input_is_told(options, told):
    with pytest.raises(ValueError, match=told):
        Octree.from_mesh(box()).all_hits([[0, 0, 0]], [[0, 0, 1]], **options)


def test_a_bad_ray_is_named_by_its_row():
    origins = np.zeros((30_000, 3))
    origins[29_990] = origins[20_001] = np.nan
    for query in (Octree.from_mesh(box()).all_hits, BruteForce.from_mesh(box()).count_hits):
        with pytest.raises(ValueError, match=r"origins: .* in row 20001$"):
            query(origins, np.ones((30_000, 3)))


def test_many_callers_while_one_refits():
    ball = icosphere(3)
    octree, stop, wrong = Octree.from_mesh(ball), threading.Event(), []

    def ask():
        origins = np.tile([[0.1, 0.2, 3.0]], (200, 1))
        while not stop.is_set():
            found = octree.all_hits(origins, [[0, 0, -1]] * 200)
            if len(np.unique(found.t.reshape(200, -1), axis=0)) != 1:
                wrong.append(found)

    askers = [threading.Thread(target=ask) for _ in range(3)]
    for asker in askers:
        asker.start()
    for i in range(30):
        octree.refit(ball.vertices * (1.0 + 0.1 * (i % 3)))
    stop.set()
    for asker in askers:
        asker.join()
    assert not wrong


@cases("count", [LISTED - 1, LISTED, LISTED + 1, LISTED + 2])
def test_a_ray_may_meet_as_many_blocks_as_are_listed_and_one_more(count):
    layers = np.tile([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], (count, 1))
    layers[:, 2] = np.repeat(np.arange(count), 3)
    octree = Octree(layers, np.arange(3 * count).reshape(-1, 3), leaf_size=1)
    assert octree.stats.blocks == count
    met = octree.all_hits([[0.5, 0.5, -1.0]] * 2, [0, 0, 1])
    assert met.counts.tolist() == [count, count] and met.face.tolist() == [*range(count)] * 2


def test_normals_are_those_of_the_faces_windings():
    found = Octree.from_mesh(box()).all_hits([[0.5, 0.25, 3.0]], [[0, 0, -1]])
    assert found.normals.tolist() == [[0, 0, 1], [0, 0, -1]]


@BOTH
def test_the_interval_is_closed_at_both_ends(accelerator):
    """A ray that enters a box at t = 7 and leaves it at 11, to rounding."""
    octree = accelerator.from_mesh(box((-2, -2, -2), (2, 2, 2)))
    ray = [[-9, 0.1, 0.2]], [[1, 0, 0]]
    near, far = octree.all_hits(*ray).t
    assert (near, far) == pytest.approx((7, 11), rel=2.0**-50)
    before, after = np.nextafter([near, far], 0), np.nextafter([near, far], np.inf)
    for t_min, t_max, found in (
        (near, far, [near, far]), (0, near, [near]), (0, before[0], []), (after[0], far, [far]),
        (after[0], before[1], []), (far, far, [far]), (after[1], 99, []),
    ):  # fmt: skip
        assert octree.all_hits(*ray, t_min, t_max).t.tolist() == found
        assert octree.count_hits(*ray, t_min, t_max).tolist() == [len(found)]


@BOTH
def test_the_interval_is_closed_for_a_ray_that_meets_more_than_is_listed(accelerator):
    """Flat boxes, each entered where its hit lies: a search whose interval was four millionths short lost an end. One
    millionth is less than boxes are padded by.
    """
    sheet = grid(8, 8)
    sheets = 3 * LISTED
    vertices = np.concatenate([sheet.vertices + np.array([0.0, y, 0.0]) for y in range(sheets)])
    faces = np.concatenate([sheet.faces + y * len(sheet.vertices) for y in range(sheets)])
    octree = accelerator(vertices, faces)
    ray = [[0.3, sheets + 0.7, 0.2]], [[0, -1, 0]]
    t = octree.all_hits(*ray).t
    assert t == pytest.approx(np.arange(sheets) + 1.7, rel=2.0**-50)
    for first, last in ((0, sheets - 1), (3, sheets - 4), (LISTED, sheets - 2)):
        assert octree.all_hits(*ray, t[first], t[last]).t.tolist() == t[first : last + 1].tolist()


@pytest.mark.parametrize("accelerator", [Octree, BruteForce])
def test_all_faces_of_a_pile_are_hit_where_a_ray_starts_in_their_midst(accelerator):
    """Four sheets in one plane and two in a lower one, in a mixed order and turned both ways."""
    sheet = np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0]])
    heights = [0.0, -1.0, 0.0, 0.0, -1.0, 0.0]
    vertices = np.concatenate([sheet + np.array([0.0, 0.0, z]) for z in heights])
    faces = np.arange(18).reshape(6, 3)
    faces[::2] = faces[::2, ::-1]
    queries = accelerator(vertices, faces)
    down = [[0.25, -0.125, -1.0]]
    met = queries.closest_hit([[2.0, 3.0, 5.0]], down)
    assert met.face == [0]

    # One after the other, the lowest first, and each once.
    def chain(met):
        while met.hit[0]:
            yield int(met.face[0])
            met = queries.closest_hit(met.points, down, leaving=met.through())

    assert list(chain(met)) == [0, 2, 3, 5, 1, 4]
    # A ray that was turned back and comes again to the pile begins with the one that it left.
    for left, expected in ((met, [0, 2, 3, 5, 1, 4]), (met.through(), [2, 3, 5, 1, 4])):
        found = queries.all_hits(met.points, down, leaving=left, contacts=False)
        assert found.face.tolist() == expected
        np.testing.assert_allclose(found.t, -np.array(heights)[expected], rtol=1e-12)
        assert queries.count_hits(met.points, down, leaving=left, contacts=False) == [len(expected)]


def test_a_ray_from_a_corner_along_an_edge_has_one_contact_there():
    """Of the corner's three faces, whose planes the ray is in, or nearly so."""
    rng = np.random.default_rng(7)
    for _ in range(300):
        corners = rng.normal(size=(4, 3))
        start, end = corners[rng.permutation(4)[:2]]
        for queries in (Octree, BruteForce):
            tetrahedron = queries(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], threads=1)
            assert tetrahedron.all_hits(start, end - start, t_max=0.0).counts == 1
