"""Polygons cut into triangles: right over notches, and the fan wherever that is right or nothing is."""

import itertools
import time
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.mesh import ears, polygons
from renderer.mesh.polygons import triangulate

pytestmark = pytest.mark.judges("load_mesh")


Outline = list[tuple[float, float]]

SQUARE: Outline = [(0, 0), (1, 0), (1, 1), (0, 1)]
L_SHAPE: Outline = [(2, 1), (1, 1), (1, 2), (0, 2), (0, 0), (2, 0)]
# Its first fan triangle is right, a later one is turned over.
DART: Outline = [(0, 0), (4, 1), (1, 1), (1, 4)]


def star(points: int, inner: float = 0.4) -> Outline:
    radii = np.where(np.arange(2 * points) % 2, 1.0, inner)
    angles = np.arange(2 * points) * np.pi / points
    return list(zip((radii * np.cos(angles)).tolist(), (radii * np.sin(angles)).tolist(), strict=True))


def comb(teeth: int) -> Outline:
    """Corners in line along the tips, the roots and the back."""
    tips = [(x, y) for k in range(teeth) for x, y in ((2 * k, 1), (2 * k, 5), (2 * k + 1, 5), (2 * k + 1, 1))]
    back = [(float(x), 0.0) for x in range(2 * teeth - 1, -1, -1)]
    return [(float(x), float(y)) for x, y in tips] + back


def spiral(turns: int) -> Outline:
    angles = np.linspace(0, 2 * np.pi * turns, 24 * turns)
    way = np.stack([np.cos(angles), np.sin(angles)], axis=1) * (1 + angles)[:, None]
    wall = way * (1 + 1 / (1 + angles))[:, None]
    return [(x, y) for x, y in np.concatenate([way, wall[::-1]]).tolist()]


NOTCHED = {
    "L": L_SHAPE, "dart": DART, "star": star(5), "fine star": star(200, 0.97), "comb": comb(12), "spiral": spiral(3),
    "far": [(x + 1e6, y - 1e6) for x, y in L_SHAPE], "small": [(x * 1e-150, y * 1e-150) for x, y in L_SHAPE],
    "large": [(x * 1e300, y * 1e300) for x, y in L_SHAPE],
}  # fmt: skip
# Columns: where the outline's x, its y and the way to its viewer point.
UPRIGHT = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
TILTED = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
FRAMES = {"flat": np.eye(3), "upright": UPRIGHT, "tilted": TILTED, "below": np.diag([1.0, -1, -1])}


def placed(outline: Outline, frame: NDArray[np.float64] = FRAMES["flat"]) -> NDArray[np.float64]:
    return np.array([[x, y, 0.0] for x, y in outline]) @ frame.T


def cut(*shapes: NDArray[np.float64]) -> list[list[int]]:
    """The triangles of polygons that share no corner."""
    starts = np.cumsum([0, *map(len, shapes)])
    return triangulate(np.concatenate(shapes), np.arange(starts[-1]), starts).tolist()


def fan(corners: int, first: int = 0) -> list[list[int]]:
    return [[first, first + k, first + k + 1] for k in range(1, corners - 1)]


def doubled_areas(points: NDArray[np.float64], triangles: Any) -> NDArray[np.float64]:
    """Doubled areas of triangles, as vectors."""
    a, b, c = np.moveaxis(points[np.array(triangles)], 1, 0)
    return np.cross(b - a, c - a)


def assert_right(points: NDArray[np.float64], triangles: list[list[int]]) -> None:
    """As many as there should be, all wound as the polygon, of its area: so they cover it, once."""
    points = (points - points[0]) / np.abs(points - points[0]).max()
    whole = doubled_areas(points, fan(len(points))).sum(axis=0)
    parts = doubled_areas(points, triangles) @ (whole / np.linalg.norm(whole))
    assert len(triangles) == len(points) - 2
    assert parts.min() > 1e-9 and parts.sum() == pytest.approx(np.linalg.norm(whole), rel=1e-9)


