"""Repair: what is bad in a mesh is left out and reported; what is good stays as it was, to the bit."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st
from meshes import assert_same_hits, make_mesh, rays_at

from renderer.errors import MeshError
from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh, RepairWarning
from renderer.octree import BruteForce, Octree

pytestmark = pytest.mark.judges(
    "BruteForce", "BruteForce.from_mesh", "Mesh", "Mesh.repaired", "Octree", "RepairWarning", "Repairs", "load_mesh"
)


BAD = [np.nan, np.inf, -np.inf]
# A good triangle, one with a bad vertex, two with indices out of range, a good one.
VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, np.nan, 0], [0, 0, 1]]
FACES = [[0, 1, 2], [0, 1, 3], [0, 1, 99], [-1, 0, 1], [0, 1, 4]]
RAYS = ([[0.25, 0.25, 2.0], [0.25, 2.0, 0.25], [5, 5, 5]], [[0, 0, -1], [0, -1, 0], [0, 0, 1]])


def test_the_bad_is_dropped_and_reported() -> None:
    mesh, repairs = Mesh.repaired(VERTICES, FACES, name="pot")
    assert mesh.name == "pot" and mesh.faces.tolist() == [[0, 1, 2], [0, 1, 4]]
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [0, 0, 1]]
    assert repairs.dropped_faces.tolist() == [1, 2, 3] and repairs.bad_vertices.tolist() == [3]
    assert repairs.kept_faces.tolist() == [0, 4]
    for rows in (repairs.dropped_faces, repairs.bad_vertices, repairs.kept_faces):
        assert rows.dtype == np.int64 and not rows.flags.writeable
    assert repairs and str(repairs) == "dropped 3 of 5 faces; 1 vertices are not finite"


def test_a_bad_vertex_that_no_face_names_is_reported() -> None:
    mesh, repairs = Mesh.repaired([*VERTICES[:3], [np.inf, 0, 0]], [[0, 1, 2]])
    assert repairs and repairs.bad_vertices.tolist() == [3] and not len(repairs.dropped_faces)
    assert mesh.extent.tolist() == [1, 1, 0]


@given(st.sampled_from(["soup", "lattice", "duplicates", "sizes"]), st.integers(0, 2**20), st.integers(0, 40))
def test_right_input_stays_as_it_is(kind: str, seed: int, count: int) -> None:
    vertices, faces = make_mesh(kind, seed, count)
    expected = Mesh(vertices, faces)
    mesh, repairs = Mesh.repaired(vertices, faces)
    assert not repairs and repairs.kept_faces.tolist() == list(range(len(faces)))
    assert mesh.vertices.tobytes() == expected.vertices.tobytes() and mesh.faces.tobytes() == expected.faces.tobytes()


@given(st.integers(0, 2**20), st.integers(1, 30), st.floats(0, 0.5))
def test_against_a_slow_loop(seed: int, count: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = make_mesh("lattice", seed, count)
    vertices[rng.random(vertices.shape) < share] = rng.choice(BAD)
    faces[rng.random(faces.shape) < share] = rng.choice([-1, len(vertices), 2**31 - 1])
    kept = [
        row
        for row, face in enumerate(faces.tolist())
        if all(0 <= k < len(vertices) and all(abs(x) < np.inf for x in vertices[k].tolist()) for k in face)
    ]
    mesh, repairs = Mesh.repaired(vertices, faces)
    assert repairs.kept_faces.tolist() == kept and mesh.faces.tolist() == faces[kept].tolist()
    assert sorted(kept + repairs.dropped_faces.tolist()) == list(range(count))
    assert np.array_equal(mesh.triangles, vertices[faces[kept]])


def test_attributes_stay_and_those_of_bad_vertices_are_zero() -> None:
    normals, texcoords = np.full((5, 3), 2.0), np.full((5, 2), 3.0)
    normals[3], texcoords[3] = np.nan, np.inf
    mesh, _ = Mesh.repaired(VERTICES, FACES, normals, np.full((5, 3), 0.5), texcoords)
    assert mesh.normals is not None and mesh.normals[:, 0].tolist() == [2, 2, 2, 0, 2]
    assert mesh.colors is not None and mesh.colors.dtype == np.float32
    assert mesh.colors[:, 0].tolist() == [0.5, 0.5, 0.5, 0, 0.5]
    assert mesh.texcoords is not None and mesh.texcoords[:, 1].tolist() == [3, 3, 3, 0, 3]


def test_the_given_arrays_stay() -> None:
    vertices, faces, normals = np.array(VERTICES), np.array(FACES), np.full((5, 3), np.nan)
    normals[[0, 1, 2, 4]] = 1
    before = [a.tobytes() for a in (vertices, faces, normals)]
    for array in (vertices, faces, normals):
        array.flags.writeable = False
    Mesh.repaired(vertices, faces, normals)
    assert [a.tobytes() for a in (vertices, faces, normals)] == before


# --- accelerators ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("accelerator", [Octree, BruteForce])
class TestAccelerators:
    def test_hits_name_the_repaired_mesh(self, accelerator: Any) -> None:
        built = accelerator(VERTICES, FACES, repair=True)
        hits = built.closest_hit(*RAYS)
        assert hits.face.tolist() == [0, 1, -1] and hits.t.tolist() == [2, 2, np.inf]
        assert built.repairs.kept_faces[hits.face[hits.hit]].tolist() == [0, 4]
        assert_same_hits(hits, accelerator.from_mesh(built.mesh).closest_hit(*RAYS))
        assert built.any_hit(*RAYS).tolist() == [True, True, False]

    def test_repairs_are_none_unless_asked_for(self, accelerator: Any) -> None:
        assert accelerator(VERTICES[:3], FACES[:1]).repairs is None
        assert accelerator.from_mesh(Mesh(VERTICES[:3], FACES[:1])).repairs is None  # type: ignore[arg-type]
        assert not accelerator(VERTICES[:3], FACES[:1], repair=True).repairs

    @pytest.mark.parametrize("bad", [None, 1, "yes", [True]])
    def test_repair_is_true_or_false(self, accelerator: Any, bad: Any) -> None:
        with pytest.raises(ValueError, match=r"^repair: expected True or False, got"):
            accelerator(VERTICES, FACES, repair=bad)


@given(st.integers(0, 2**20), st.sampled_from(["midpoint", "sah"]))
def test_an_octree_with_repairs_finds_what_brute_force_finds_in_the_good_faces(seed: int, split: Any) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = make_mesh("soup", seed, 60)
    origins, directions = rays_at(vertices, faces, seed, 10)
    vertices[rng.integers(0, len(vertices), 5), rng.integers(0, 3, 5)] = rng.choice(BAD, 5)
    faces[rng.integers(0, len(faces), 5), rng.integers(0, 3, 5)] = rng.choice([-1, len(vertices)], 5)
    octree = Octree(vertices, faces, repair=True, split=split, threads=1)
    assert octree.repairs is not None
    good = BruteForce(np.nan_to_num(vertices, posinf=0, neginf=0), faces[octree.repairs.kept_faces], threads=1)
    assert_same_hits(octree.closest_hit(origins, directions), good.closest_hit(origins, directions))


# --- files ----------------------------------------------------------------------------------------------------


def ply_text(vertices: str, faces: str) -> bytes:
    counts = vertices.count(",") + 1, faces.count(",") + 1
    header = (
        f"ply\nformat ascii 1.0\nelement vertex {counts[0]}\nproperty float x\nproperty float y\nproperty float z\n"
    )
    header += f"element face {counts[1]}\nproperty list uchar int vertex_indices\nend_header\n"
    return (header + vertices.replace(",", "\n") + "\n" + faces.replace(",", "\n") + "\n").encode()


def ply_binary(order: str) -> bytes:
    name = {"<": "little", ">": "big"}[order]
    header = ply_text("0 0 0,1 0 0,0 1 0,0 nan 0,0 0 1", "0,0,0,0").split(b"end_header\n")[0] + b"end_header\n"
    body = b"".join(struct.pack(order + "3f", *row) for row in VERTICES)
    for face in (FACES[0], FACES[1], FACES[2], FACES[4]):
        body += struct.pack(order + "B3i", 3, *face)
    return header.replace(b"ascii", f"binary_{name}_endian".encode()) + body


OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 nan 0\nv 0 0 1\n"
OBJ_NORMALS = "vn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 2//1 4//1\nf 1//1 7//1 3//1\nf 1//1 2//1 5//1\n"
STL_RECORDS = [VERTICES[:3], [[0, 0, 0], [1, 0, 0], [0, np.inf, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, 1]]]
STL = b"x" * 80 + struct.pack("<I", 3) + b"".join(struct.pack("<12fH", *[0] * 3, *np.ravel(r), 0) for r in STL_RECORDS)
FILES = {
    "ascii.ply": (ply_text("0 0 0,1 0 0,0 1 0,0 nan 0,0 0 1", "3 0 1 2,3 0 1 3,3 0 1 99,3 0 1 4"), 2, 4, 1),
    "little.ply": (ply_binary("<"), 2, 4, 1),
    "big.ply": (ply_binary(">"), 2, 4, 1),
    "plain.obj": ((OBJ + "f 1 2 3\nf 1 2 4\nf 1 2 99\nf -9 1 2\nf 0 1 2\nf 1 2 5\n").encode(), 4, 6, 1),
    "normals.obj": ((OBJ + OBJ_NORMALS).encode(), 2, 4, 1),
    "binary.stl": (STL, 1, 3, 1),
}  # fmt: skip


@cases("name", FILES)
def test_files(tmp_path: Path, name: str) -> None:
    content, dropped, of, bad = FILES[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeshError, match=name):
        load_mesh(path)
    with pytest.warns(RepairWarning) as caught:
        mesh = load_mesh(path, repair=True)
    expected = f"{path}: dropped {dropped} of {of} faces; {bad} vertices are not finite"
    assert [str(w.message) for w in caught] == [expected] and caught[0].filename == __file__
    assert mesh.triangles.tolist() == [[VERTICES[k] for k in face] for face in (FACES[0], FACES[4])]
    assert mesh.name == path.stem
    assert Octree.from_mesh(mesh).closest_hit(*RAYS).face.tolist() == [0, 1, -1]


@cases(
    ("name", "content", "message"),
    [
        (
            "a.ply",
            ply_text("0 0 0,1 0 0,0 nan 0", "3 0 1 2"),
            "holds no good faces: dropped 1 of 1 faces; 1 vertices are not finite",
        ),
        ("a.obj", (OBJ + "f 1 2 9\n").encode(), "holds no good faces: dropped 1 of 1 faces"),
        ("a.obj", OBJ.encode(), "holds no good faces: dropped 0 of 0 faces; 1 vertices"),
        ("a.ply", ply_text("0 0 0,1 0 0,0 1 0", "2 0 1"), "holds no good faces: left out: faces of fewer"),
        ("a.ply", ply_text("0 0 0,1 0 0,0 1 x", "3 0 1 2"), "malformed number"),
        ("a.obj", b"v 0 0 0\nf 1 x 1\n", "line 2: "),
        ("a.stl", STL[:-1], "expected text"),
    ],
)
def test_files_that_cannot_be_repaired(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeshError) as caught:
        load_mesh(path, repair=True)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_a_polygon_loses_only_the_triangles_that_name_the_bad_vertex(tmp_path: Path) -> None:
    path = tmp_path / "fan.ply"
    path.write_bytes(ply_text("0 0 0,1 0 0,1 1 0,0 nan 0,0 1 0,0 .5 0", "6 0 1 2 3 4 5"))
    with pytest.warns(RepairWarning, match="dropped 2 of 4 faces"):
        assert load_mesh(path, repair=True).faces.tolist() == [[0, 1, 2], [0, 4, 5]]


def test_glb(tmp_path: Path) -> None:
    import trimesh

    path = tmp_path / "a.glb"
    good = trimesh.Trimesh(np.array(VERTICES[:3], float), [[0, 1, 2]], process=False)
    content = bytearray(trimesh.Scene(good).export(file_type="glb"))
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    at = content.index(vertices)
    content[at : at + 4] = struct.pack("<f", np.nan)
    path.write_bytes(content)
    with pytest.raises(MeshError, match=r"a\.glb: holds no good faces: dropped 1 of 1 faces; 1 vertices"):
        load_mesh(path, repair=True)
    # The exporter stores equal meshes once, so the second is another.
    other = trimesh.Trimesh(np.add(VERTICES[:3], 7.0), [[0, 1, 2]], process=False)
    content = bytearray(trimesh.Scene([good, other]).export(file_type="glb"))
    at = content.index(vertices)
    content[at : at + 4] = struct.pack("<I", 0x7FA00000)  # a signalling NaN, whose cast would warn
    path.write_bytes(content)
    with pytest.warns(RepairWarning, match=r"a\.glb: dropped 1 of 2 faces; 1 vertices"):
        mesh = load_mesh(path, repair=True)
    assert mesh.triangles.tolist() == other.triangles.tolist()
