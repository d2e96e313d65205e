"""Parts of meshes: groups and objects of OBJ, nodes of GLB, and joined meshes; and how far they travel."""

import copy
import dataclasses
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from cases import cases
from glb_bytes import Glb

from renderer import BruteForce, Mesh, Octree, load_mesh
from renderer.mesh import obj
from renderer.mesh.load import parse_mesh
from renderer.mesh.reading import Reading
from renderer.mesh.shapes import box, icosphere

pytestmark = pytest.mark.judges("Mesh.parts")

VERTICES = "".join(f"v {k} {k * k} {k % 3}\n" for k in range(8))


def named(mesh: Mesh) -> list[tuple[str, int, int]]:
    return [(part.name, part.faces.start, part.faces.stop) for part in mesh.parts]


# --- OBJ --------------------------------------------------------------------------------------------------------------

FILES: dict[str, tuple[str, list[tuple[str, int, int]]]] = {
    "no group": ("f 1 2 3\nf 2 3 4\n", [("", 0, 2)]),
    "groups": ("g a\nf 1 2 3\ng b\nf 2 3 4\nf 3 4 5\n", [("a", 0, 1), ("b", 1, 3)]),
    "objects, polygons before": ("f 1 2 3 4\no wall north # x\nf 1 2 3 4 5\n", [("", 0, 2), ("wall north", 2, 5)]),
    "the last of o and g": ("o house\ng roof\nf 1 2 3\no tree\nf 2 3 4\n", [("roof", 0, 1), ("tree", 1, 2)]),
    "empty ones, and the same again": ("g a\ng b\nf 1 2 3\nusemtl x\ng b\nf 2 3 4\ng c\n", [("b", 0, 2)]),
    "one comes back": ("g a\nf 1 2 3\ng b\nf 1 2 3\ng a\nf 1 2 3\n", [("a", 0, 1), ("b", 1, 2), ("a", 2, 3)]),
    "no name": ("g\nf 1 2 3\ng x\nf 1 2 3\n", [("", 0, 1), ("x", 1, 2)]),
    "accents": ("g Ärger\nf 1 2 3\n", [("Ärger", 0, 1)]),
}


@cases("name", FILES)
@cases("common", [True, False])
def test_groups_and_objects_of_obj(name: str, common: bool) -> None:
    """By either reader: a line that begins with a blank is left to the slower one."""
    text, expected = FILES[name]
    content = (VERTICES + text + ("" if common else " v 9 9 9\n")).encode()
    assert (obj._read_common(content) is not None) == common
    assert named(parse_mesh(content, ".obj")) == expected


def test_repairs_move_the_ends_of_parts() -> None:
    bad = VERTICES + "g a\nf 1 2 99\nf 1 2 3\ng b\nf 2 3 99 4\ng c\nf 2 3 4 5\n"
    mesh = parse_mesh(bad.encode(), ".obj", Reading(repair=True))
    assert named(mesh)[0] == ("a", 0, 1) and named(mesh)[-1][0] == "c" and named(mesh)[-1][2] == len(mesh.faces)
    assert {tuple(face) for face in mesh.faces[mesh.parts[-1].faces].tolist()} == {(1, 2, 3), (1, 3, 4)}


def test_a_file_without_groups_is_one_part_of_its_name(tmp_path: Path) -> None:
    (tmp_path / "pot.obj").write_text(VERTICES + "f 1 2 3\n")
    assert named(load_mesh(tmp_path / "pot.obj")) == [("pot", 0, 1)]
    assert named(load_mesh(tmp_path / "pot.obj", name="other")) == [("other", 0, 1)]


# --- GLB --------------------------------------------------------------------------------------------------------------


def test_nodes_of_glb(tmp_path: Path) -> None:
    """Each node is a part, those of one geometry too."""
    scene = trimesh.Scene()
    wheel = trimesh.creation.icosphere(subdivisions=0)
    scene.add_geometry(trimesh.creation.box(), node_name="body", geom_name="body")
    for k in (1, 2):
        scene.add_geometry(
            wheel, node_name=f"wheel {k}", geom_name="wheel", transform=np.eye(4) + 3 * k * np.eye(4, k=3)
        )
    (tmp_path / "car.glb").write_bytes(scene.export(file_type="glb"))
    mesh = load_mesh(tmp_path / "car.glb")
    assert sorted(part.name for part in mesh.parts) == ["body", "wheel 1", "wheel 2"]
    for part in mesh.parts:
        corners = mesh.triangles[part.faces].reshape(-1, 3)
        at = {"body": 0.0, "wheel 1": 3.0, "wheel 2": 6.0}[part.name]
        assert abs(corners.mean(axis=0)[0] - at) < 1e-6 and len(corners) == (36 if part.name == "body" else 60)


def test_primitives_of_a_node_are_one_part() -> None:
    glb = Glb()
    corners = [glb.add((np.eye(3) + k).tolist(), "f", 5126, "VEC3", 0) for k in range(3)]
    content = glb.file(
        meshes=[
            {"name": "two", "primitives": [{"attributes": {"POSITION": at}} for at in corners[:2]]},
            {"name": "own", "primitives": [{"attributes": {"POSITION": corners[2]}}]},
        ],
        nodes=[{"name": "same", "mesh": 0}, {"mesh": 1}, {"name": "same", "mesh": 1}, {"mesh": 0}],
        scenes=[{"nodes": [0, 1, 2, 3]}],
        scene=0,
    )
    mesh = parse_mesh(content, ".glb")
    assert sorted(named(mesh), key=lambda part: part[1:]) == named(mesh) and len(mesh.faces) == 6
    parts = [(name, end - begin) for name, begin, end in named(mesh)]
    assert sorted(parts) == [("own", 1), ("same", 1), ("same", 2), ("two", 2)]
    first = {"own": {2.0}, "two": {0.0, 1.0}}
    for part in mesh.parts:
        lows = set(mesh.triangles[part.faces].min(axis=(1, 2)).tolist())
        assert part.name == "same" or lows == first[part.name]


