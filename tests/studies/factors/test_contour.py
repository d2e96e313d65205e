"""The exchange of two polygons in full view: closed forms, integration by another program, and laws."""

from itertools import product
from math import factorial

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss
from scipy.integrate import dblquad
from scipy.spatial.transform import Rotation

from renderer.studies.factors.contour import RULES, exchange_between

# What is reached where no face is a needle or seen edge-on.
RELATIVE = 1e-11


def exchange(first, second):
    first, second = (np.ascontiguousarray(polygon, np.float64) for polygon in (first, second))
    return exchange_between(first, second, RULES)


def halves(corners):
    """The two triangles of a quadrilateral."""
    return [corners[[0, 1, 2]], corners[[0, 2, 3]]]


def of_triangles(first, second):
    return sum(exchange(a, b) for a, b in product(halves(first), halves(second)))


def rectangle(x, y):
    return np.array([[0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0]], float)


def facing(x, y, distance):
    """Two equal rectangles that face each other."""
    return rectangle(x, y), np.add(rectangle(x, y), [0, 0, distance])[::-1].copy()


def at_an_edge(length, depth, height):
    """A floor and a wall that share an edge along y."""
    floor = rectangle(depth, length)
    wall = np.array([[0, 0, 0], [0, length, 0], [0, length, height], [0, 0, height]], float)
    return floor, wall


def parallel(a, b, c):
    """Howell C-11, times the area."""
    x, y = a / c, b / c
    u, v = np.hypot(1, x), np.hypot(1, y)
    terms = np.log(u * v / np.sqrt(1 + x * x + y * y)) + x * v * np.arctan(x / v) + y * u * np.arctan(y / u)
    return 2 / (np.pi * x * y) * (terms - x * np.arctan(x) - y * np.arctan(y)) * a * b


def perpendicular(length, depth, height):
    """Howell C-14 of the floor, times its area."""
    h, w = height / length, depth / length
    a, b, c = h * h, w * w, 1 + h * h + w * w
    logs = (
        np.log((1 + b) * (1 + a) / c)
        + b * np.log(b * c / ((1 + b) * (a + b)))
        + a * np.log(a * c / ((1 + a) * (a + b)))
    )
    angles = w * np.arctan(1 / w) + h * np.arctan(1 / h) - np.hypot(h, w) * np.arctan(1 / np.hypot(h, w))
    return (angles + logs / 4) / (np.pi * w) * depth * length


def integrated(first, second):
    """By scipy: the integral over the first triangle of Lambert's formula for a point and a polygon."""
    a, b, c = first
    normal = np.cross(b - a, c - a)
    unit = normal / np.linalg.norm(normal)

    def seen(v, u):
        rays = second - (a + u * (b - a) + v * (c - a))
        rays = rays / np.linalg.norm(rays, axis=1)[:, None]
        total = 0.0
        for p, q in zip(rays, np.roll(rays, -1, axis=0), strict=True):
            across = np.cross(p, q)
            sine = np.linalg.norm(across)
            total -= np.arctan2(sine, p @ q) * (across @ unit) / sine
        return total / (2 * np.pi)

    return dblquad(seen, 0, 1, 0, lambda u: 1 - u, epsabs=1e-13, epsrel=1e-12)[0] * np.linalg.norm(normal)


def turned(polygons, rng, size=1.0):
    """Polygons turned, moved and scaled together."""
    matrix, way = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    return [size * (polygon @ matrix.T + way) for polygon in polygons]


def seen_whole(rng, distance=1.0):
    """Two triangles before each other's planes."""
    while True:
        first, second = rng.normal(size=(2, 3, 3))
        second += distance * 3 * rng.normal(size=3)
        pair = []
        for one, other in ((first, second), (second, first)):
            normal = np.cross(one[1] - one[0], one[2] - one[0])
            heights = (other - one[0]) @ (normal / np.linalg.norm(normal))
            pair.append(one if heights.max() > 0 else one[::-1].copy())
            if (
                heights.min() * heights.max() <= 0
                or np.abs(heights).min() < 0.05 * np.linalg.norm(other - one, axis=1).max()
            ):
                break
        else:
            return pair