@cases("frame", FRAMES)
@cases("name", NOTCHED)
def test_notched_polygons_are_covered_once(name: str, frame: str) -> None:
    points = placed(NOTCHED[name], FRAMES[frame])
    for shift in {0, 1, 2, len(points) // 2, len(points) - 1}:  # whichever corner comes first
        for turned in (np.roll(points, shift, axis=0), np.roll(points, shift, axis=0)[::-1]):
            assert_right(turned, cut(turned))


@cases("name", NOTCHED)
def test_the_fan_is_wrong_for_each_of_these(name: str) -> None:
    """From some corner: the test above would see it."""
    with pytest.raises(AssertionError):
        for shift in (0, 1):
            points = np.roll(placed(NOTCHED[name]), shift, axis=0)
            assert_right(points, fan(len(points)))


def test_a_concave_polygon_that_its_first_corner_sees_whole_keeps_its_fan() -> None:
    points = np.roll(placed(DART), 2, axis=0)  # from the notch's bottom
    assert cut(points) == fan(4)
    assert_right(points, fan(4))
    assert cut(placed(DART)) == fan(4) and cut(np.roll(placed(DART), 1, axis=0)) != fan(4)


@settings(deadline=None, max_examples=300)
@given(st.integers(3, 12), st.integers(0, 10**6), st.booleans(), st.sampled_from([1.0, 1e-30, 1e200]))
def test_convex_polygons_keep_their_fan(corners: int, seed: int, single: bool, size: float) -> None:
    """At any tilt, with corners repeated or in line, rounded to float32 or not."""
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.choice(40, corners, replace=False)) * (2 * np.pi / 40)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(corners)], axis=1) @ FRAMES["tilted"].T
    in_line = (ring[0] + ring[-1]) / 2
    for points in (ring, np.concatenate([ring, [in_line]]), np.concatenate([[in_line], ring]), ring.repeat(2, axis=0)):
        points = points.astype(np.float32).astype(np.float64) if single else points
        assert cut(points * size) == fan(len(points))


def untangled(points: Outline) -> Outline:
    """The points in an order in which the outline does not cross itself."""

    def crosses(a: Any, b: Any, c: Any, d: Any) -> bool:
        def side(p: Any, q: Any, r: Any) -> bool:
            return bool((q[0] - p[0]) * (r[1] - p[1]) > (q[1] - p[1]) * (r[0] - p[0]))

        return side(a, b, c) != side(a, b, d) and side(c, d, a) != side(c, d, b)

    # Turning the way between two edges that cross shortens the outline: it ends.
    while True:
        edges = [
            (i, j) for i in range(len(points)) for j in range(i + 2, len(points)) if (i, j + 1) != (0, len(points))
        ]
        found = [
            (i, j) for i, j in edges if crosses(points[i], points[i + 1], points[j], points[(j + 1) % len(points)])
        ]
        if not found:
            return points
        i, j = found[0]
        points = points[: i + 1] + points[i + 1 : j + 1][::-1] + points[j + 1 :]


@settings(deadline=None, max_examples=150)
@given(st.integers(5, 16), st.integers(0, 10**6))
def test_random_outlines_are_covered_once(corners: int, seed: int) -> None:
    points = placed(untangled(np.random.default_rng(seed).random((corners, 2)).tolist()), FRAMES["tilted"])
    assert_right(points, cut(points))


PENTAGRAM = [star(5)[1::2][k] for k in (0, 2, 4, 1, 3)]


@cases(
    "outline",
    [
        [(0, 0)] * 6,
        [(k, k) for k in (0, 1, 2, 3, 2, 1)],
        [(0, 0), (1, 1), (1, 0), (0, 1)],
        [(0, 0), (2, 2), (2, 0), (0, 1)],
        np.roll(PENTAGRAM, 1, axis=0).tolist(),
        [*L_SHAPE[:3], L_SHAPE[2], *L_SHAPE[3:]],
        [(0, 0), (4, 0), (4, 4), (2, 0), (0, 4), (1, 2)],  # a corner on an edge
        [(2, 1), (1, 1), (1, 2), (0, 2), (0, 0), (2, 0), (3, 0), (2, 0)],  # there and back
        # A hole by a bridge.
        [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)],
        *([*L_SHAPE[:k], (bad, 0.0), *L_SHAPE[k:]] for bad in (np.nan, np.inf, -np.inf) for k in (0, 3)),
        [(x * y, y) for x, y in zip([1e308, -1e308] * 4, [1.0, -1.0, 2, 3, -5, 1, 7, 1], strict=True)],
    ],
)
def test_polygons_that_nothing_is_right_for_keep_their_fan(outline: Outline) -> None:
    assert cut(placed(outline) if np.isfinite(outline).all() else np.array([[x, y, 0.0] for x, y in outline])) == fan(
        len(outline)
    )


