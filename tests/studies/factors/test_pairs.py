"""Pairs of known exchange: rooms whose rows sum to one, and rays that must not be hidden."""

import numpy as np
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import all_pairs, areas_of, box, mesh_of, panel, seen_shares, turned

from renderer import BruteForce, Octree
from renderer.mesh.shapes import icosphere
from renderer.studies.factors.pairs import exact_pairs

FLOOR = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
CEILING = np.array([[0, 0, 1], [0, 1, 1], [1, 0, 1]], float)


def known_of(triangles, pairs=None, kind=Octree, **options):
    pairs = all_pairs(len(triangles)) if pairs is None else pairs
    return pairs, *exact_pairs(kind(mesh_of(triangles)), pairs, 2, **options)


def sums(count, pairs, exchange):
    """The sum of each row."""
    return np.bincount(pairs.ravel(), np.repeat(exchange, 2), minlength=count)


@cases("size, count, seed", [(1.0, 1, 0), (1.0, 3, 0), (1.0, 3, 1), (1e-25, 2, 2), (1e22, 2, 3)])
def test_all_pairs_of_a_room_are_known_and_rows_sum_to_one(size, count, seed):
    triangles = size * np.concatenate(box((0, 0, 0), (3, 2, 1), count, True))
    triangles = triangles if seed == 0 else size * turned(triangles / size, seed)
    pairs, exchange, known = known_of(triangles)
    assert known.all()
    walls = np.arange(len(triangles)) // (2 * count * count)
    same = walls[pairs[:, 0]] == walls[pairs[:, 1]]
    assert (exchange[same] == 0).all() and (exchange[~same] > 0).all()
    np.testing.assert_allclose(sums(len(triangles), pairs, exchange), areas_of(triangles), rtol=1e-11)
    _, again, known = known_of(triangles, kind=BruteForce)
    assert known.all() and (again == exchange).all()


def test_a_room_moved_far_away():
    """Corners have lost digits there, by which walls bend."""
    triangles = turned(np.concatenate(box((0, 0, 0), (3, 2, 1), 3, True)), 4)
    triangles = np.add(triangles, [5e5, 4e6, 100])
    pairs, exchange, known = known_of(triangles)
    assert known.all()
    np.testing.assert_allclose(sums(len(triangles), pairs, exchange), areas_of(triangles), rtol=1e-7)


@cases("seed", [0, 1, 2])
def test_a_room_with_slender_patches(seed):
    triangles = np.concatenate(box((0, 0, 0), (1, 40, 0.02), 2, True))
    triangles = turned(triangles, seed) if seed else triangles
    pairs, exchange, known = known_of(triangles)
    assert known.all()
    np.testing.assert_allclose(sums(len(triangles), pairs, exchange), areas_of(triangles), rtol=1e-9)


def test_a_sphere_from_within():
    ball = icosphere(2)
    triangles = ball.triangles[:, ::-1]
    pairs, exchange, known = known_of(triangles)
    assert known.all() and (exchange > 0).all()
    np.testing.assert_allclose(sums(len(triangles), pairs, exchange), areas_of(triangles), rtol=1e-11)


def test_a_sphere_from_without_does_not_see_itself():
    _, exchange, known = known_of(icosphere(2).triangles)
    assert known.all() and (exchange == 0).all()


def furnished(seed):
    """A room with a box that stands on the floor, one in the air, and a screen."""
    shell = box((0, 0, 0), (4, 3, 2.5), 3, True)
    table = box((1, 1, 0), (2, 1.5, 0.75), 1, False)[1:]
    lamp = box((2.5, 1, 1.5), (2.75, 1.25, 1.75), 1, False)
    screen = [panel((3, 0, 0), (0, 1.5, 0), (0, 0, 1.5), 1), panel((3, 0, 0), (0, 0, 1.5), (0, 1.5, 0), 1)]
    triangles = np.concatenate([*shell, *table, *lamp, *screen])
    return turned(triangles, seed) if seed else triangles


@cases("seed", [0, 1])
def test_a_furnished_room(seed):
    """No ray of a known pair is hidden; nearly all pairs none of whose rays is hidden are known."""
    rng, triangles = np.random.default_rng(seed), furnished(seed)
    pairs, exchange, known = known_of(triangles)
    before, seen = seen_shares(Octree(mesh_of(triangles)), triangles, pairs, 40, rng)
    whole = seen == before
    assert whole[known & (exchange > 0)].all()
    assert (before[known & (exchange == 0)] == 0).all()
    assert known[whole].mean() > 0.97 and 0.2 < known.mean() < 0.95
    assert (exchange[~known] == 0).all()


def test_a_screen_in_the_way_leaves_nothing_known():
    """Whole, in part, and by a corner just inside the hull; not if it only touches the hull or stands beside."""
    screens = {
        "whole": ([[-9, -9, 0.5], [9, -9, 0.5], [0, 9, 0.5]], False),
        "in part": ([[0.2, 0.2, 0.5], [9, -9, 0.5], [9, 9, 0.5]], False),
        "a corner": ([[0.499, 0.499, 0.5], [9, 8, 0.5], [8, 9, 0.5]], False),
        "a needle": ([[0.2, 0.2, 0.5], [0.2 + 1e-9, 0.2, 0.5], [9, 9, 0.5]], False),
        "touches": ([[0.5, 0.5, 0.5], [9, 8, 0.5], [8, 9, 0.5]], True),
        "touches a side": ([[0, -9, -9], [0, 9, -9], [0, 0, 9]], True),
        "beside": ([[0.501, 0.501, 0.5], [9, 8, 0.5], [8, 9, 0.5]], True),
    }
    # A face whose own plane cuts the hull, beside the upright edge of the hull at the origin: only across both edges.
    edge, out = np.array([[1, -1, 1], [-1, 1, 0], [-5, -5, 0.5]]), np.array([-1e-6, -1e-6, 0])
    screens |= {"past": (edge + out, True), "on": (edge, True), "through": (edge - out, False)}
    for name, (screen, clear) in screens.items():
        for seed in range(4):
            triangles = np.stack([FLOOR, CEILING, np.array(screen, float)])
            triangles = turned(triangles, seed) if seed else triangles
            _, exchange, known = known_of(triangles, np.array([[0, 1]]))
            assert known[0] == clear and (exchange[0] > 0) == clear, name


