"""The rational oracle: its semantics, an independent twin, and the proof of its float64 filter."""

from fractions import Fraction

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st

from validation.oracle import exact

TRIANGLE = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]])
ONE = np.array([[0, 1, 2]])
GRID = st.integers(-3, 3).map(float)
FLOATS = st.floats(-10, 10, allow_nan=False)


def by_cramer(triangle, origin, direction):
    """Solve o + t d = p0 + u e1 + v e2 in Fractions: another formula than the oracle's."""
    p0, p1, p2, o, d = ([Fraction(float(x)) for x in row] for row in (*triangle, origin, direction))
    e1, e2, s = ([a - b for a, b in zip(p, p0, strict=True)] for p in (p1, p2, o))
    columns = [[-x for x in d], e1, e2]

    def det(a, b, c):
        x = a[0] * (b[1] * c[2] - b[2] * c[1])
        return x - b[0] * (a[1] * c[2] - a[2] * c[1]) + c[0] * (a[1] * b[2] - a[2] * b[1])

    whole = det(*columns)
    if whole == 0:
        return None
    t, u, v = (det(*[s if i == j else c for j, c in enumerate(columns)]) / whole for i in range(3))
    return t if u >= 0 and v >= 0 and u + v <= 1 else None


@cases("x, y", [(0, 0), (4, 0), (0, 4), (2, 0), (0, 2), (2, 2), (1, 1)])
@cases("dz", [-2.0, -3.0])
def test_triangle_is_closed_and_t_counts_directions(x, y, dz):
    assert exact.intersect(TRIANGLE, [x, y, 6], [0, 0, dz]) == Fraction(6) / Fraction(-dz)
    assert exact.intersect(TRIANGLE, [x, y, -6], [0, 0, dz]) == Fraction(-6) / Fraction(-dz)


@pytest.mark.parametrize("origin", [[-5e-324, 1, 1], [1, -5e-324, 1], [2, np.nextafter(2, 3), 1]])
def test_a_hair_beside_the_edge_is_a_miss(origin):
    assert exact.intersect(TRIANGLE, origin, [0, 0, -1]) is None


def test_in_plane_and_zero_area_are_missed():
    assert exact.intersect(TRIANGLE, [-1, 1, 0], [1, 0, 0]) is None
    assert exact.intersect([[0, 0, 0], [1, 1, 0], [2, 2, 0]], [1, 1, 1], [0, 0, -1]) is None
    assert exact.intersect([[1, 1, 0]] * 3, [1, 1, 1], [0, 0, -1]) is None


@pytest.mark.parametrize("t_min, t_max, hit", [(2, 2, True), (0, np.nextafter(2, 0), False), (2.5, 9, False)])
def test_interval_is_closed(t_min, t_max, hit):
    found = exact.closest_hit(TRIANGLE, ONE, [1, 1, 2], [0, 0, -1], t_min, t_max)
    assert (found is not None) == hit
    assert (exact.closest_hits(TRIANGLE, ONE, [[1, 1, 2]], [[0, 0, -1]], t_min, t_max)[0] is not None) == hit


def test_ties_name_all_faces_and_the_lowest():
    lowered = np.subtract(TRIANGLE, [0, 0, 1])
    vertices = np.vstack([TRIANGLE, lowered, [[4, 4, 0]]])
    faces = np.array([[3, 4, 5], [0, 1, 2], [2, 1, 0], [1, 6, 2]])
    found = exact.closest_hit(vertices, faces, [2, 2, 3], [0, 0, -1])
    assert found == exact.ExactHit(Fraction(3), 1, (1, 2, 3))
    assert exact.closest_hit(vertices, faces, [2, 2, 3], [0, 0, -1], candidates=[3, 0]).faces_at_t == (3,)


@given(st.lists(st.one_of(GRID, FLOATS), min_size=15, max_size=15))
@settings(deadline=None, max_examples=300)
def test_agrees_with_cramers_rule(numbers):
    rows = np.array(numbers).reshape(5, 3)
    assert exact.intersect(rows[:3], rows[3], rows[4]) == by_cramer(rows[:3], rows[3], rows[4])


@given(st.lists(GRID, min_size=15, max_size=15), st.integers(-300, 300))
@settings(deadline=None, max_examples=100)
def test_scale_by_a_power_of_two_keeps_t(numbers, k):
    rows = np.array(numbers).reshape(5, 3)
    scaled = rows * 2.0**k
    assert exact.intersect(scaled[:3], scaled[3], scaled[4]) == exact.intersect(rows[:3], rows[3], rows[4])


# ---------------------------------------------------------------------------- the filter proves nothing wrong