def test_a_pentagram_is_told_by_its_crossings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without that check something else comes of a polygon that crosses itself: the tests above see it."""
    crossing = placed([(0, 0), (6, 0), (6, 3), (2, 3), (2, -1), (3, -1), (3, 2), (5, 2), (5, 1), (0, 1)])
    assert cut(crossing) == fan(len(crossing))
    monkeypatch.setattr(ears, "is_simple", lambda outline, order: True)
    assert cut(crossing) != fan(len(crossing))


def test_an_outline_that_folds_back_onto_its_edge_is_not_simple() -> None:
    """Its corner touches the edge before last, as no other pair of edges shows; from each corner, turned, mirrored."""
    folded = np.array([(0, 0), (4, 0), (2, 0), (2, 1), (3, 2), (0, 3)], np.float64)
    for turn, flip, begin, back in itertools.product(range(4), (1, -1), range(6), (1, -1)):
        outline = np.ascontiguousarray(np.roll(folded * [flip, 1.0], begin, axis=0)[::back])
        for _ in range(turn):
            outline = np.ascontiguousarray(outline[:, ::-1] * [-1.0, 1.0])
        order = np.argsort(np.minimum(outline, np.roll(outline, -1, axis=0))[:, 0])
        assert not ears.is_simple(outline, order)


def test_bent_polygons_keep_their_fan_slightly_bent_ones_are_cut() -> None:
    for height, kept in [(0.02, False), (0.9, True)]:
        points = placed(L_SHAPE) + np.outer([0, 1, 0, 1, 0, 1], [0, 0, height])
        assert (cut(points) == fan(6)) == kept


@cases("index", [-1, 6, 2**62, -(2**62)])
def test_indices_out_of_range_keep_the_fan(index: int) -> None:
    corners = np.array([0, 1, 2, 3, 4, index, *range(6)])  # NumPy would take -1 for the last
    triangles = triangulate(placed(L_SHAPE), corners, np.array([0, 6, 12]))
    assert triangles[:4].tolist() == fan(6)
    assert_right(placed(L_SHAPE), (triangles[4:] - 6).tolist())


def test_no_vertices_and_no_polygons() -> None:
    assert triangulate(np.empty((0, 3)), np.arange(4), np.array([0, 4])).tolist() == fan(4)
    assert triangulate(np.empty((0, 3)), np.empty(0, np.int64), np.array([0])).shape == (0, 3)


def test_polygons_keep_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many lengths, notched and not, within and across blocks."""
    outlines = [SQUARE, L_SHAPE, SQUARE[:3], star(5), SQUARE, DART[1:] + DART[:1], L_SHAPE, comb(3), SQUARE[:3]] * 3
    shapes = [placed(outline) + np.array([3.0 * k, 0, k]) for k, outline in enumerate(outlines)]
    triangles = cut(*shapes)
    first = 0
    for shape in shapes:
        mine = triangles[: len(shape) - 2]
        assert {corner for triangle in mine for corner in triangle} == set(range(first, first + len(shape)))
        assert_right(np.concatenate(shapes)[first : first + len(shape)], (np.array(mine) - first).tolist())
        triangles, first = triangles[len(shape) - 2 :], first + len(shape)
    assert not triangles
    whole = cut(*shapes)
    monkeypatch.setattr(polygons, "_BLOCK_CORNERS", 9)
    assert cut(*shapes) == whole


@settings(deadline=None, max_examples=500)
@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=4, max_size=10))
@example([(0, 0), (2, 0), (1, 0), (1, 2)])
def test_any_polygon_on_a_grid_is_covered_once_or_keeps_its_fan(corners: list[tuple[int, int]]) -> None:
    points = placed([(float(x), float(y)) for x, y in corners])
    triangles = cut(points)
    assert len(triangles) == len(points) - 2
    if triangles != fan(len(points)):
        assert_right(points, triangles)
        edges = {frozenset((k, (k + 1) % len(points))) for k in range(len(points))}
        assert edges <= {frozenset((t[k - 1], t[k])) for t in triangles for k in range(3)}


def test_polygons_of_very_many_corners_end() -> None:
    """Quiet, each takes under 2 s. Beyond the limit the fan stays."""
    start = time.process_time()
    for outline in (comb(600), [(y, x) for x, y in comb(600)][::-1], star(2000), spiral(80)):
        points = placed(outline)
        assert len(points) <= 4096
        assert_right(points, cut(points))
    large = placed(star(2049))
    assert cut(large) == fan(len(large))
    assert time.process_time() - start < 60


def test_polygons_of_so_many_corners_that_each_is_cut_alone() -> None:
    """Above 2048 corners; each as if there were no other."""
    shapes = [placed(star(1025, inner)) for inner in (0.4, 0.5, 0.6)]
    triangles, size = np.array(cut(*shapes)), len(shapes[0]) - 2
    for k, points in enumerate(shapes):
        own = triangles[k * size : (k + 1) * size] - k * len(points)
        assert own.tolist() == cut(points) != fan(len(points))


def test_a_million_squares_in_two_seconds() -> None:
    """Quiet, it takes 0.5 s."""
    count = 1_000_000
    corners = np.tile(np.arange(4), count)
    start = time.process_time()
    triangles = triangulate(placed(SQUARE), corners, np.arange(count + 1) * 4)
    assert time.process_time() - start < 2
    assert corners[triangles].reshape(-1, 6).min(axis=0).tolist() == [0, 1, 2, 0, 2, 3]
