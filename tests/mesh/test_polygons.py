"""Polygons cut into triangles: right over notches, and the fan wherever that is right or nothing is."""

import time
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.mesh import polygons
from renderer.mesh.polygons import Cut, triangulate

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


def cut_of(*shapes: NDArray[np.float64]) -> Cut:
    """The cut of polygons that share no corner."""
    starts = np.cumsum([0, *map(len, shapes)])
    return triangulate(np.concatenate(shapes), np.arange(starts[-1]), starts)


def cut(*shapes: NDArray[np.float64]) -> list[list[int]]:
    found = cut_of(*shapes)
    assert not len(found.wrong)
    return found.places.tolist()


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
    # Corners on one line make triangles without area, but for rounding.
    assert parts.min() > -1e-12 and parts.sum() == pytest.approx(np.linalg.norm(whole), rel=1e-9)


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


# Polygons that touch themselves, and their areas.
WINDOW = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
ANGLES = np.arange(1500) * np.pi / 750
CIRCLE = [(float(x), float(y)) for x, y in np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)]
TOUCHING = {
    "hole by a bridge": (WINDOW, 12),
    "pinched corner": ([(0, 0), (2, 2), (4, 0), (4, 4), (2, 2), (0, 4)], 8),
    "corner on an edge": ([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4), (1, 2)], 6),
    "corner twice": ([*L_SHAPE[:3], L_SHAPE[2], *L_SHAPE[3:]], 3),
    "edge there and back": ([(2, 1), (1, 1), (1, 2), (0, 2), (0, 0), (2, 0), (3, 0), (2, 0)], 3),
    "folded back": ([(0, 0), (4, 0), (2, 0), (2, 1), (3, 2), (0, 3)], 6),
    "ring of 3,000 corners": (
        [*((2 * x, 2 * y) for x, y in CIRCLE), (2.0, 0.0), CIRCLE[0], *CIRCLE[:0:-1], CIRCLE[0]],
        3 * 750 * np.sin(np.pi / 750),
    ),
}


def assert_covered_once(points: NDArray[np.float64], area: float) -> None:
    whole = doubled_areas(points, fan(len(points))).sum(axis=0)
    parts = doubled_areas(points, cut(points)) @ (whole / np.linalg.norm(whole))
    assert parts.min() >= -1e-12 and parts.sum() == pytest.approx(2 * area, rel=1e-9)


@cases("frame", FRAMES)
@cases("name", TOUCHING)
def test_polygons_that_touch_themselves_are_covered_once(name: str, frame: str) -> None:
    """The wall with a window had the area of the wall, and rays hit in the window."""
    outline, area = TOUCHING[name]
    for shift in {0, 1, len(outline) // 2}:
        points = np.roll(placed(outline, FRAMES[frame]), shift, axis=0)
        for turned in (points, points[::-1]):
            assert_covered_once(turned, area)


@settings(max_examples=60)
@given(st.sampled_from(["corner on an edge", "folded back"]), st.integers(0, 10**6))
def test_a_corner_on_an_edge_may_be_beyond_it_by_rounding(name: str, seed: int) -> None:
    """An eighth of such polygons kept a wrong fan."""
    outline, area = TOUCHING[name]
    points = placed(outline, np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0])
    assert_covered_once(points, area)


PENTAGRAM = [star(5)[1::2][k] for k in (0, 2, 4, 1, 3)]
# It has corners on its edges too, and triangles with its area that do not cover it.
CHANCE: Outline = [(1, 0), (2, 2), (1, 2), (1, 2), (2, 0), (2, 2), (0, 2), (2, 0)]


@cases("outline", [[(0, 0), (1, 1), (1, 0), (0, 1)], [(0, 0), (2, 2), (2, 0), (0, 1)], PENTAGRAM, CHANCE])
def test_polygons_that_cross_themselves_are_named(outline: Outline) -> None:
    found = cut_of(placed(SQUARE), placed(outline), placed(L_SHAPE))
    assert found.wrong.tolist() == [1]
    assert found.places[found.polygons == 1].tolist() == fan(len(outline), 4)
    assert_right(placed(L_SHAPE), (found.places[found.polygons == 2] - 4 - len(outline)).tolist())


@cases(
    "outline",
    [
        [(0, 0)] * 6,
        [(k, k) for k in (0, 1, 2, 3, 2, 1)],
        *([*L_SHAPE[:k], (bad, 0.0), *L_SHAPE[k:]] for bad in (np.nan, np.inf, -np.inf) for k in (0, 3)),
    ],
)
def test_polygons_without_area_and_without_numbers_keep_their_fan(outline: Outline) -> None:
    assert cut(np.array([[x, y, 0.0] for x, y in outline])) == fan(len(outline))


def test_a_cut_that_does_not_cover_the_polygon_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the library gives: triangles turned over, one that is missing, none at all."""
    good = np.array(cut(placed(L_SHAPE)), np.uint32)
    for bad in (good[:, ::-1], good[:-1], good[:0]):
        monkeypatch.setattr("mapbox_earcut.triangulate_float64", lambda *_, flat=bad: flat.ravel())
        assert cut_of(placed(L_SHAPE)).wrong.tolist() == [0]


def test_bent_polygons_keep_their_fan_slightly_bent_ones_are_cut() -> None:
    for height, kept in [(0.02, False), (0.9, True)]:
        points = placed(L_SHAPE) + np.outer([0, 1, 0, 1, 0, 1], [0, 0, height])
        found = cut_of(points)
        assert (found.places.tolist() == fan(6)) == kept == bool(len(found.wrong))


@cases("index", [-1, 6, 2**62, -(2**62)])
def test_indices_out_of_range_keep_the_fan(index: int) -> None:
    corners = np.array([0, 1, 2, 3, 4, index, *range(6)])  # NumPy would take -1 for the last
    triangles = triangulate(placed(L_SHAPE), corners, np.array([0, 6, 12])).places
    assert triangles[:4].tolist() == fan(6)
    assert_right(placed(L_SHAPE), (triangles[4:] - 6).tolist())


def test_no_vertices_and_no_polygons() -> None:
    assert triangulate(np.empty((0, 3)), np.arange(4), np.array([0, 4])).places.tolist() == fan(4)
    assert triangulate(np.empty((0, 3)), np.empty(0, np.int64), np.array([0])).places.shape == (0, 3)


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
    found = cut_of(points)
    triangles = found.places.tolist()
    if len(found.wrong) or triangles == fan(len(points)):
        assert triangles == fan(len(points))
        return
    whole = doubled_areas(points, fan(len(points))).sum(axis=0)
    parts = doubled_areas(points, triangles) @ np.sign(whole)
    assert parts.min() >= 0.0 and parts.sum() == abs(whole).sum()


def test_polygons_of_very_many_corners_end() -> None:
    """Quiet, each takes under 0.1 s."""
    start = time.process_time()
    for outline in (comb(600), [(y, x) for x, y in comb(600)][::-1], star(20_000), spiral(80)):
        points = placed(outline)
        assert_right(points, cut(points))
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
    triangles = triangulate(placed(SQUARE), corners, np.arange(count + 1) * 4).places
    assert time.process_time() - start < 2
    assert corners[triangles].reshape(-1, 6).min(axis=0).tolist() == [0, 1, 2, 0, 2, 3]
