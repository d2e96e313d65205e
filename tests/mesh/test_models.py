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
from renderer.studies.factors.surfaces import areas_of  # noqa: E402

NAMES = ["teapot", "torus_knot", "displaced_sphere", "sphere", "stairs", "block"]
# A room that is open towards the camera.
CORNELL = ["cornell_white", "cornell_red", "cornell_green", "cornell_lamp"]


def load(name: str) -> Mesh:
    return load_mesh(SCENES / "models" / f"{name}.ply")


def signed_volume(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def test_the_script_writes_the_committed_bytes(tmp_path: Path) -> None:
    make_models.main(tmp_path)
    committed = {path.name: path.read_bytes() for path in (SCENES / "models").glob("*.ply")}
    assert sorted(committed) == sorted(f"{name}.ply" for name in [*NAMES, *CORNELL])
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


def test_the_cornell_box_is_lit_from_within_and_open_towards_the_camera() -> None:
    room = Mesh.concatenate([load(name) for name in CORNELL])
    middle = np.array([278.0, 274.0, 279.0])
    walls = np.abs(room.triangles.mean(axis=1) - middle).max(axis=1) > 250
    inwards = np.einsum("nk,nk->n", room.face_normals(), middle - room.triangles.mean(axis=1))
    assert (inwards[walls] > 0).all() and walls.sum() == 18
    # Where it is open, edges lie at z = 0, or on the floor beneath the blocks.
    joined, _ = room.welded()
    ends = joined.vertices[joined.open_edges]
    assert ((ends[..., 2] == 0).all(axis=1) | (ends[..., 1] == 0).all(axis=1)).all()
    lamp, wall = (areas_of(load(name)).sum() for name in ("cornell_lamp", "cornell_green"))
    assert np.isclose(lamp, 130 * 105) and np.isclose(wall, 548.8 * 559.2)
