"""Error against cost: what the front and the slope are, and which answers count as errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from validation.efficiency.hits import errors
from validation.error_curves import front, slope
from validation.hits.compare import HitArrays
from validation.oracle import exact

# Few values, so that equal costs and equal errors are common.
POINTS = st.lists(st.tuples(st.integers(0, 6).map(float), st.integers(0, 6).map(float)), max_size=20)


def dominates(a, b):
    return a[0] <= b[0] and a[1] <= b[1] and a != b


def test_a_front_of_nan_is_refused():
    with pytest.raises(ValueError, match=r"got .*nan.* in row 1"):
        front([(1.0, 1.0), (2.0, math.nan)])


@given(POINTS)
def test_the_front_is_the_definition(points):
    expected = {i for i, p in enumerate(points) if not any(dominates(q, p) for q in points)}
    chosen = front(points)
    assert set(chosen) == expected and len(chosen) == len(expected)
    assert [points[i][0] for i in chosen] == sorted(points[i][0] for i in chosen)


@given(st.floats(-3, 3), st.floats(1e-3, 1e3))
def test_a_slope_is_the_exponent(power, factor):
    x = [0.5, 1.0, 4.0, 10.0]
    # A dozen roundings over a spread of ln 20 in x.
    assert slope(x, [factor * v**power for v in x]) == pytest.approx(power, abs=1e-12)


def test_a_slope_is_least_squares():
    # Residuals of 1, -2, 1 in the logarithm are orthogonal to a line.
    y = [math.exp(-0.5 * k + r) for k, r in zip((0, 1, 2), (1, -2, 1), strict=True)]
    assert slope([1.0, math.e, math.e**2], y) == pytest.approx(-0.5, abs=1e-12)


def test_a_slope_leaves_out_what_has_no_logarithm_and_needs_two():
    assert slope([0.0, 1.0, 2.0, 4.0], [9.0, 1.0, 2.0, 0.0]) == pytest.approx(1.0, abs=1e-12)
    assert slope([1.0, 2.0], [1.0, 0.0]) is None
    assert slope([2.0, 2.0], [1.0, 3.0]) is None


def test_errors_count_every_kind_of_wrong_answer():
    triangle, below = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, -1], [1, 0, -1], [0, 1, -1]]
    origins = np.array([[0.2, 0.2, 1.0]] * 4 + [[2.0, 2.0, 1.0]] * 2)
    directions = np.array([[0.0, 0.0, -1.0]] * 6)
    truth = exact.closest_hits(triangle + below, [[0, 1, 2], [3, 4, 5]], origins, directions)
    answer = HitArrays(np.array([1.0, 1.25, 2.0, np.inf, np.inf, 3.0]), np.array([0, 0, 1, -1, -1, 1], dtype=np.int64))
    found = errors(answer, truth)
    assert (found["missed"], found["false_hits"], found["wrong_face"], found["both_hit"]) == (1, 1, 1, 3)
    assert found["p50"] == 0.25 and found["max"] == 1.0
    nothing = errors(HitArrays(np.full(6, np.inf), np.full(6, -1)), truth)
    assert nothing["max"] is None and nothing["missed"] == 4