def test_a_face_on_top_of_another_is_not_overlooked():
    """A cover at no distance, or less than rounding, hides all; faces beside, in the same plane, hide nothing."""
    big = np.array([[-3, -3, 0], [9, -3, 0], [-3, 9, 0]], float)
    for height in (0.0, 1e-17, 1e-16, 1e-14, 1e-9, 1e-3, -1e-16):
        for cover in (FLOOR, big, big[::-1], FLOOR * 0.5 + 0.1 * np.array([1, 1, 0])):
            for seed in range(3):
                triangles = np.stack([FLOOR, CEILING, np.add(cover, [0, 0, height])])
                triangles = turned(triangles, seed) if seed else triangles
                _, _, known = known_of(triangles, np.array([[0, 1]]))
                assert not known[0], (height, cover, seed)
    for beside in (
        np.add(FLOOR, [1, 0, 0]),
        np.add(FLOOR, [0, 1, 0])[::-1],
        [[1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 0, 0], [9, -9, 0], [9, 0, 0]],
    ):
        for seed in range(3):
            triangles = np.stack([FLOOR, CEILING, np.array(beside, float)])
            triangles = turned(triangles, seed) if seed else triangles
            assert known_of(triangles, np.array([[0, 1]]))[2][0], (beside, seed)


def test_a_face_across_the_plane_of_the_other_exchanges_with_its_front_alone():
    wall = np.array([[-0.5, 0, -1], [-0.5, 1, -1], [-0.5, 0.5, 1]], float)
    part = np.array([[-0.5, 0.25, 0], [-0.5, 0.75, 0], [-0.5, 0.5, 1]], float)
    for seed in range(3):
        both = np.stack([FLOOR, wall, part])
        both = turned(both, seed) if seed else both
        (whole,), known = known_of(both[:2])[1:]
        (front,), also = known_of(both[[0, 2]])[1:]
        assert known.all() and also.all()
        np.testing.assert_allclose(whole, front, rtol=1e-11)


def test_both_sides():
    (right,), _ = known_of(np.stack([FLOOR, CEILING]))[1:]
    for first in (FLOOR, FLOOR[::-1]):
        for second in (CEILING, CEILING[::-1]):
            (exchange,), known = known_of(np.stack([first, second]), both=True)[1:]
            assert (known.all() and exchange == np.float64(right)) or abs(exchange / right - 1) < 1e-14
    (exchange,), known = known_of(np.stack([FLOOR, CEILING[::-1]]))[1:]
    assert known.all() and exchange == 0


def test_bits_do_not_depend_on_threads_or_on_other_pairs():
    triangles = furnished(1)
    octree, pairs = Octree(mesh_of(triangles)), all_pairs(len(triangles))
    done = []
    exchange, known = exact_pairs(octree, pairs, 1, done.append)
    assert sum(done) == len(pairs)
    for threads, order in (
        (4, np.arange(len(pairs))),
        (2, np.arange(len(pairs))[::-1]),
        (3, np.arange(0, len(pairs), 7)),
    ):
        some, also = exact_pairs(octree, pairs[order], threads)
        assert (some == exchange[order]).all() and (also == known[order]).all()


def soup(rng, count, kind):
    """Triangles at random: loose, on a lattice, needles, or a thin shell of pairs back to back."""
    if kind == "lattice":
        triangles = rng.integers(0, 4, (4 * count, 3, 3)).astype(float)
        return triangles[areas_of(triangles) > 0][:count]
    triangles = 2 * rng.normal(size=(count, 1, 3)) + rng.normal(size=(count, 3, 3))
    if kind == "needles":
        triangles[::2, 2] = (
            triangles[::2, 1] + 10.0 ** rng.uniform(-12, -2, (len(triangles[::2]), 1)) * triangles[::2, 2]
        )
    if kind == "shells":
        half = triangles[: count // 2]
        depth = 10.0 ** rng.uniform(-18, -3, (len(half), 1, 1))
        from rooms import normals_of

        return np.concatenate([half, (half - depth * normals_of(half)[:, None])[:, ::-1]])
    return triangles


@given(st.integers(0, 10**6), st.sampled_from(["loose", "lattice", "needles", "shells"]), st.integers(2, 14))
@settings(max_examples=200)
def test_no_ray_of_a_known_pair_is_hidden(seed, kind, count):
    rng = np.random.default_rng(seed)
    triangles = soup(rng, count, kind)
    if len(triangles) < 2:
        return
    pairs, exchange, known = known_of(triangles)
    before, seen = seen_shares(Octree(mesh_of(triangles)), triangles, pairs, 100, rng)
    assert (seen == before)[known].all()
    assert (before[known & (exchange == 0)] == 0).all()