def test_rules_integrate_what_they_should():
    """Gauss-Legendre as numpy has it; on triangles, all monomials up to the degree, by a! b! / (a + b + 2)!."""
    nodes, weights = leggauss(12)
    np.testing.assert_allclose(RULES[:24:2], (nodes + 1) / 2, rtol=0, atol=1e-15)
    np.testing.assert_allclose(RULES[1:24:2], weights / 2, rtol=0, atol=1e-15)
    for begin, count, degree in ((24, 7, 5), (52, 16, 8)):
        rule = RULES[begin : begin + 4 * count].reshape(-1, 4)
        np.testing.assert_allclose(rule[:, :3].sum(axis=1), 1, rtol=0, atol=1e-14)
        for a, b in product(range(degree + 1), repeat=2):
            if a + b <= degree:
                right = factorial(a) * factorial(b) / factorial(a + b + 2)
                got = (rule[:, 3] * rule[:, 1] ** a * rule[:, 2] ** b).sum() / 2
                assert got == pytest.approx(right, rel=0, abs=1e-15), (degree, a, b)
    assert len(RULES) == 52 + 64


def test_known_values_of_squares():
    assert of_triangles(*facing(1, 1, 1)) == pytest.approx(0.19982489569838746, rel=1e-13)
    assert of_triangles(*at_an_edge(1, 1, 1)) == pytest.approx(0.20004377607540316, rel=1e-13)
    assert exchange(*facing(1, 1, 1)) == pytest.approx(0.19982489569838746, rel=1e-13)
    assert exchange(*at_an_edge(1, 1, 1)) == pytest.approx(0.20004377607540316, rel=1e-13)


@cases("x, y, distance", [(1, 2, 0.1), (3, 0.2, 1), (1, 1, 0.01), (10, 10, 0.5), (0.1, 0.1, 1)])
def test_parallel_rectangles(x, y, distance):
    assert of_triangles(*facing(x, y, distance)) == pytest.approx(parallel(x, y, distance), rel=RELATIVE)


@cases("length, depth, height", [(1, 2, 0.1), (3, 0.2, 1), (1, 1, 0.01), (10, 1, 0.5), (0.1, 1, 1)])
def test_rectangles_that_share_an_edge(length, depth, height):
    right = perpendicular(length, depth, height)
    assert of_triangles(*at_an_edge(length, depth, height)) == pytest.approx(right, rel=RELATIVE)


