"""The PLY files that meshes are saved to, read by trimesh and by the bytes alone."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from cases import cases

from renderer import Mesh, load_mesh
from renderer.mesh.load import save_ply

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
