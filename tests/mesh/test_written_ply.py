"""The PLY files that meshes are saved to, read by trimesh and by the bytes alone."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from cases import cases

from renderer import Mesh, RepairWarning, load_mesh
from renderer.mesh.colormaps import COLORMAPS
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box

NAMES = {"normals": ("nx", "ny", "nz"), "colors": ("red", "green", "blue"), "texcoords": ("s", "t")}


def mesh_with(attributes: tuple[str, ...], exact: bool) -> Mesh:
    """Vertices that float32 holds or not, and what they carry; no two columns are alike."""
    k = np.arange(5.0)
    vertices = np.stack([k, k * k, 7.0 - k], axis=1) / 4.0 + (0.0 if exact else 1e-9)
    given: dict[str, Any] = {
        "normals": np.stack([k / 3.0, -k - 1.0, 0.1 + 0.0 * k], axis=1),
        "colors": np.stack([k / 7.0, 1.0 - k / 9.0, k % 2], axis=1),
        "texcoords": np.stack([k / 3.0, -k / 7.0], axis=1),
    }
    faces = [[0, 1, 2], [4, 3, 2], [1, 3, 4]]
    return Mesh(vertices, faces, **{name: given[name] for name in attributes})


@cases("exact", [True, False])
@cases("attributes", [(), ("normals",), ("colors",), ("texcoords",), tuple(NAMES)])
def test_a_file_has_what_the_mesh_has_and_nothing_else(
    tmp_path: Path, attributes: tuple[str, ...], exact: bool
) -> None:
    mesh = mesh_with(attributes, exact)
    save_ply(mesh, tmp_path / "a.ply")
    read: Any = trimesh.load(tmp_path / "a.ply", process=False)
    np.testing.assert_array_equal(read.vertices, mesh.vertices)
    np.testing.assert_array_equal(read.faces, mesh.faces)
    raw = read.metadata["_ply_raw"]["vertex"]["data"]
    assert set(raw.dtype.names) == {*"xyz", *(name for each in attributes for name in NAMES[each])}
    for each in attributes:
        found = np.stack([raw[name].ravel() for name in NAMES[each]], axis=1)
        np.testing.assert_array_equal(found, getattr(mesh, each))
    again = load_mesh(tmp_path / "a.ply")
    for each in ("vertices", "faces", *NAMES):
        np.testing.assert_array_equal(getattr(again, each), getattr(mesh, each))


CUBE = box((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))


@pytest.mark.judges("Mesh.save")
def test_a_mesh_is_saved_as_it_is(tmp_path: Path) -> None:
    mesh = mesh_with(tuple(NAMES), exact=False)
    mesh.save(tmp_path / "a.PLY")
    save_ply(mesh, tmp_path / "b.ply")
    assert (tmp_path / "a.PLY").read_bytes() == (tmp_path / "b.ply").read_bytes()


def raw(path: Path, element: str) -> Any:
    read: Any = trimesh.load(path, process=False)
    return read.metadata["_ply_raw"][element]["data"]


@pytest.mark.judges("Mesh.save")
@cases("cmap", sorted(COLORMAPS))
def test_values_become_colours_of_faces_or_vertices(tmp_path: Path, cmap: str) -> None:
    """The least and the greatest value have the map's ends, and what is no number is grey."""
    colored = Mesh(CUBE.vertices, CUBE.faces, normals=CUBE.vertex_normals(), colors=np.ones((8, 3)))
    ends = {"viridis": [[68, 1, 84], [253, 231, 37]], "magma": [[0, 0, 4], [252, 253, 191]],
            "coolwarm": [[59, 76, 192], [180, 4, 38]], "gray": [[0, 0, 0], [255, 255, 255]]}[cmap]  # fmt: skip
    for element, count in (("face", 12), ("vertex", 8)):
        values = np.linspace(2.0, 5.0, count)
        values[1] = np.nan
        colored.save(tmp_path / "a.ply", values, cmap)
        found = raw(tmp_path / "a.ply", element)
        np.testing.assert_array_equal(found["value"].ravel(), values)
        colors = np.stack([found[name].ravel() for name in ("red", "green", "blue")], axis=1)
        assert colors[[0, -1, 1]].tolist() == [*ends, [128] * 3]
        with pytest.warns(RepairWarning, match=f"left out of element {element}: value"):
            again = load_mesh(tmp_path / "a.ply")
        np.testing.assert_array_equal(again.vertices, CUBE.vertices)
        np.testing.assert_array_equal(again.normals, colored.normals)
        # A reader sees one colour a place: that of the value.
        assert (again.colors is None) == (element == "face")
        colored.save(tmp_path / "a.ply", values, cmap, limits=(5.0, 9.0))
        assert [int(raw(tmp_path / "a.ply", element)[name].ravel()[-1]) for name in ("red", "green", "blue")] == ends[0]


def test_what_values_belong_to_may_have_to_be_said(tmp_path: Path) -> None:
    tetrahedron = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    for on, element in (("faces", "face"), ("vertices", "vertex")):
        tetrahedron.save(tmp_path / "a.ply", range(4), on=on)  # type: ignore[arg-type]
        assert raw(tmp_path / "a.ply", element)["value"].ravel().tolist() == [0.0, 1.0, 2.0, 3.0]
    with pytest.raises(ValueError, match=r"^values: expected on='vertices' or on='faces'"):
        tetrahedron.save(tmp_path / "a.ply", range(4))


@pytest.mark.judges("Mesh.save")
@cases(
    ("given", "says"),
    [
        ({"path": "a.stl"}, "^path: expected a file name that ends in .ply, got "),
        ({"path": 3}, "^path: expected a string or path, got int"),
        ({"values": [1.0]}, "^values: expected 8 rows, one a vertex, or 12, one a face"),
        ({"values": np.zeros((12, 3))}, r"^values: expected one value for each of the faces, got shape \(12, 3\)"),
        ({"values": range(12), "cmap": "jet"}, "^cmap: expected one of .*'viridis'.*, got 'jet'"),
        ({"values": range(12), "cmap": None}, "^cmap: expected one of .*, got None"),
        ({"values": range(12), "limits": (1.0, 0.0)}, "^limits: expected two finite numbers, low <= high"),
        ({"values": range(12), "limits": 1.0}, "^limits: expected two finite numbers"),
        ({"values": range(12), "limits": (0.0, np.nan)}, "^limits: expected two finite numbers"),
        ({"values": range(12), "on": "points"}, "^on: expected 'vertices', 'faces' or None, got 'points'"),
    ],
)
def test_what_cannot_be_saved_is_said_and_nothing_is_written(tmp_path: Path, given: Any, says: str) -> None:
    path = given.get("path", "a.ply")
    with pytest.raises(ValueError, match=says):
        CUBE.save(**{**given, "path": tmp_path / path if isinstance(path, str) else path})
    assert not list(tmp_path.iterdir())
    with pytest.raises(OSError):
        CUBE.save(tmp_path / "no" / "folder.ply")
