"""Faces of very different sizes in one mesh: traced right as far as products reach, and refused beyond."""

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, MeshError, Octree
from renderer.arguments.limits import SHORTEST
from renderer.mesh.shapes import box, icosphere
from renderer.octree import _LEAST_SIDE, _ROWS
from validation.oracle import exact

BALL = icosphere(2)
UNIT = np.array([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [3.0, 1.0, 0.0]])


def beside_a_triangle(radius):
    """A ball about the origin of that radius, beside a triangle of size 1."""
    vertices = np.concatenate([BALL.vertices * radius, UNIT])
    return vertices, np.concatenate([BALL.faces, [[len(vertices) - 3, len(vertices) - 2, len(vertices) - 1]]])


def directions(count=300):
    return np.random.default_rng(7).normal(size=(count, 3))


@cases("radius", [1.0, 1e-20, 1e-40, 1e-80, 1e-98])
@cases("kind", [Octree, BruteForce])
def test_a_closed_ball_of_any_size_that_is_taken_leaks_nowhere(kind, radius):
    vertices, faces = beside_a_triangle(radius)
    hits = kind(vertices, faces).closest_hit([0, 0, 0], directions())
    assert (hits.face >= 0).all()
    assert (hits.face < len(BALL.faces)).all()
    truth = exact.closest_hits(vertices, faces, np.zeros((300, 3)), directions())
    t = np.array([float(hit.t) for hit in truth])
    # As elsewhere: some tens of roundings, of t itself.
    np.testing.assert_allclose(hits.t, t, rtol=64 * 2.0**-53)


@cases("radius", [1e-101, 1e-108, 1e-165, 1e-300])
@cases("kind", [Octree, BruteForce])
def test_smaller_ones_beside_it_are_refused_by_row(kind, radius):
    with pytest.raises(MeshError, match=r"faces: expected a second longest side .* 4.57e-100, got .* in row \d+"):
        kind(*beside_a_triangle(radius))


def test_alone_a_ball_of_any_size_is_taken():
    for radius in (1e-108, 1e-165, 1e-300, 1e300):
        assert Octree(BALL.vertices * radius, BALL.faces).closest_hit([0, 0, 0], directions()).hit.all()


def test_lines_and_points_of_any_size_are_taken_and_never_hit():
    vertices = np.concatenate([[[0, 0, 0], [1e-200, 0, 0], [1e-300, 0, 0]], UNIT])
    octree = Octree(vertices, [[0, 1, 2], [0, 0, 0], [3, 4, 5]])
    assert octree.closest_hit([3.1, 0.1, 1], [0, 0, -1]).face == 2
    assert not octree.any_hit([0, 0, 1], [[0, 0, -1], [1e-201, 0, -1]]).any()


@pytest.mark.judges("Octree.refit")
def test_a_refit_to_such_faces_is_refused_and_changes_nothing():
    vertices, faces = beside_a_triangle(1.0)
    octree = Octree(vertices, faces)
    with pytest.raises(MeshError, match="second longest side"):
        octree.refit(beside_a_triangle(1e-165)[0])
    assert octree.closest_hit([0, 0, 0], directions()).hit.all()


@pytest.mark.parametrize("count", [_ROWS, _ROWS + 1, _ROWS + 2])
def test_one_small_corner_is_found_wherever_it_is_listed(count):
    """Vertices are looked through in pieces, of which the last may be a single row."""
    for row in (0, count // 2, count - 1):
        vertices = np.ones((count, 3))
        vertices[[1, 2]] = 0.0
        vertices[row] = [1e-200, 1e-200, 0.0]
        assert row not in (1, 2)
        with pytest.raises(MeshError, match=r"second longest side .* in row 0"):
            Octree(vertices, [[1, 2, row]])


def test_the_bound_is_where_it_says():
    side = _LEAST_SIDE
    for factor, taken in ((1.0, True), (1 - 2.0**-52, False)):
        vertices = np.concatenate([[[0, 0, 0], [1, 0, 0], [0, side * factor, 0]], UNIT])
        if taken:
            Octree(vertices, [[0, 1, 2], [3, 4, 5]])
        else:
            with pytest.raises(MeshError):
                Octree(vertices, [[0, 1, 2], [3, 4, 5]])


@cases("exponent", [-320, -200, -108, -40])
def test_no_hit_is_at_infinity_or_minus_zero(exponent):
    octree = Octree(UNIT * [1, 1, 0], [[0, 1, 2]])
    z = 10.0**exponent
    hits = octree.closest_hit([[3.2, 0.2, z], [3.2, 0.2, -z], [3.2, 0.2, 0.0]], [0.0, 0.0, -1.0])
    assert hits.face[0] == 0
    assert not np.signbit(hits.t).any()
    assert np.isfinite(hits.t[hits.hit]).all()


@cases("accelerator", [Octree, BruteForce])
@cases("side", [2.0**-329, 1e-90, 1e-72])
def test_the_smallest_box_with_the_shortest_directions_leaks_nowhere(accelerator, side):
    """A determinant times a direction vanished: rays passed the box to the triangle behind it, and t was wrong."""
    small = box((-0.37, -0.37, -0.37), (0.63, 0.63, 0.63))
    vertices = np.concatenate([small.vertices * side, [[1, 1, 1], [1, 2, 1], [2, 1, 1]]])
    queries = accelerator(vertices, np.concatenate([small.faces, [[8, 9, 10]]]))
    directions = np.random.default_rng(0).normal(size=(500, 3))
    directions /= np.abs(directions).max(axis=1)[:, None]
    plain, short = (queries.closest_hit([0, 0, 0], directions * d) for d in (1.0, SHORTEST))
    assert plain.hit.all() and (plain.face < 12).all()
    np.testing.assert_array_equal(short.face, plain.face)
    np.testing.assert_array_equal(short.t * SHORTEST, plain.t)