@st.composite
def batches(draw):
    """Meshes and rays where rounding decides: grid coordinates (ties, in-plane, degenerate), offsets, scales."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    faces = rng.integers(0, 12, (draw(st.integers(1, 40)), 3))
    whole = draw(st.booleans())
    vertices = rng.integers(-3, 4, (12, 3)).astype(float) if whole else rng.uniform(-1, 1, (12, 3))
    count = 12
    corners = vertices[faces[rng.integers(0, len(faces), count)]]
    aim = draw(st.sampled_from(["vertex", "edge", "plane", "axis", "random"]))
    along = rng.choice([0.25, 0.5, 0.75], (count, 1))
    target = corners[:, 0]
    if aim == "edge":
        target = (1 - along) * corners[:, 0] + along * corners[:, 1]
    origins = rng.integers(-5, 6, (count, 3)).astype(float) if whole else rng.uniform(-3, 3, (count, 3))
    if aim == "plane":
        origins = corners[:, 1] + 2 * (corners[:, 1] - corners[:, 2])
    directions = target - origins
    if aim == "axis":
        origins[:, :2] = target[:, :2]
        directions = np.tile([0.0, -0.0, -1.0], (count, 1))
    if aim == "random":
        directions = rng.standard_normal((count, 3))
    offset = draw(st.sampled_from([0.0, 1e4, 2.0**40, 1e15]))
    scale = 2.0 ** draw(st.sampled_from([0, 0, -133, -400, -1060, 300, 960]))
    return (vertices + offset) * scale, faces, (origins + offset) * scale, directions


def disagreements(batch) -> int:
    filtered, everything = exact.closest_hits(*batch), exact.closest_hits(*batch, filtered=False)
    return sum(a != b for a, b in zip(filtered, everything, strict=True))


@given(batches())
@settings(deadline=None, max_examples=150)
def test_filtered_is_unfiltered(batch):
    assert disagreements(batch) == 0


def aimed_far_away() -> tuple[np.ndarray, ...]:
    """Vertices far from the origin and rays aimed at them and at edges, where float64 determinants are mostly
    noise.
    """
    rng = np.random.default_rng(5)
    faces = rng.integers(0, 60, (100, 3))
    vertices = rng.integers(-3, 4, (60, 3)) + 1e3 * rng.random(3)
    origins = vertices[rng.integers(0, 60, 300)] + rng.integers(1, 9, (300, 3)) / 3
    return vertices, faces, origins, vertices[rng.integers(0, 60, 300)] - origins


def flat_along_axes() -> tuple[np.ndarray, ...]:
    """Boxes without thickness, whose planes a ray enters and leaves at distances that only rounding tells
    apart.
    """
    rng = np.random.default_rng(6)
    faces = np.arange(300).reshape(100, 3)
    vertices = rng.random((300, 3))
    vertices.reshape(100, 3, 3)[np.arange(100), :, np.arange(100) % 3] = rng.random((100, 1))
    origins = rng.uniform(-1, 2, (300, 3))
    return vertices, faces, origins, vertices - origins


@pytest.mark.parametrize(
    "batch, constant, value",
    [(aimed_far_away, "DETERMINANT_ROUNDINGS", 0.0), (flat_along_axes, "BOX_WIDENING", -(2.0**-50))],
)
def test_a_filter_without_its_error_bound_is_caught(monkeypatch, batch, constant, value):
    assert disagreements(batch()) == 0
    monkeypatch.setattr(exact, constant, value)
    assert disagreements(batch()) > 0


def test_overflow_and_denormals_lose_nothing():
    for scale in (1e-320, 1e-200, 1e300):
        hits = exact.closest_hits(TRIANGLE * scale, ONE, [[scale, scale, scale]], [[0, 0, -1]])
        assert hits[0] is not None and hits[0].t == Fraction(scale)
    hits = exact.closest_hits(TRIANGLE * 4e307, ONE, [[4e307, 4e307, -1.7e308]], [[0, 0, 1.0]])
    assert hits[0] is not None and hits[0].t == Fraction(1.7e308)
    # Here even the difference of box and origin overflows.
    far = np.array([[0.0, 0.0, 1e308], [4.0, 0.0, 1e308], [0.0, 4.0, 1e308]])
    hits = exact.closest_hits(far, ONE, [[1, 1, -1.7e308]], [[0, 0, 1e300]], t_max=1e9)
    assert hits[0] is not None and hits[0].t == (Fraction(1e308) + Fraction(1.7e308)) / Fraction(1e300)


@cases(
    "arguments, message",
    [
        ((TRIANGLE, [[0, 1, 3]], [[0, 0, 1]], [[0, 0, 1]]), "faces: expected indices 0 ... 2"),
        ((TRIANGLE, [[0, -1, 2]], [[0, 0, 1]], [[0, 0, 1]]), "faces: expected indices"),
        ((TRIANGLE, ONE, [[0, 0, np.nan]], [[0, 0, 1]]), "origins: expected finite numbers"),
        ((TRIANGLE, ONE, [[0, 0, 1]], [[0, np.inf, 1]]), "directions: expected finite"),
        ((TRIANGLE, ONE, [[0, 0, 1]] * 2, [[0, 0, 1]]), "directions: expected the shape of origins"),
        ((TRIANGLE[:, :2], ONE, [[0, 0, 1]], [[0, 0, 1]]), r"vertices: expected shape \(n, 3\)"),
    ],
)
def test_errors_name_the_argument(arguments, message):
    with pytest.raises(ValueError, match=message):
        exact.closest_hits(*arguments)
