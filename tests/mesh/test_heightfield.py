"""Height fields: where vertices lie, which way faces look, and holes."""

import doctest

import numpy as np
import pytest
from cases import cases

from renderer import MeshError, Octree
from renderer.mesh import heightfield
from renderer.mesh.heightfield import heightfield_mesh


def test_the_example_holds():
    results = doctest.testmod(heightfield)
    assert results.failed == 0 and results.attempted > 0


def test_vertices_are_the_grids_and_faces_look_up():
    heights = np.random.default_rng(1).random((4, 6))
    mesh = heightfield_mesh(heights, (2.0, 3.0), (100.0, -50.0, 7.0))
    expected = [[100.0 + 2.0 * j, -50.0 + 3.0 * i, heights[i, j] + 7.0] for i in range(4) for j in range(6)]
    np.testing.assert_array_equal(mesh.vertices, expected)
    assert len(mesh.faces) == 2 * 3 * 5 and (mesh.face_normals()[:, 2] > 0.0).all()
    down = Octree.from_mesh(mesh).closest_hit(np.add(expected, [0.0, 0.0, 9.0]), [0.0, 0.0, -1.0])
    np.testing.assert_allclose(down.t, 9.0, atol=1e-12)


def test_nothing_is_built_around_unknown_heights():
    heights = np.arange(20.0).reshape(4, 5)
    heights[1, 1] = np.nan
    mesh = heightfield_mesh(heights)
    # Of the four cells around it the diagonal ones keep no face where both have the corner, the others one.
    assert len(mesh.faces) == 24 - 6 and 6 not in mesh.faces
    assert mesh.bounds[0].tolist() == [0, 0, 0] and mesh.bounds[1].tolist() == [4, 3, 19]
    assert len(heightfield_mesh(np.full((3, 3), np.nan)).faces) == 0


@cases(
    ("argument", "value", "said"),
    [
        ("grid", [1, 2, 3], "shape"),
        ("grid", [[1, 2]], "at least 2"),
        ("grid", [[0, 1], [np.inf, 0]], "got inf in row 1, column 0"),
        ("grid", [["a", "b"]] * 2, "real numbers"),
        ("spacing", 0, "> 0"),
        ("spacing", (1, 2, 3), "two"),
        ("spacing", np.nan, "> 0"),
        ("origin", (0, 0), "three finite numbers"),
        ("origin", (0, 0, np.inf), "three finite numbers"),
    ],
)
def test_bad_arguments_are_named(argument, value, said):
    given = {"grid": np.zeros((3, 3)), argument: value}
    with pytest.raises(ValueError, match=rf"^{argument}: expected .*{said}"):
        heightfield_mesh(**given)


def test_heights_beyond_float64_are_refused():
    with pytest.raises(MeshError, match="finite"):
        heightfield_mesh([[1e308, 0], [0, 0]], origin=(0, 0, 1e308))