def test_rows_of_a_turned_cube_sum_to_one():
    rng = np.random.default_rng(1)
    corners = np.array(list(product((0.0, 1.0), repeat=3)))
    # Seen from within.
    sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    for size in (1e-30, 1.0, 1e20):
        triangles = [half for side in turned([corners[side] for side in sides], rng, size) for half in halves(side)]
        for i, one in enumerate(triangles):
            row = sum(exchange(one, other) for j, other in enumerate(triangles) if j // 2 != i // 2)
            assert row / (size * size) == pytest.approx(0.5, rel=1e-12)


@given(st.integers(0, 10**6), st.sampled_from([0.3, 1.0, 5.0]))
@settings(max_examples=12)
def test_it_agrees_with_integration_by_scipy(seed, distance):
    first, second = seen_whole(np.random.default_rng(seed), distance)
    assert exchange(first, second) == pytest.approx(integrated(first, second), rel=1e-9)


@given(st.integers(0, 10**6))
def test_reciprocity_turns_and_scales_change_nothing(seed):
    rng = np.random.default_rng(seed)
    first, second = seen_whole(rng, 10.0 ** rng.uniform(-0.5, 3))
    right = exchange(first, second)
    assert exchange(second, first) == pytest.approx(right, rel=RELATIVE)
    assert exchange(np.roll(first, 1, axis=0), np.roll(second, 2, axis=0)) == pytest.approx(right, rel=RELATIVE)
    assert exchange(first[::-1].copy(), second) == pytest.approx(-right, rel=RELATIVE)
    size = 10.0 ** rng.uniform(-20, 20)
    assert exchange(*turned([first, second], rng, size)) / size**2 == pytest.approx(right, rel=1e-10)


@given(st.integers(0, 10**6))
def test_parts_add_up(seed):
    """A triangle cut in two, at a corner or across."""
    rng = np.random.default_rng(seed)
    first, second = seen_whole(rng, 10.0 ** rng.uniform(-0.5, 2))
    a, b, c = first
    p, q = a + rng.random() * (b - a), a + rng.random() * (c - a)
    right = exchange(first, second)
    assert exchange([a, p, c], second) + exchange([p, b, c], second) == pytest.approx(right, rel=RELATIVE)
    assert exchange([a, p, q], second) + exchange([p, b, c, q], second) == pytest.approx(right, rel=RELATIVE)


@given(st.integers(0, 10**6), st.floats(0.05, 3.0))
def test_triangles_that_share_an_edge(seed, angle):
    """Cut at a point of the shared edge: then one touches at a corner, at an inner point, and along a part."""
    rng = np.random.default_rng(seed)
    edge = np.array([[0, 0, 0], [1, 0, 0]], float)
    share, at = rng.random(), np.add(rng.normal(size=(2, 2)), [0, 1.5])
    first = np.array([edge[0], edge[1], [at[0, 0], abs(at[0, 1]) + 0.1, 0]])
    far = (abs(at[1, 1]) + 0.1) * np.array([np.cos(angle), np.sin(angle)])
    second = np.array([edge[1], edge[0], [at[1, 0], *far]])
    right = exchange(first, second)
    assert 0 < right < min(area(first), area(second))
    p = edge[0] + share * edge[1]
    parts = [np.array([p, edge[1], first[2]]), np.array([edge[0], p, first[2]])]
    others = [np.array([edge[1], p, second[2]]), np.array([p, edge[0], second[2]])]
    assert sum(exchange(part, second) for part in parts) == pytest.approx(right, rel=RELATIVE)
    assert sum(exchange(a, b) for a in parts for b in others) == pytest.approx(right, rel=RELATIVE)


@given(st.integers(0, 10**6))
def test_triangles_that_share_a_corner_are_like_their_halves(seed):
    """Both halved about the corner have a quarter of the exchange; the rest is among parts that do not touch."""
    rng = np.random.default_rng(seed)
    first, second = (np.array([[0, 0, 0], *rng.normal(size=(2, 3))]) for _ in range(2))
    second[1:, 2] += 3
    normal = np.cross(first[1], first[2])
    first = first if (second[1:] @ normal).mean() > 0 else first[[0, 2, 1]]
    normal = np.cross(second[1], second[2])
    second = second if (first[1:] @ normal).mean() > 0 else second[[0, 2, 1]]
    if (
        min((second[1:] @ np.cross(first[1], first[2])).min(), (first[1:] @ np.cross(second[1], second[2])).min())
        < 0.05
    ):
        return
    rest = [np.array([one[1] / 2, one[1], one[2], one[2] / 2]) for one in (first, second)]
    right = exchange(first / 2, rest[1]) + exchange(rest[0], second / 2) + exchange(*rest)
    assert exchange(first, second) * 3 / 4 == pytest.approx(right, rel=RELATIVE)


@cases("distance", [30.0, 1e2, 1e3, 1e4, 1e8])
def test_far_apart(distance):
    """Far away, cosines by distance squared; the next term, of the second moments, is below the tolerance at 1e8."""
    rng = np.random.default_rng(int(distance))
    for _ in range(20):
        first, second = seen_whole(rng, 1.0)
        second = second + distance * _before(first, second)
        if _heights(first, second).min() <= 0:
            continue
        parts = sum(exchange(a, b) for a in quarters(first) for b in quarters(second))
        assert exchange(first, second) == pytest.approx(parts, rel=1e-11)
        way = second.mean(axis=0) - first.mean(axis=0)
        n, m = (np.cross(one[1] - one[0], one[2] - one[0]) / 2 for one in (first, second))
        point = -(n @ way) * (m @ way) / (way @ way) ** 2 / np.pi
        assert exchange(first, second) == pytest.approx(point, rel=max(1e-11, 1e3 / distance**2))


@given(st.integers(0, 10**6), st.sampled_from([0.0099, 0.015, 0.039, 0.05, 0.079, 0.19]))
@settings(max_examples=200)
def test_rules_are_used_only_where_they_are_exact(seed, share):
    """Parts add up: their shares are a quarter, so that they err by less. Over contours, more is lost by rounding."""
    rng = np.random.default_rng(seed)
    first, second = rng.normal(size=(2, 3, 3))
    first, second = (corners - corners.mean(axis=0) for corners in (first, second))
    reach = sum(np.linalg.norm(corners, axis=1).max() for corners in (first, second))
    way = rng.normal(size=3)
    second = second + way / np.linalg.norm(way) * reach / share
    n, m = (np.cross(one[1] - one[0], one[2] - one[0]) for one in (first, second))
    first, second = first if n @ way > 0 else first[::-1], second if m @ way < 0 else second[::-1]
    if min(abs(n @ way) / np.linalg.norm(n), abs(m @ way) / np.linalg.norm(m)) < 0.3 * np.linalg.norm(way):
        return
    cut = [[part for half in quarters(corners) for part in quarters(half)] for corners in (first, second)]
    parts, rounding = sum(exchange(a, b) for a, b in product(*cut)), 0.0 if share < 0.08 else 2e-15 * reach * reach
    assert exchange(first, second) == pytest.approx(parts, rel=3e-12, abs=rounding)


def _before(first, second):
    """A direction away from the first triangle that both see."""
    n, m = (np.cross(one[1] - one[0], one[2] - one[0]) for one in (first, second))
    return (lambda way: way / np.linalg.norm(way))(n / np.linalg.norm(n) - m / np.linalg.norm(m))


def _heights(first, second):
    n, m = (np.cross(one[1] - one[0], one[2] - one[0]) for one in (first, second))
    return np.concatenate([(second - first[0]) @ n, (first - second[0]) @ m])


def quarters(corners):
    a, b, c = corners
    p, q, r = (b + c) / 2, (c + a) / 2, (a + b) / 2
    return [np.array(part) for part in ([a, r, q], [r, b, p], [q, p, c], [p, q, r])]


def area(corners):
    return np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) / 2


