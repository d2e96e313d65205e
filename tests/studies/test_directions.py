"""Patterns of directions: their numbers, symmetries, and how well they integrate."""

import doctest
import importlib

import numpy as np
import pytest
from cases import cases

from renderer import Mesh
from renderer.mesh.shapes import icosphere
from renderer.studies import cosine_hemisphere, face_points, fibonacci_hemisphere, fibonacci_sphere, reinhart, tregenza
from renderer.studies.directions import turned

pytestmark = pytest.mark.judges(
    "studies.FacePoints", "studies.Pattern", "studies.cosine_hemisphere", "studies.face_points",
    "studies.fibonacci_hemisphere", "studies.fibonacci_sphere", "studies.reinhart", "studies.tregenza",
)  # fmt: skip


MODULES = ["ambient", "directions", "grid", "hidden", "places", "scanner", "sky", "views"]


@cases("name", MODULES)
def test_the_examples_of_the_docstrings_hold(name):
    module = importlib.import_module(f"renderer.studies.{name}")
    results = doctest.testmod(module)
    assert results.failed == 0 and results.attempted > 0


PATTERNS = {
    "tregenza": (tregenza(), 2.0 * np.pi),
    "reinhart": (reinhart(), 2.0 * np.pi),
    "reinhart 4": (reinhart(4), 2.0 * np.pi),
    "fibonacci 1": (fibonacci_hemisphere(1), 2.0 * np.pi),
    "fibonacci": (fibonacci_hemisphere(1000), 2.0 * np.pi),
    "sphere": (fibonacci_sphere(1000), 4.0 * np.pi),
    "cosine": (cosine_hemisphere(1000), np.pi),
}


@cases("name", PATTERNS)
def test_directions_are_unit_vectors_that_share_the_whole(name):
    pattern, whole = PATTERNS[name]
    assert pattern.directions.dtype == pattern.weights.dtype == np.float64
    assert pattern.directions.shape == (*pattern.weights.shape, 3)
    np.testing.assert_allclose(np.linalg.norm(pattern.directions, axis=1), 1.0, rtol=0, atol=4e-16)
    # n roundings of sums of up to 4 pi.
    assert abs(pattern.weights.sum() - whole) < 1e-12
    assert name == "sphere" or (pattern.directions[:, 2] > 0.0).all()
    assert len(np.unique(pattern.directions, axis=0)) == len(pattern.weights)


@cases("m", [1, 2, 3, 7])
def test_tregenza_has_its_rows(m):
    """Rows from the horizon up, in each clockwise from +y; weights are the solid angles of their parts of the rows."""
    pattern, azimuths, heights, areas = reinhart(subdivision=m), [], [], []
    step = 90.0 / (7 * m + 0.5)
    for row, count in enumerate(np.repeat([30, 30, 24, 24, 18, 12, 6], m) * m):
        azimuths += [360.0 * i / count for i in range(count)]
        heights += [step * (row + 0.5)] * count
        zone = np.sin(np.radians(step * (row + 1))) - np.sin(np.radians(step * row))
        areas += [2.0 * np.pi * zone / count] * count
    cap = 2.0 * np.pi * (1.0 - np.sin(np.radians(90.0 - step / 2)))
    a, h = np.radians([*azimuths, 0.0]), np.radians([*heights, 90.0])
    ways = np.stack([np.cos(h) * np.sin(a), np.cos(h) * np.cos(a), np.sin(h)], axis=1)
    # Of angles in radians up to 6, and their sines.
    np.testing.assert_allclose(pattern.directions, ways, rtol=0, atol=4e-15)
    np.testing.assert_allclose(pattern.weights, [*areas, cap], rtol=0, atol=1e-14)
    if m == 1:
        np.testing.assert_array_equal(tregenza().directions, pattern.directions)
        np.testing.assert_array_equal(tregenza().weights, pattern.weights)
        assert (step, len(ways)) == (12.0, 145)


@pytest.mark.parametrize("pattern", [tregenza(), reinhart()])
def test_rows_have_the_symmetries_of_their_numbers_of_patches(pattern):
    """To the last bit: rows of a multiple of four patches look along walls, and as far to each side as to any other."""
    ways = pattern.directions
    for height in np.unique(ways[:-1, 2]):
        row = ways[ways[:, 2] == height]
        ring = {tuple(d) for d in row.tolist()}
        assert {(-x + 0.0, y, z) for x, y, z in ring} == ring and (0.0, row[:, 1].max(), height) in ring
        if len(row) % 4 == 0:
            assert {(y, -x + 0.0, z) for x, y, z in ring} == ring


@pytest.mark.parametrize("make", [fibonacci_hemisphere, cosine_hemisphere, reinhart])
def test_patterns_integrate_smooth_functions_better_the_more_directions_they_have(make):
    """x^2 over the hemisphere is 2 pi / 3 by solid angle, and pi / 4 by cosine."""
    exact = np.pi / 4.0 if make is cosine_hemisphere else 2.0 * np.pi / 3.0
    numbers = (2, 4, 8) if make is reinhart else (100, 1000, 10000)
    errors = []
    for number in numbers:
        pattern = make(number)
        errors.append(abs((pattern.weights * pattern.directions[:, 0] ** 2).sum() / exact - 1.0))
        # The patches are sqrt(2 pi / k) wide, and a smooth function errs by the square of that: 2 pi / k at most.
        assert errors[-1] < 2.0 * np.pi / len(pattern.weights)
    assert errors[2] < errors[0] / 10.0


