"""Height fields against a slow twin, cell by cell, with holes anywhere; what is refused."""

import doctest
from typing import Any

import numpy as np
import pytest
from array_forms import FORMS
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer import MeshError
from renderer.mesh import heightfield
from renderer.mesh.heightfield import heightfield_mesh


def test_the_example_holds():
    results = doctest.testmod(heightfield)
    assert results.failed == 0 and results.attempted > 0


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


STEPS = st.sampled_from([0.25, 1.0, 3.0])


@given(
    st.integers(0, 2**20), st.integers(2, 5), st.integers(2, 5), st.sampled_from([0.0, 0.2, 0.6, 1.0]),
    st.one_of(STEPS, st.tuples(STEPS, STEPS), st.none()), st.sampled_from([None, (100.0, -50.0, 7.0)]),
    st.sampled_from(sorted(FORMS)), st.sampled_from([0.0, 1000.0, -1000.0]),
)  # fmt: skip
@settings(max_examples=60)
def test_a_height_field_has_two_faces_for_each_cell_whose_corners_are_known(
    seed: int, rows: int, columns: int, unknown: float, spacing: Any, origin: Any, form: str, level: float
) -> None:
    """A face stays where its own corners are known; vertices that are not known lie within the bounds."""
    rng = np.random.default_rng(seed)
    heights = rng.integers(-9, 9, (rows, columns)) / 4.0 + level
    heights[rng.random((rows, columns)) < unknown] = np.nan
    options = {} if spacing is None else {"spacing": spacing}
    options |= {} if origin is None else {"origin": origin}
    mesh = heightfield_mesh(FORMS[form](heights), **options)
    step_x, step_y = np.broadcast_to(1.0 if spacing is None else spacing, 2)
    x0, y0, z0 = origin or (0.0, 0.0, 0.0)
    known = ~np.isnan(heights)
    faces = []
    for row in range(rows - 1):
        for column in range(columns - 1):
            a, b = row * columns + column, row * columns + column + 1
            c, d = b + columns, a + columns
            faces += [face for face in ([a, b, c], [a, c, d]) if known.ravel()[face].all()]
    assert mesh.faces.tolist() == faces
    grid = mesh.vertices.reshape(rows, columns, 3)
    np.testing.assert_array_equal(grid[..., 0], np.broadcast_to(x0 + step_x * np.arange(columns), (rows, columns)))
    np.testing.assert_array_equal(grid[..., 1].T, np.broadcast_to(y0 + step_y * np.arange(rows), (columns, rows)))
    np.testing.assert_array_equal(grid[..., 2][known], heights[known] + z0)
    if known.any():
        assert grid[..., 2].min() == heights[known].min() + z0 and grid[..., 2].max() == heights[known].max() + z0
    assert (mesh.face_normals()[:, 2] > 0.0).all()
