"""The committed PLY models: the script writes these very bytes, and they are what the scenes count on."""

import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from cases import cases

SCENES = Path(__file__).parents[2] / "scenes"
sys.path.insert(0, str(SCENES))

import make_models  # noqa: E402

from renderer.mesh.load import load_mesh  # noqa: E402
from renderer.mesh.mesh import Mesh  # noqa: E402

NAMES = ["teapot", "torus_knot", "displaced_sphere", "sphere", "stairs", "block"]


def load(name: str) -> Mesh:
    return load_mesh(SCENES / "models" / f"{name}.ply")


def signed_volume(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def test_the_script_writes_the_committed_bytes(tmp_path: Path) -> None:
    make_models.main(tmp_path)
    committed = {path.name: path.read_bytes() for path in (SCENES / "models").glob("*.ply")}
    assert sorted(committed) == sorted(f"{name}.ply" for name in NAMES)
    for name, content in committed.items():
        assert (tmp_path / name).read_bytes() == content, name
    assert sum(map(len, committed.values())) < 4_000_000


@cases("name", NAMES)
def test_each_piece_is_closed_and_winds_outwards(name: str) -> None:
    mesh = load(name)
    assert mesh.is_closed() and mesh.is_float32
    pieces = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).split(only_watertight=False)
    assert len(pieces) == (5 if name == "teapot" else 1)
    for piece in pieces:
        assert signed_volume(Mesh(piece.vertices, piece.faces)) > 0
    corners = np.sort(mesh.faces, axis=1)
    assert (np.diff(corners, axis=1) > 0).all()
    assert np.unique(mesh.faces).tolist() == list(range(len(mesh.vertices)))


@pytest.mark.parametrize("name", ["teapot", "torus_knot", "displaced_sphere"])
def test_the_three_models(name: str) -> None:
    mesh = load(name)
    assert 10_000 <= len(mesh.faces) <= 100_000
    assert mesh.bounds[0][1] == 0
    assert 1.5 <= mesh.extent.max() <= 2.1
    assert (np.linalg.norm(mesh.face_normals(), axis=1) > 0.5).all()  # none without area


def test_sphere() -> None:
    mesh = load("sphere")
    # float32 coordinates of at most 1 are off by at most 2^-25 each, so the radius by at most sqrt(3) 2^-25.
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=1.75 * 2.0**-25)
    assert len(mesh.faces) == 20_480


def test_stairs() -> None:
    mesh = load("stairs")
    assert [corner.tolist() for corner in mesh.bounds] == [[-2, 0, -1.25], [2, 2.5, 1.25]]
    # Five columns half as deep as one, 0.5 to 2.5 high, 4 wide.
    assert signed_volume(mesh) == 4 * 0.5 * (0.5 + 1 + 1.5 + 2 + 2.5)
    treads = mesh.triangles[(mesh.face_normals() == [0, 1, 0]).all(axis=1)]
    assert sorted(set(treads[:, 0, 1].tolist())) == [0.5, 1, 1.5, 2, 2.5]
    for tread in treads:
        height = tread[0, 1]
        assert tread[:, 2].max() == 1.75 - height and tread[:, 2].min() == 1.25 - height


def test_block() -> None:
    mesh = load("block")
    assert len(mesh.faces) == 12 and signed_volume(mesh) == 1
    assert [corner.tolist() for corner in mesh.bounds] == [[0, 0, 0], [1, 1, 1]]
