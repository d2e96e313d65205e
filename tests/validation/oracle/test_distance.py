"""The exact distance of a point from a triangle, against places on it and their like in float64."""

from fractions import Fraction

import numpy as np
import pytest
from cases import cases

from validation.oracle.distance import squared_distance, way_from
from validation.oracle.vectors import rational

TRIANGLE = rational([[0, 0, 0], [4, 0, 0], [0, 3, 0]])


@cases(
    ("point", "expected"),
    [
        ((1, 1, 2), 4),  # above the face
        ((1, 1, 0), 0),  # in it
        ((2, -3, 4), 25),  # beside a side
        ((-3, -4, 0), 25),  # beside a corner
        ((4, 3, 0), Fraction(144, 25)),  # beyond the slanted side
        ((7, 0, 4), 25),  # beyond a corner
    ],
)
def test_distances_that_are_known(point, expected):
    assert squared_distance(*rational([point]), TRIANGLE) == expected


@pytest.mark.parametrize("corners", [[[0, 0, 0], [2, 0, 0], [4, 0, 0]], [[4, 0, 0], [0, 0, 0], [2, 0, 0]]])
def test_a_face_of_no_area_is_its_longest_side(corners):
    assert squared_distance(*rational([[3, 3, 4]]), rational(corners)) == 25
    assert squared_distance(*rational([[7, 0, 4]]), rational(corners)) == 25


def test_no_sample_of_the_face_is_nearer_and_some_is_as_near():
    rng = np.random.default_rng(0)
    weights = rng.dirichlet([0.5] * 3, 20_000)
    for _ in range(20):
        corners, point = rng.normal(size=(3, 3)), rng.normal(size=3) * 2
        distance = float(squared_distance(*rational([point.tolist()]), rational(corners.tolist()))) ** 0.5
        nearest = np.linalg.norm(weights @ corners - point, axis=1).min()
        assert distance <= nearest <= distance + 0.1


@pytest.mark.parametrize(("value", "way"), [(0.75, Fraction(1, 4)), (1.5, Fraction(1, 2)), (np.inf, np.inf)])
def test_the_way_from_a_number_is_exact_and_infinite_from_none(value, way):
    assert way_from(value, Fraction(1)) == way
    assert way_from(-np.inf, Fraction(1)) == way_from(np.nan, Fraction(1)) == np.inf