@cases("thin", [1e-2, 1e-4, 1e-6])
def test_needles(thin):
    """A low wall: to the square of the sides it errs as little as a high one; the formula loses as many digits."""
    floor, wall = at_an_edge(1, 1, thin)
    right = of_triangles(floor, wall)
    assert right == pytest.approx(perpendicular(1, 1, thin), abs=1e-15)
    cut = [np.array([[0, y, 0], [0, y + 0.25, 0], [0, y + 0.25, thin], [0, y, thin]]) for y in (0, 0.25, 0.5, 0.75)]
    assert sum(exchange(floor, part) for part in cut) == pytest.approx(right, abs=1e-15)
    assert right == pytest.approx(exchange(floor, wall), abs=1e-15)


def pieces(corners, share):
    """A triangle cut across, in two."""
    a, b, c = corners
    p, q = a + share * (b - a), a + (0.2 + 0.37 * share) * (c - a)
    return [np.array([a, p, q]), np.array([p, b, c, q])]


def almost_touching(kind, rng):
    """Two triangles whose edges touch or nearly do, by gaps and angles of any size."""
    gap, tilt = 10.0 ** rng.uniform(-16, 0, 2)
    angle = rng.uniform(0.1, 3)
    first = np.array([[0, 0, 0], [1, 0, 0], [rng.random(), 0.2 + rng.random(), 0]])
    hinged = np.array([[1, 0, 0], [0, 0, 0], [rng.random(), np.cos(angle), np.sin(angle)]])
    crossing = [[rng.random(), -rng.random(), gap], [rng.random(), rng.random(), gap], [*rng.normal(size=2), 1]]
    return first, {
        "a gap at an edge": hinged + gap * rng.normal(size=3),
        "an angle at an edge": hinged + gap * rng.normal(size=3) * [[0], [1], [0]],
        "along one line": np.add(hinged, [rng.uniform(-1.5, 1.5), 0, 0]),
        "across an edge": np.array(crossing),
        "on the edge's line": np.array([[1 + tilt, 0, 0], [2, gap, 0.3], [1.5, -0.3, 1]]),
        "at a small angle": np.array([[-0.5, -tilt, gap], [1.5, tilt, gap], [*rng.normal(size=2), 1]]),
        "a corner at an edge": np.array([[rng.random(), gap, tilt], [0.3, -0.4, 1], [0.9, 0.3, 1]]),
        "on top of each other": np.add(first, [0, 0, gap])[::-1] + tilt * rng.normal(size=(3, 3)),
    }[kind]


@given(
    st.integers(0, 10**6),
    st.sampled_from(
        [
            "a gap at an edge", "an angle at an edge", "along one line", "across an edge", "on the edge's line",
            "at a small angle", "a corner at an edge", "on top of each other",
        ]
    ),
)  # fmt: skip
@settings(max_examples=400)
def test_parts_add_up_wherever_edges_nearly_touch(seed, kind):
    """To 2e-15 of the product of the sizes, so that no place of a singularity is missed."""
    rng = np.random.default_rng(seed)
    first, second = almost_touching(kind, rng)
    turn = int(rng.integers(3))
    parts = product(
        pieces(first, rng.uniform(0.05, 0.6)), pieces(np.roll(second, turn, axis=0), rng.uniform(0.05, 0.6))
    )
    sizes = [np.linalg.norm(corners - corners.mean(axis=0), axis=1).max() for corners in (first, second)]
    assert sum(exchange(a, b) for a, b in parts) == pytest.approx(exchange(first, second), abs=2e-15 * np.prod(sizes))
