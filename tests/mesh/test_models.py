"""The committed PLY models: the script writes these very bytes, and they are what the scenes count on."""

import sys
from pathlib import Path

import numpy as np
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
