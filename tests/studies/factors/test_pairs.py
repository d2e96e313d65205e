"""Pairs of known exchange: rooms whose rows sum to one, what each face sees of the other, and what has no bearing."""

import numpy as np
from cases import cases
from rooms import CEILING, FLOOR, all_pairs, areas_of, box, furnished, known_of, mesh_of, turned

from renderer import BruteForce, Octree
from renderer.mesh.shapes import icosphere
from renderer.studies.factors.pairs import exact_pairs


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


def test_faces_in_one_plane_exchange_nothing_unless_they_lie_on_each_other():
    for seed in range(3):
        for way, known in (((1, 0, 0), True), ((0, -1, 0), True), ((0.7, 0.7, 0), True), ((0.4, 0.4, 0), False)):
            for turn in (1, -1):
                triangles = np.stack([FLOOR, np.add(FLOOR, way)[::turn]])
                triangles = turned(triangles, seed) if seed else triangles
                for both in (False, True):
                    _, exchange, got = known_of(triangles, both=both)
                    assert got[0] == (known or (turn == 1 and not both)) and exchange[0] == 0


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
    exchange, known = exact_pairs(octree._built, pairs, 1, done.append)
    assert sum(done) == len(pairs)
    for threads, order in (
        (4, np.arange(len(pairs))),
        (2, np.arange(len(pairs))[::-1]),
        (3, np.arange(0, len(pairs), 7)),
    ):
        some, also = exact_pairs(octree._built, pairs[order], threads)
        assert (some == exchange[order]).all() and (also == known[order]).all()