# --- STL --------------------------------------------------------------------------------------------------------------

FACET = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex {} 0 0\n  vertex 0 1 0\n endloop\nendfacet\n"


@cases("newline", ["\n", "\r\n", "\r"])
def test_solids_of_stl(newline: str) -> None:
    """Names keep their letters; one that says facet is a name."""
    solids = [("Äußere Wand", "solid"), ("", "Solid"), ("facet", "  SOLID"), ("empty", "solid")]
    text = "".join(
        f"{keyword} {name}\n{FACET.format(k + 1) * (3 - k)}endsolid\n" for k, (name, keyword) in enumerate(solids)
    )
    mesh = parse_mesh(text.replace("\n", newline).encode(), ".stl")
    assert named(mesh) == [("Äußere Wand", 0, 3), ("", 3, 5), ("facet", 5, 6), ("empty", 6, 6)]
    bad = text.replace("vertex 1 0 0", "vertex nan 0 0", 1).encode()
    assert named(parse_mesh(bad, ".stl", Reading(repair=True))) == [
        ("Äußere Wand", 0, 2),
        ("", 2, 4),
        ("facet", 4, 5),
        ("empty", 5, 5),
    ]
    assert named(parse_mesh(f"solid one\n{FACET.format(1)}endsolid one\n".encode(), ".stl")) == [("", 0, 1)]


# --- joined meshes ----------------------------------------------------------------------------------------------------


@pytest.mark.judges("Mesh.concatenate")
def test_joined_meshes_are_parts_however_they_are_given() -> None:
    nothing = Mesh([], [], name="nothing")
    both = [box(), nothing, icosphere(0)]
    expected = [("box", 0, 12), ("nothing", 12, 12), ("icosphere", 12, 32)]
    for mesh in (
        Mesh.concatenate(both),
        Mesh.concatenate(*both),
        Mesh.concatenate(iter(both)),
        Mesh.concatenate(meshes=both),
    ):
        assert named(mesh) == expected and mesh.name == ""
    assert Mesh.concatenate(both, "all").name == Mesh.concatenate(*both, name="all").name == "all"
    assert named(Mesh.concatenate(Mesh.concatenate(both, "in"), box())) == [("in", 0, 32), ("box", 32, 44)]
    many: Any = Mesh.concatenate
    with pytest.raises(ValueError, match=r"^meshes: expected an iterable of Mesh, got list before Mesh$"):
        many(both, box())
    with pytest.raises(ValueError, match=r"^meshes: expected an iterable of Mesh, got int in row 1$"):
        many(box(), 3)


def test_parts_stay_as_long_as_the_faces_do(tmp_path: Path) -> None:
    mesh = Mesh.concatenate(box(), icosphere(0), name="both")
    octree = Octree(mesh)
    octree.save(tmp_path / "both.octree")
    octree.refit(2.0 * mesh.vertices)
    for other in (
        mesh.transformed(np.diag([1.0, -1.0, 1.0, 1.0])),
        copy.deepcopy(mesh),
        pickle.loads(pickle.dumps(mesh)),
        dataclasses.replace(mesh, name="other"),
        octree.mesh,
        Octree.load(tmp_path / "both.octree").mesh,
        Octree.load(tmp_path / "both.octree", mmap=True).mesh,
    ):
        assert named(other) == named(mesh)
    fewer = dataclasses.replace(mesh, faces=mesh.faces[:20])
    assert named(fewer) == [("both", 0, 20)]


@pytest.mark.judges("Hits.part", "AllHits.part", "ClosestPoints.part")
@cases("accelerator", [Octree, BruteForce])
def test_hits_know_their_part(accelerator: Any) -> None:
    rng = np.random.default_rng(7)
    parts = [box((k, 0, 0), (k + 0.5, 1, 1)) for k in range(5)]
    queries = accelerator(Mesh.concatenate([parts[0], Mesh([], []), *parts[1:]]))
    origins = np.stack([rng.uniform(-0.5, 5.5, (3, 200)), np.full((3, 200), 0.3), np.full((3, 200), 9.0)], axis=-1)
    hits, everything = queries.closest_hit(origins, [0, 0, -1]), queries.all_hits(origins, [0, 0, -1])
    at = np.floor(origins[..., 0]).astype(int)
    there = (origins[..., 0] > 0) & (origins[..., 0] - at < 0.5) & (at < 5)
    expected = np.where(there, np.where(at > 0, at + 1, 0), -1)
    np.testing.assert_array_equal(hits.part, expected)
    assert hits.part.dtype == np.int64 and 0 < there.sum() < there.size
    np.testing.assert_array_equal(everything.part, np.repeat(expected[there], 2))
    near = queries.closest_point(origins, max_distance=8.0)
    np.testing.assert_array_equal(near.part[there], expected[there])
    assert (near.part[~near.found] == -1).all() and not near.found.all()
