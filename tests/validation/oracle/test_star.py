"""The exact judge of points in star-shaped solids: against closed forms and rational arithmetic."""

import numpy as np
import pytest

from renderer.mesh.shapes import icosphere
from validation.oracle.inside import winding_number
from validation.oracle.star import Star
from validation.oracle.vectors import rational

CORNERS = np.array([[3, 0, 0], [0, 3, 0], [-3, 0, 0], [0, -3, 0], [0, 0, 3], [0, 0, -3]], float)
FACES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]], np.int32)


def test_an_octahedron_is_where_the_sizes_of_the_coordinates_sum_to_three():
    points = np.stack(np.meshgrid(*[np.arange(-4.0, 5.0)] * 3), axis=-1).reshape(-1, 3)
    np.testing.assert_array_equal(Star(CORNERS, FACES).sides(points), np.sign(3 - np.abs(points).sum(axis=1)))


def test_it_agrees_with_rational_arithmetic():
    ball, rng = icosphere(1), np.random.default_rng(0)
    star = Star(np.round(ball.vertices * rng.uniform(5, 30, (len(ball.vertices), 1))), ball.faces)
    points = np.concatenate([rng.integers(-30, 31, (60, 3)), star.vertices[:20]]).astype(float)
    triangles = [rational(triangle) for triangle in star.vertices[star.faces]]
    numbers = [winding_number(point, triangles) for point in rational(points)]
    assert {None, 0, 1} == set(numbers)
    assert star.sides(points).tolist() == [0 if number is None else (1 if number else -1) for number in numbers]


@pytest.mark.parametrize(
    ("vertices", "faces", "said"),
    [
        (CORNERS + 0.5, FACES, "vertices: expected whole numbers"),
        (CORNERS * 2.0**20, FACES, "vertices: expected whole numbers up to"),
        (CORNERS, FACES[:, ::-1], "faces: expected all to look outwards"),
    ],
)
def test_what_it_cannot_judge_is_refused(vertices, faces, said):
    with pytest.raises(ValueError, match=said):
        Star(vertices, faces)


def test_points_and_open_meshes_that_it_cannot_judge_are_refused():
    with pytest.raises(ValueError, match="points: expected whole numbers"):
        Star(CORNERS, FACES).sides(np.array([[0.5, 0.0, 0.0]]))
    with pytest.raises(ValueError, match="points: expected whole numbers up to"):
        Star(CORNERS, FACES).sides(np.array([[2.0**16 + 1, 0.0, 0.0]]))
    assert Star(CORNERS, FACES).sides(np.array([[2.0**16, 0.0, 0.0]])) == [-1]
    with pytest.raises(ValueError, match="faces: expected a closed mesh"):
        Star(CORNERS, FACES[1:]).sides(np.array([[1.0, 1.0, 1.0]]))
