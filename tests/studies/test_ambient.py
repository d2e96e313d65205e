"""Ambient occlusion and openness, against closed forms and rays that are written down."""

import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.studies import ambient_occlusion, cosine_hemisphere, face_points, openness

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
    found = ambient_occlusion(walls("x"), [[away, 0.0, 0.0]], [0, 0, 1], samples=samples, distance=1.0)
    assert abs(found[0] - (1.0 - segment)) < bound(samples)
    assert away < 1.0 or found[0] == 1.0


@cases("normal", [(0, 0, 1), (0, 0, -2), (0, 1, 0), (1, 1, 1), (-3, 2, 1e-9)])
def test_directions_are_about_each_points_normal(normal):
    """A wall across the normal's side hides half, however both are turned."""
    n = np.array(normal) / np.linalg.norm(normal)
    side = np.cross(n, [0.3, -0.7, 0.2])
    side /= np.linalg.norm(side)
    along = np.cross(n, side)
    wall = [[FAR * along - FAR * n, -FAR * along - FAR * n, FAR * n]]
    octree = Octree(np.concatenate(wall) - 1e-3 * side, [[0, 1, 2]])
    found = ambient_occlusion(octree, [[0.0, 0.0, 0.0]], [normal], samples=4096)
    assert abs(found[0] - 0.5) < bound(4096)


def frames(normals):
    """The frame of each normal, (n, 3 vectors, 3), worked out anew."""
    out = []
    for n in normals / np.linalg.norm(normals, axis=1, keepdims=True):
        first = np.cross(np.eye(3)[np.argmin(np.abs(n))], n)
        first /= np.linalg.norm(first)
        out.append([first, np.cross(n, first), n])
    return np.array(out)


def test_shares_are_those_of_rays_that_are_written_down():
    """To the rounding of the frames, which are worked out in another order here: no ray of these is so close to an
    edge.
    """
    mesh = torus()
    octree, place = Octree.from_mesh(mesh), face_points(mesh)
    ways = np.einsum("kj,njc->nkc", cosine_hemisphere(50).directions, frames(place.normals))
    starts = np.broadcast_to(place.points[:, None], ways.shape)
    hidden = octree.any_hit(starts, ways, t_max=2.5, leaving=np.repeat(place.faces[:, None], 50, axis=1))
    found = ambient_occlusion(octree, *place[:2], samples=50, distance=2.5, leaving=place.faces)
    np.testing.assert_array_equal(found, (~hidden).sum(axis=1) / 50.0)
    assert 0.5 < found.mean() < 1.0 and found.min() < 0.75 and found.max() == 1.0


def test_threads_slices_and_other_points_change_no_bit():
    octree, rng = Octree.from_mesh(torus()), np.random.default_rng(4)
    points, normals = rng.uniform(-1.3, 1.3, (900, 3)), rng.normal(size=(900, 3))
    whole = ambient_occlusion(octree, points, normals, threads=1)
    assert 0.0 < whole.mean() < 1.0
    np.testing.assert_array_equal(ambient_occlusion(octree, points, normals, threads=3), whole)
    np.testing.assert_array_equal(ambient_occlusion(octree, points[50:99], normals[50:99]), whole[50:99])
    np.testing.assert_array_equal(ambient_occlusion(octree, points, 7.0 * normals), whole)


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
        ("distance", -1.0, "a number >= 0"),
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
