"""The proof that nothing lies between two faces: rays and linear programming look for what it overlooks or misses."""

import numpy as np
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import (
    CEILING,
    FLOOR,
    all_pairs,
    areas_of,
    box,
    furnished,
    known_of,
    mesh_of,
    normals_of,
    seen_shares,
    turned,
)  # fmt: skip
from scipy.optimize import linprog

from renderer import Octree


@cases("seed", [0, 1])
def test_a_furnished_room(seed):
    """No ray of a known pair is hidden, and linear programming finds a face in the way of all others."""
    rng, triangles = np.random.default_rng(seed), furnished(seed)
    pairs, exchange, known = known_of(triangles, rng.permutation(all_pairs(len(triangles)))[:1500])
    before, seen = seen_shares(Octree(mesh_of(triangles)), triangles, pairs, 60, rng)
    assert (seen == before)[known].all() and 0.3 < (known & (exchange > 0)).mean() < 0.5
    assert (before[known & (exchange == 0)] == 0).all() and (exchange[~known] == 0).all()
    whole = (seen == before) & (before == 60)
    for pair in pairs[whole & ~known]:
        assert some_face_enters(triangles, pair)
    for pair in pairs[whole & known][:2]:
        assert not some_face_enters(triangles, pair)
    assert len(pairs[whole & ~known]) > 5


def some_face_enters(triangles, pair):
    """By linear programming: whether no plane parts some face from the pair's hull, made a little smaller."""
    corners = triangles[pair].reshape(-1, 3)
    middle = corners.mean(axis=0)
    hull = middle + (1 - 1e-4) * (corners - middle)
    others = np.delete(triangles, pair, axis=0)
    return any(not are_parted(hull, face) for face in sorted(others, key=lambda face: _far(face, middle)))


def _far(face, middle):
    return np.linalg.norm(face.mean(axis=0) - middle)


def are_parted(first, second):
    """Whether n, d and m > 0 are such that n . x <= d - m for the first corners and n . x >= d + m for the others."""
    rows = np.vstack(
        [np.c_[first, -np.ones(len(first)), np.ones(len(first))], np.c_[-second, np.ones((len(second), 2))]]
    )
    bounds = [(-1, 1)] * 3 + [(None, None), (0, None)]
    return linprog([0, 0, 0, 0, -1], rows, np.zeros(len(rows)), bounds=bounds).x[4] > 1e-9


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
    # A large face, of which the hull has one corner in its midst: only across the face itself.
    normal = np.array([1.0, -0.4, 0.7])
    sides = np.array([[0.4, 1, 0], [0.7, 0, -1], [-1.1, -1, 1]]) * 5
    tangent = np.array([1, 0, 1]) + sides
    screens |= {
        "before": (tangent + 1e-6 * normal, True),
        "at": (tangent, True),
        "in": (tangent - 1e-6 * normal, False),
    }
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


@given(st.integers(0, 10**6), st.floats(0.1, 0.5), st.booleans())
@settings(max_examples=40)
def test_blocks_that_touch(seed, share, is_turned):
    """Cubes at random places of a lattice: their faces share edges and corners, and lie in few planes."""
    rng = np.random.default_rng(seed)
    full = np.zeros((5, 5, 5), np.bool_)
    full[1:-1, 1:-1, 1:-1] = rng.random((3, 3, 3)) < share
    ways = ((0, 0, -1), (0, 0, 1), (-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0))
    sides = [
        side
        for place in np.argwhere(full)
        for side, way in zip(box(place, place + 1, 1, False), ways, strict=True)
        if not full[tuple(place + way)]
    ]
    if not sides:
        return
    triangles = np.concatenate(sides)
    triangles = turned(triangles, seed) if is_turned else triangles
    pairs, exchange, known = known_of(triangles, rng.permutation(all_pairs(len(triangles)))[:600])
    before, seen = seen_shares(Octree(mesh_of(triangles)), triangles, pairs, 60, rng)
    assert (seen == before)[known].all()
    assert (before[known & (exchange == 0)] == 0).all()
    whole = (seen == before) & (before == 60)
    assert all(some_face_enters(triangles, pair) for pair in pairs[whole & ~known][:2])
    assert known[before == 0].mean() > 0.97
