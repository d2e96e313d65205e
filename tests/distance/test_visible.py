"""Points that see each other: against closed forms and the query for any hit."""

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import box, icosphere

pytestmark = pytest.mark.judges("BruteForce.visible", "Octree.visible")


def test_a_convex_solid_hides_what_the_segment_passes():
    rng, ball = np.random.default_rng(4), icosphere(3)
    a, b = rng.normal(size=(2, 3000, 3))
    a, b = 2 * a / np.linalg.norm(a, axis=1)[:, None], 1.5 * b / np.linalg.norm(b, axis=1)[:, None]
    # How near the segment comes to the centre; the ball's faces are from 0.99 to 1 away.
    share = np.clip(-(a * (b - a)).sum(1) / ((b - a) ** 2).sum(1), 0, 1)
    nearest = np.linalg.norm(a + share[:, None] * (b - a), axis=1)
    seen = Octree.from_mesh(ball).visible(a, b)
    assert seen[nearest > 1.0].all() and not seen[nearest < 0.99].any() and 0.1 < seen.mean() < 0.9
    np.testing.assert_array_equal(seen, BruteForce.from_mesh(ball).visible(a, b))
    np.testing.assert_array_equal(seen, Octree.from_mesh(ball).visible(b, a))


@pytest.mark.parametrize("offset", [0.0, 5e5])
@pytest.mark.parametrize("given", [False, True])
def test_corners_and_middles_of_faces_see_out_and_not_through(offset, given):
    """Both ends lie on the surface, to rounding, on whichever side of it."""
    ball = icosphere(3)
    mesh = Mesh(ball.vertices + offset, ball.faces)
    octree, eye = Octree.from_mesh(mesh), np.array([3.0, 0.5, 0.25]) + offset
    centres, normals = mesh.triangles.mean(axis=1), mesh.face_normals()
    slope = ((eye - centres) * normals).sum(1) / np.linalg.norm(eye - centres, axis=1)
    faces = np.arange(len(mesh.faces)) if given else None
    sure = np.abs(slope) > 1e-3
    np.testing.assert_array_equal(octree.visible(eye, centres, reaching=faces)[sure], (slope > 0)[sure])
    np.testing.assert_array_equal(octree.visible(centres, eye, leaving=faces)[sure], (slope > 0)[sure])


def test_ends_hide_nothing_and_walls_between_do():
    octree = Octree.from_mesh(box())
    assert octree.visible([0.5, 0.5, 1.0], [0.5, 0.5, 3.0])
    assert octree.visible([0.5, 0.5, 3.0], [0.5, 0.5, 1.0])
    assert octree.visible([0.5, 0.5, 0.0], [0.5, 0.5, 1.0])
    assert octree.visible([0.5, 0.5, 1.0], [0.25, 0.5, 1.0])
    assert octree.visible([0.5, 0.5, 0.5], [0.5, 0.5, 0.5])
    # Half of the least denormal is 0, which is no direction.
    assert octree.visible([0.0, 0.0, 0.0], [[5e-324, 0.0, 0.0], [0.0, 1e-323, 1e-320]]).all()
    assert not octree.visible([0.5, 0.5, 0.5], [0.5, 0.5, 1.0 + 1e-9])
    assert not octree.visible([0.5, 0.5, -1e-9], [0.5, 0.5, 1.0])


@pytest.mark.parametrize("distance", [1.0, 30.0, 1000.0])
@pytest.mark.parametrize("given", [False, True])
def test_no_end_hides_itself_however_far_the_other_is(distance, given):
    """The room at the far end had been that of its own coordinates; the ray's roundings are those of its length."""
    ball, eye = icosphere(4), np.array([0.3, 0.8, 0.52]) * 3 * distance
    octree, centres = Octree.from_mesh(ball), ball.triangles.mean(axis=1)
    slope = ((eye - centres) * ball.face_normals()).sum(1) / np.linalg.norm(eye - centres, axis=1)
    faces = np.arange(len(ball.faces)) if given else None
    facing = slope > 1e-2
    assert octree.visible(eye, centres, reaching=faces)[facing].all()
    assert octree.visible(centres, eye, leaving=faces)[facing].all()
    assert not octree.visible(eye, centres, reaching=faces)[slope < -1e-2].any()


