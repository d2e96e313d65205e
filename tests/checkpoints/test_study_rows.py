"""The points that a study is made for and the values of its faces and vertices, on meshes of a few faces."""

from pathlib import Path

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray
from twins import CORNERS, MESH, NORMALS, meetings

from renderer import Mesh, Octree
from renderer.studies.points import of_file, on_faces, on_grid, on_vertices
from renderer.studies.sun_files import suns_of

Floats = NDArray[np.float64]

# A pyramid's side, a face without area, another of twice the area, and a vertex of no face.
FEW = Mesh(
    [[0, 0, 0], [2, 0, 0], [0, 2, 0], [9, 9, 9], [0, 0, 4], [4, 0, 0]],
    [[0, 1, 2], [0, 1, 5], [0, 4, 2], [1, 2, 4]],
)
ANSWERS = np.array([3.0, 5.0, 11.0])  # of the faces that have an area


def test_points_and_values_of_faces() -> None:
    chosen = on_faces(Octree.from_mesh(FEW))
    assert chosen.points.leaving.tolist() == [0, 2, 3] and chosen.of_vertices is None and chosen.of_faces is not None
    np.testing.assert_allclose(chosen.points.points, FEW.triangles[[0, 2, 3]].mean(axis=1), rtol=1e-15)
    np.testing.assert_allclose(chosen.points.normals, [[0, 0, 1], [-1, 0, 0], np.array([2, 2, 1]) / 3], atol=1e-15)
    np.testing.assert_array_equal(chosen.of_faces(ANSWERS), [3.0, np.nan, 5.0, 11.0])


def test_values_of_vertices_are_means_by_area_and_none_where_no_face_is() -> None:
    """The areas are 2, 4 and 6."""
    chosen = on_vertices(Octree.from_mesh(FEW))
    assert chosen.of_vertices is not None and chosen.of_faces is None
    assert chosen.points.leaving.tolist() == [0, 2, 3]
    means = [(2 * 3 + 4 * 5) / 6, (2 * 3 + 6 * 11) / 8, (2 * 3 + 4 * 5 + 6 * 11) / 12]
    found = chosen.of_vertices(ANSWERS)
    np.testing.assert_allclose(found, [*means, np.nan, (4 * 5 + 6 * 11) / 10, np.nan], rtol=1e-15)


@pytest.mark.parametrize("spacing", [0.75, 3.0, 100.0])
def test_a_grid_goes_row_by_row_along_x_and_lies_on_what_is_first_from_above(spacing: float) -> None:
    """Rows from the least x and y on, half a spacing in; where nothing is below there is no point."""
    lower, upper = MESH.bounds
    x, y = (np.arange(low + spacing / 2, high + 1e-9, spacing) for low, high in zip(lower[:2], upper[:2], strict=True))
    if spacing == 100.0:
        with pytest.raises(ValueError, match="spacing: expected points above the mesh"):
            on_grid(Octree.from_mesh(MESH), spacing)
        return
    above = np.array([[a, b, 99.0] for b in y for a in x])
    t = meetings(CORNERS, above, np.broadcast_to([0.0, 0.0, -1.0], above.shape))
    t[np.isnan(t)] = np.inf
    rows = np.flatnonzero(np.isfinite(t.min(axis=1)))
    points = on_grid(Octree.from_mesh(MESH), spacing).points
    expected = above[rows] - [[0.0, 0.0, 1.0]] * t.min(axis=1)[rows, None]
    np.testing.assert_allclose(points.points, expected, atol=1e-12)
    np.testing.assert_array_equal(points.leaving, t.argmin(axis=1)[rows])
    assert 0 < len(rows) < len(above) and (points.normals == NORMALS[points.leaving]).all()


def test_a_grid_stands_on_the_upper_side_of_a_sheet_that_is_turned_down() -> None:
    sheet = Mesh([[0, 0, 1], [4, 0, 1], [0, 4, 3]], [[0, 2, 1]])
    points = on_grid(Octree.from_mesh(sheet), 1.0).points
    np.testing.assert_allclose(
        points.normals, np.tile(np.array([0.0, -1.0, 2.0]) / 5**0.5, (len(points), 1)), atol=1e-15
    )


def test_a_grids_points_at_the_meshs_edge_are_on_it() -> None:
    corners = [[0, 0, 0], [1.5, 0, 0], [1.5, 1.5, 0], [0, 1.5, 0]]
    found = on_grid(Octree(corners, [[0, 1, 2], [0, 2, 3]]), 1.0).points.points
    assert sorted(map(tuple, found[:, :2].tolist())) == [(0.5, 0.5), (0.5, 1.5), (1.5, 0.5), (1.5, 1.5)]


@cases("kind", ["<f8", ">f4", "<i2", "Fortran"])
def test_points_of_a_file_are_read_in_their_rows(tmp_path: Path, kind: str) -> None:
    rows = np.array([[1, 2, 3, 0, 0, -2], [4, 5, 6, 1, 0, 0], [7, 8, 9, 0, 3, 4]])
    written = np.asfortranarray(rows.astype("<f8")) if kind == "Fortran" else rows.astype(kind)
    np.save(tmp_path / "six.npy", written)
    np.save(tmp_path / "three.npy", written[:, :3])
    six, three = (of_file(Octree.from_mesh(FEW), tmp_path / f"{name}.npy").points for name in ("six", "three"))
    np.testing.assert_array_equal(six.points, rows[:, :3])
    np.testing.assert_array_equal(six.normals, rows[:, 3:])
    np.testing.assert_array_equal(three.points, rows[:, :3])
    np.testing.assert_array_equal(three.normals, [[0, 0, 1]] * 3)
    assert six.leaving.tolist() == three.leaving.tolist() == [-1] * 3


@pytest.mark.parametrize("hours", [True, False])
def test_suns_are_read_in_their_rows_with_their_hours(tmp_path: Path, hours: bool) -> None:
    rows = ["1 0 2", "# a comment", " -3,4,5", "", "  # another", "6\t-7, 8e-1"]
    last = [" 0.5", "", " ,1.5", "", "", ",2"] if hours else [""] * 6
    (tmp_path / "suns.txt").write_text("\n".join(a + b for a, b in zip(rows, last, strict=True)))
    suns, weights, have_horizon = suns_of(tmp_path / "suns.txt")
    np.testing.assert_array_equal(suns, [[1, 0, 2], [-3, 4, 5], [6, -7, 0.8]])
    np.testing.assert_array_equal(weights, [0.5, 1.5, 2.0] if hours else np.ones(3))
    assert not have_horizon
