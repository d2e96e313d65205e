"""Ambient occlusion and openness, against closed forms and rays that are written down."""

import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.mesh.shapes import box, grid, icosphere
from renderer.studies import ambient_occlusion, face_points, openness

pytestmark = pytest.mark.judges("studies.ambient_occlusion", "studies.openness")


SAMPLES = [64, 256, 4096, 30000]
FAR = 1e7


def bound(samples):
    """As for a sky's patches: over the disc, parts are sqrt(pi / samples) wide, and boundaries of length up to 4, that
    of two diameters, run through 4 / sqrt(pi / samples) of them, each wrong by half of 1 / samples at most.
    """
    return 2.0 / np.sqrt(np.pi * samples)


def walls(*planes):
    """Large triangles across x = 0, across y = 0, and the floor z = 0."""
    corners = {
        "x": [[0, -FAR, -FAR], [0, FAR, -FAR], [0, 0, FAR]],
        "y": [[-FAR, 0, -FAR], [FAR, 0, -FAR], [0, 0, FAR]],
        "z": [[-FAR, -FAR, 0], [FAR, -FAR, 0], [0, FAR, 0]],
    }
    return Octree(np.concatenate([corners[plane] for plane in planes]), np.arange(3 * len(planes)).reshape(-1, 3))


@cases("samples", SAMPLES)
@cases(("planes", "share"), [("z", 1.0), ("xz", 0.5), ("xyz", 0.25)])
def test_in_the_open_beside_a_wall_and_in_a_corner(planes, share, samples):
    octree = walls(*planes)
    # Beside the walls, on the floor, whose face is the last.
    found = ambient_occlusion(octree, [[1e-3, 1e-3, 0.0]], [0, 0, 1], samples=samples, leaving=len(planes) - 1)
    assert abs(found[0] - share) < bound(samples)
    assert share < 1.0 or found[0] == 1.0


@cases("samples", SAMPLES)
@cases("away", [0.0625, 0.25, 0.5, 0.75, 1.0, 1.5])
def test_a_wall_within_a_distance_hides_a_segment_of_the_disc(away, samples):
    """Directions that meet it within 1 have |x| >= away; over the disc of cosines that is cut off by a chord."""
    chord = min(away, 1.0)
    segment = (np.arccos(chord) - chord * np.sqrt(1.0 - chord**2)) / np.pi
    found = ambient_occlusion(walls("x"), [[away, 0.0, 0.0]], [0, 0, 1], samples=samples, max_distance=1.0)
    assert abs(found[0] - (1.0 - segment)) < bound(samples)
    assert away < 1.0 or found[0] == 1.0


def test_a_point_on_a_sheet_sees_out_on_both_sides_and_one_beside_it_on_its_own():
    octree = Octree.from_mesh(grid(size=(1e6, 1e6)))
    open_ = openness(octree, [[0.1, 0.0, 0.2], [-5e5, 0.0, -5e5], [0.1, 1e-3, 0.2], [0.1, -1e-3, 0.2]], samples=1000)
    assert open_[:2].tolist() == [1.0, 1.0]
    np.testing.assert_allclose(open_[2:], 0.5, atol=1e-2)


def test_a_closed_cube_from_inside_is_dark():
    octree = Octree.from_mesh(box())
    place = face_points(octree.mesh)
    assert ambient_occlusion(octree, place.points, -place.normals, leaving=place.faces).max() == 0.0
    assert ambient_occlusion(octree, place.points, place.normals, leaving=place.faces).min() == 1.0
    assert openness(octree, np.random.default_rng(5).random((50, 3))).max() == 0.0


@cases("samples", [100, 1024, 20000])
@cases("away", [1.125, 1.5, 3.0])
def test_openness_beside_a_ball(samples, away):
    """A ball of radius 1 hides the cap of half angle asin(1 / away): (1 - cos) / 2 of all directions."""
    ball = Octree.from_mesh(icosphere(5))
    found = openness(ball, [[0.0, away, 0.0], [9e9, 0, 0]], samples=samples)
    hidden = (1.0 - np.sqrt(1.0 - away**-2.0)) / 2.0
    # A circle of length up to 2 pi; parts of 4 pi / samples. The ball's faces lie inside it, by 1e-3 of the radius.
    assert abs(found[0] - (1.0 - hidden)) < 0.5 * np.sqrt(np.pi / samples) + 1e-3
    assert found[1] == 1.0


@cases(
    ("argument", "value", "said"),
    [
        ("normals", None, "vectors, got None"),
        ("normals", np.zeros((4, 3)), "not zero"),
        ("normals", np.ones((2, 3)), "shape"),
        ("samples", 0, "an integer from 1 to"),
        ("samples", 2.5, "an integer from 1 to"),
        ("samples", True, "an integer from 1 to"),
        ("max_distance", -1.0, "a number >= 0"),
        ("points", [[np.nan] * 3] * 4, "finite"),
        ("leaving", 99, "faces from 0 to 11"),
    ],
)
def test_bad_arguments_are_named(argument, value, said):
    given = {"points": np.zeros((4, 3)), "normals": np.ones((4, 3)), argument: value}
    octree = Octree.from_mesh(box())
    with pytest.raises(ValueError, match=rf"^{argument}: expected .*{said}"):
        ambient_occlusion(octree, given.pop("points"), given.pop("normals"), **given)
    if argument != "normals":
        given = {"points": np.zeros((4, 3)), argument: value}
        with pytest.raises(ValueError, match=rf"^{argument}: expected .*{said}"):
            openness(octree, given.pop("points"), **given)