@pytest.mark.parametrize("accelerator", [Octree, BruteForce])
def test_an_end_beside_the_face_that_it_names_is_on_it_and_others_are_hidden(accelerator):
    """Ends 2^-18 to 2^-38 behind a face are on it if they name it, whichever end they are. Nearer than 2^-40 of 3 none
    is looked at."""
    queries, heights = accelerator([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), [-(2.0**-k) for k in range(18, 39)]
    ends = np.column_stack([np.full((len(heights), 2), 0.25), heights])
    eye = [0.2, 0.2, 3.0]
    for face in (0, np.zeros(len(ends), int)):
        assert queries.visible(eye, ends, reaching=face).all() and queries.visible(ends, eye, leaving=face).all()
    # Each row has the face that it names.
    named = np.arange(len(ends)) % 2 - 1
    np.testing.assert_array_equal(queries.visible(eye, ends, reaching=named), named == 0)
    np.testing.assert_array_equal(queries.visible(ends, eye, leaving=named), named == 0)
    for other in ({}, {"leaving": -1, "reaching": -1}):
        assert not queries.visible(eye, ends, **other).any() and not queries.visible(ends, eye, **other).any()


def test_a_small_face_at_the_origin_does_not_hide_its_point():
    octree = Octree([[0, 0, 0], [2.0**-10, 0, 0], [0, 2.0**-10, 0]], [[0, 1, 2]])
    target = [2.0**-12, 2.0**-12, 0.0]
    for eye in ([1 / 3, 1 / 7, 1.0], [3.0, 8.0, 5.2]):
        assert octree.visible(eye, target) and octree.visible(target, eye)
        assert octree.visible(eye, target, reaching=0) and octree.visible(target, eye, leaving=0)


def test_minus_one_stands_for_no_face():
    octree = Octree.from_mesh(box())
    one, other = [[0.25, 0.5, 1.0]] * 2, [[0.25, 0.7, 3.0]] * 2
    top = int(octree.closest_hit([0.25, 0.5, 3.0], [0.0, 0.0, -1.0]).face)
    for faces in (-1, [-1, top], [top, -1]):
        assert octree.visible(one, other, leaving=faces).all() and octree.visible(other, one, reaching=faces).all()
    assert octree.visible(one, one[::-1], leaving=top, reaching=top).all()


@cases("scale", [1e-200, 1e-3, 1e6, 1e250])
def test_at_any_size(scale):
    octree = Octree.from_mesh(Mesh(box().vertices * scale, box().faces))
    points = np.array([[0.5, 0.5, 3], [0.5, 0.5, 3], [3, 0.4, 3]]) * scale
    targets = np.array([[0.5, 0.5, 1], [0.4, 0.5, 0.5], [3, 0.4, -3]]) * scale
    assert octree.visible(points, targets).tolist() == [True, False, True]


def test_shapes_are_broadcast():
    octree = Octree.from_mesh(box())
    rng = np.random.default_rng(0)
    points, targets = rng.uniform(-2, 2, (4, 3)), rng.uniform(-2, 2, (5, 3))
    grid = octree.visible(points[:, None], targets)
    assert grid.shape == (4, 5)
    np.testing.assert_array_equal(grid[2], octree.visible(points[2], targets))
    assert octree.visible(np.empty((0, 3)), targets[0]).shape == (0,)
    assert octree.visible(points[0], targets[0]).shape == ()


@cases(
    ("arguments", "said"),
    [
        ({"points": [[0, 0]]}, r"points: expected shape \(\.\.\., 3\)"),
        ({"targets": [[0, 0, np.inf]]}, r"targets: expected finite numbers within .* in row 0"),
        ({"targets": np.zeros((2, 3))}, r"targets: expected a shape that goes with that of points, \(3, 3\), got"),
        ({"leaving": [0, 1]}, r"leaving: expected a number or a shape that goes with that of points and"),
        ({"leaving": 1.5}, "leaving: expected an integer"),
        ({"reaching": 99}, r"reaching: expected faces from 0 to 11, or -1, got 99 in row 0"),
    ],
)
def test_bad_input_is_named(arguments, said):
    good = {"points": np.zeros((3, 3)), "targets": np.ones((3, 3))}
    with pytest.raises(ValueError, match=said):
        Octree.from_mesh(box()).visible(**{**good, **arguments})


def test_near_the_origin_a_far_surface_does_not_hide_itself():
    """The room at both ends is that of the larger coordinates."""
    ball = icosphere(3)
    mesh, eye = Mesh(ball.vertices + 1e6, ball.faces), np.array([0.3, 0.2, 0.1])
    octree, centres = Octree.from_mesh(mesh), mesh.triangles.mean(axis=1)
    slope = ((eye - centres) * mesh.face_normals()).sum(1) / np.linalg.norm(eye - centres, axis=1)
    sure = np.abs(slope) > 1e-2
    np.testing.assert_array_equal(octree.visible(eye, centres)[sure], (slope > 0)[sure])


@pytest.mark.parametrize("named", [False, True])
def test_beside_an_end_on_the_surface_all_is_looked_at_and_beside_others_nothing(named):
    """A wall nearer than 2^-40 of 64 hides an end that lies on a face below it, whether that is named or not."""
    corners, heights = np.array([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]]), (0.0, 2.0**-37, 64.0)
    vertices = np.concatenate([np.add(corners, [0, 0, z]) for z in heights])
    point, target = [0.25, 0.5, 0.0], [0.25, 0.5, 64.0]
    octree = Octree(vertices, np.arange(9).reshape(-1, 3))
    assert not octree.visible(point, target, **({"leaving": 0, "reaching": 2} if named else {}))
    assert not octree.visible(target, point, **({"leaving": 2, "reaching": 0} if named else {}))
    assert not octree.visible(point, target, **({"leaving": 0} if named else {}))
    assert not octree.visible(target, point, **({"reaching": 0} if named else {}))
    # Without the face the end is in the open.
    octree = Octree(vertices[3:], np.arange(6).reshape(-1, 3))
    assert octree.visible(point, target, reaching=1 if named else None)
    assert octree.visible(target, point, leaving=1 if named else None)
