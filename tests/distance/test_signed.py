"""Signed distances: positive outside, negative inside, 0 on the surface."""

import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.mesh.shapes import box
from validation.stability.cases.queries.inside import closed_solids, points_at, winding_numbers

pytestmark = pytest.mark.judges("Octree.signed_distance")


SOLIDS = closed_solids()


@cases("name", SOLIDS)
def test_the_sign_is_that_of_exact_arithmetic(name):
    mesh = SOLIDS[name]
    points = points_at(mesh, np.random.default_rng(2), 5)
    # A distance of 5e-324 comes out as 0.
    points[np.abs(points) < 1e-300] = 0.0
    numbers = winding_numbers(mesh, points)
    expected = [0 if number is None else (-1 if number else 1) for number in numbers]
    octree = Octree.from_mesh(mesh)
    distances = octree.signed_distance(points)
    np.testing.assert_array_equal(np.sign(distances), expected)
    np.testing.assert_array_equal(np.abs(distances), octree.closest_point(points).distance)
    assert not np.signbit(distances[distances == 0.0]).any()


def test_rules_and_open_meshes():
    mesh = box((-1, -1, -1), (1, 1, 1))
    faces = mesh.faces.copy()
    faces[::2] = faces[::2, ::-1]
    octree = Octree(mesh.vertices, faces)
    assert octree.signed_distance([[0, 0, 0.5]], rule="even-odd").tolist() == [-0.5]
    with pytest.raises(ValueError, match=r"mesh: expected a closed mesh .*, got .* open edges"):
        octree.signed_distance([[0, 0, 0.5]])