def test_turned_patterns_look_about_their_pole():
    ways = fibonacci_hemisphere(50).directions
    for pole in ([0, 0, 1], [0, 0, 5e-300], [0, 1, 0], [1, 2, -3], [0, 0, -1]):
        turn = turned(ways, np.array(pole, float))
        unit = np.array(pole) / np.linalg.norm(np.array(pole) / np.abs(pole).max()) / np.abs(pole).max()
        np.testing.assert_allclose(turn @ unit, ways[:, 2], atol=1e-15)
        # No mirror image: the angles between directions and their order stay.
        assert np.linalg.det(np.linalg.lstsq(ways, turn, rcond=None)[0]) > 0.99
    assert (turned(ways, np.array([0.0, 0.0, 2.0])) == ways).all()


@pytest.mark.judges("studies.Pattern.about")
def test_a_pattern_about_normals_is_turned_about_each_of_them():
    pattern = fibonacci_hemisphere(50)
    normals = np.array([[[0, 0, 1], [0, 0, 5e-300], [0, 1, 0]], [[1, 2, -3], [0, 0, -1], [-1e300, 0, 1e300]]])
    found = pattern.about(normals)
    assert found.shape == (2, 3, 50, 3) and found.dtype == np.float64
    for row, normal in zip(found.reshape(6, 50, 3), normals.reshape(6, 3), strict=True):
        np.testing.assert_allclose(row, turned(pattern.directions, normal), rtol=0, atol=4e-16)
        np.testing.assert_array_equal(pattern.about(normal), row)
    assert (pattern.about([0, 0, 7]) == pattern.directions).all()
    assert pattern.about(np.empty((0, 3))).shape == (0, 50, 3)
    with pytest.raises(
        ValueError, match=r"^normals: expected vectors that are not zero, got \[0.0, 0.0, 0.0\] in row 1"
    ):
        pattern.about([[0, 0, 1], [0, 0, 0]])
    with pytest.raises(ValueError, match=r"^normals: expected shape \(\.\.\., 3\)"):
        pattern.about([0, 1])


@cases("make", [fibonacci_hemisphere, fibonacci_sphere, cosine_hemisphere, reinhart])
@cases("bad", [0, -1, 2**24 + 1, 1.5, True, "9", None])
def test_numbers_of_directions_that_are_none(make, bad):
    name = "subdivision" if make is reinhart else "count"
    with pytest.raises(ValueError, match=f"^{name}: expected an integer from 1 to .*, got "):
        make(bad)


@pytest.mark.parametrize("count", [1, 2, 9, 1000])
def test_spirals_have_equal_steps_of_height_or_of_its_square(count: int) -> None:
    """Zones of one height have one area (Archimedes); rings of the disc, one step of the radius' square."""
    even = (np.arange(count) + 0.5) / count
    half, whole, disc = fibonacci_hemisphere(count), fibonacci_sphere(count), cosine_hemisphere(count)
    # A few roundings of numbers up to 1; those of a square root count twice in its square.
    np.testing.assert_allclose(half.directions[:, 2], even, rtol=0, atol=1e-15)
    np.testing.assert_allclose(whole.directions[:, 2], 2.0 * even - 1.0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(disc.directions[:, 2] ** 2, even, rtol=0, atol=1e-15)
    for pattern in (half, whole, disc):
        assert len(np.unique(pattern.weights)) == 1
        # A golden part of a turn from each to the next.
        turn = np.diff(np.unwrap(np.arctan2(pattern.directions[:, 0], pattern.directions[:, 1])))
        golden = 2.0 * np.pi * (np.sqrt(1.25) - 0.5)
        # 1e-10: the fraction of up to 1e3 turns, over the sine of the angle to a pole, 0.03 at least.
        np.testing.assert_allclose(np.mod(turn, 2.0 * np.pi), golden, rtol=0, atol=1e-10)


def test_points_of_faces_are_centroids_with_unit_normals_to_the_outer_side() -> None:
    ball = icosphere(2)
    faces = np.insert(ball.faces, 7, [[5, 5, 6]], axis=0)
    place = face_points(Mesh(2.0 * ball.vertices, faces))
    assert place.faces.tolist() == [*range(7), *range(8, len(faces))] and place.faces.dtype == np.int64
    corners = 2.0 * ball.triangles
    np.testing.assert_allclose(place.points, corners.mean(axis=1), rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(place.normals, axis=1), 1.0, rtol=0, atol=4e-16)
    turn = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])  # counter-clockwise
    assert (np.einsum("ij,ij->i", place.normals, turn) > 0.0).all()
    assert (np.einsum("ij,ij->i", place.normals, place.points) > 0.0).all()
    assert place.points.dtype == place.normals.dtype == np.float64
