"""Mesh files as scenes: the triangles of ``load_mesh``, each mesh once, and the names of files, nodes and meshes."""

import gzip
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from glb_bytes import Glb
from numpy.typing import NDArray

from renderer import Mesh, MeshError, Octree, RayScene, load_mesh
from renderer.mesh.mesh import RepairWarning
from renderer.mesh.shapes import box, icosphere

pytestmark = pytest.mark.judges("RayScene.from_files", "RayScene.instance_names")

TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]


def primitive(glb: Glb, mesh: Mesh, **attributes: int) -> dict[str, Any]:
    position = glb.add(mesh.vertices.tolist(), "f", 5126, "VEC3", 0)
    return {
        "attributes": {"POSITION": position, **attributes},
        "indices": glb.add(mesh.faces.ravel().tolist(), "H", 5123, "SCALAR", 0),
    }


def sorted_triangles(mesh: Mesh) -> bytes:
    """The bits of the triangles in an order of their own; a zero has no sign."""
    rows = mesh.triangles.reshape(-1, 9) + 0.0
    return rows[np.lexsort(rows.T)].tobytes()


def placed_at(rng: np.random.Generator) -> dict[str, Any]:
    """A turn, a scale that may mirror, and a move; or a matrix."""
    if rng.random() < 0.3:
        matrix = np.eye(4)
        matrix[:3] = rng.normal(size=(3, 4))
        return {"matrix": matrix.T.ravel().tolist()}
    turn = rng.normal(size=4)
    return {
        "translation": rng.uniform(-5, 5, 3).tolist(),
        "rotation": (turn / np.linalg.norm(turn)).tolist(),
        "scale": (rng.uniform(0.2, 2, 3) * rng.choice([-1, 1], 3)).tolist(),
    }


def forest(seed: int) -> bytes:
    """A file of two meshes, one of two primitives, whose nodes stand below each other, some with instances."""
    rng, glb = np.random.default_rng(seed), Glb()
    meshes = [{"primitives": [primitive(glb, box()), primitive(glb, icosphere(1))]},
              {"primitives": [primitive(glb, icosphere(2))], "name": "ball"}]  # fmt: skip
    nodes = [{"name": f"n{k}", **placed_at(rng)} for k in range(12)]
    for k, node in enumerate(nodes):
        if k:
            nodes[int(rng.integers(k))].setdefault("children", []).append(k)
        if k == 0 or rng.random() < 0.7:
            node["mesh"] = int(rng.integers(2))
    for node in rng.choice(nodes, 3):  # type: ignore[arg-type]
        rows = {"TRANSLATION": glb.add(rng.normal(size=(4, 3)).tolist(), "f", 5126, "VEC3", 0)}
        node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": rows}}
    return glb.file(scenes=[{"nodes": [0]}], nodes=nodes, meshes=meshes)


@pytest.mark.parametrize("seed", range(8))
def test_a_scene_has_the_triangles_of_load_mesh_and_each_mesh_once(seed: int, tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(forest(seed))
    scene, mesh = RayScene.from_files(tmp_path / "a.glb", threads=1), load_mesh(tmp_path / "a.glb")
    assert sorted_triangles(scene.merged) == sorted_triangles(mesh)
    assert len(scene.objects) <= 2 and scene.threads == 1
    names = [name for k in scene.objects for name in scene.instance_names(k)]
    # A part of the mesh is a node, of which each instance has its name.
    assert sorted(set(names)) == sorted({part.name for part in mesh.parts})
    rng = np.random.default_rng(seed)
    rays = rng.uniform(-9, 9, (200, 3)), rng.normal(size=(200, 3))
    assert scene.closest_hit(*rays).t.tobytes() == Octree(mesh).closest_hit(*rays).t.tobytes()


def shapes(glb: Glb, **mesh: Any) -> list[dict[str, Any]]:
    """A mesh of a triangle."""
    return [{"primitives": [{"attributes": {"POSITION": glb.add(TRIANGLE, "f", 5126, "VEC3", 0)}}], **mesh}]


def objects(path: Path, content: bytes) -> list[tuple[str, tuple[str, ...], int]]:
    """Name, names of instances, and faces of each object of a file, which has the triangles of ``load_mesh``."""
    path.write_bytes(content)
    scene = RayScene.from_files(path)
    assert sorted_triangles(scene.merged) == sorted_triangles(load_mesh(path))
    return [(scene.name(k), scene.instance_names(k), len(scene.mesh(k).faces)) for k in scene.objects]


@cases(
    ("of_mesh", "nodes", "expected"),
    [
        ("m", [{"name": "n"}], [("n", ("n",), 1)]),
        ("m", [{}], [("m", ("m",), 1)]),
        ("m", [{"name": "n"}, {}], [("m", ("n", "m"), 1)]),
        ("", [{"name": "n"}, {"name": "o"}], [("n", ("n", "o"), 1)]),
        ("", [{}], [("a", ("",), 1)]),
    ],
)
def test_an_object_has_the_name_of_its_only_node_or_of_its_mesh(
    of_mesh: str, nodes: list[Any], expected: Any, tmp_path: Path
) -> None:
    glb = Glb()
    document = {"meshes": shapes(glb, name=of_mesh), "nodes": [{"mesh": 0, **node} for node in nodes]}
    assert objects(tmp_path / "a.glb", glb.file(**document)) == expected


def test_a_matrix_that_flattens_stands_as_a_mesh(tmp_path: Path) -> None:
    """A scene's instances can be inverted; shadows and decals of files are often flat."""
    glb = Glb()
    nodes: list[Any] = [{"mesh": 0, "name": "flat", "scale": [1, 1, 0], "rotation": [0.5, 0.5, 0.5, 0.5]},
                        {"mesh": 0, "name": "whole", "translation": [0, 0, 3]},
                        {"mesh": 0, "name": "point", "scale": [0, 0, 0]}]  # fmt: skip
    content = glb.file(meshes=[{"primitives": [primitive(glb, box())], "name": "box"}], nodes=nodes)
    expected = [("box", ("whole",), 12), ("box", ("flat",), 12), ("box", ("point",), 12)]
    assert objects(tmp_path / "a.glb", content) == expected


def test_meshes_that_joints_pull_stand_one_a_node(tmp_path: Path) -> None:
    glb = Glb()
    meshes = shapes(glb, name="m")
    attributes = meshes[0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = glb.add([[0, 1, 0, 0]] * 3, "B", 5121, "VEC4", 0)
    attributes["WEIGHTS_0"] = glb.add([[0.5, 0.5, 0, 0]] * 3, "f", 5126, "VEC4", 0)
    meshes[0]["primitives"] += shapes(glb)[0]["primitives"]  # which joints do not pull
    nodes = [{"mesh": 0, "skin": 0, "name": "a"}, {"mesh": 0, "skin": 0}, {"mesh": 0}, {}, {"translation": [1, 0, 2]}]
    skins = [{"joints": [3, 4]}]
    found = objects(tmp_path / "a.glb", glb.file(meshes=meshes, nodes=nodes, skins=skins))
    assert found == [("a", ("a",), 2), ("m", ("m",), 2), ("m", ("m",), 2)]


def test_nodes_with_other_weights_of_targets_show_other_meshes(tmp_path: Path) -> None:
    glb = Glb()
    meshes = shapes(glb, weights=[0.0])
    meshes[0]["primitives"][0]["targets"] = [{"POSITION": glb.add([[0.0, 0, 1]] * 3, "f", 5126, "VEC3", 0)}]
    nodes = [{"mesh": 0, "name": "a"}, {"mesh": 0, "weights": [1.0], "name": "b"}, {"mesh": 0, "weights": [0.0]}]
    found = objects(tmp_path / "a.glb", glb.file(meshes=meshes, nodes=nodes))
    assert found == [("a", ("a", ""), 1), ("b", ("b",), 1)]


def test_a_mesh_keeps_colours_that_others_have_not(tmp_path: Path) -> None:
    glb = Glb()
    meshes = shapes(glb) + shapes(glb)
    meshes[0]["primitives"][0]["attributes"]["COLOR_0"] = glb.add([[1.0, 0, 0]] * 3, "f", 5126, "VEC3", 0)
    (tmp_path / "a.glb").write_bytes(glb.file(meshes=meshes, nodes=[{"mesh": 0}, {"mesh": 1}]))
    scene = RayScene.from_files(tmp_path / "a.glb")
    assert [scene.mesh(k).colors is not None for k in scene.objects] == [True, False]
    assert load_mesh(tmp_path / "a.glb").colors.tolist() == [[1, 0, 0]] * 3 + [[1, 1, 1]] * 3


@pytest.mark.filterwarnings("ignore:.*points and lines")
def test_nodes_that_show_no_triangle_are_no_objects(tmp_path: Path) -> None:
    glb = Glb()
    meshes = shapes(glb) + shapes(glb)
    meshes[1]["primitives"][0]["mode"] = 1
    rows = {"TRANSLATION": glb.add(TRIANGLE, "f", 5126, "VEC3", 0)}
    glb.accessors[-1]["count"] = 0
    nowhere = {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": rows}}}
    found = objects(tmp_path / "a.glb", glb.file(meshes=meshes, nodes=[nowhere, {"mesh": 1}, {"mesh": 0, "name": "n"}]))
    assert found == [("n", ("n",), 1)]


def test_what_is_left_out_is_named_with_the_file(tmp_path: Path) -> None:
    glb = Glb()
    meshes = shapes(glb)
    meshes[0]["primitives"].append({**meshes[0]["primitives"][0], "mode": 1})
    (tmp_path / "a.glb").write_bytes(glb.file(meshes=meshes, nodes=[{"mesh": 0}], cameras=[{}]))
    with pytest.warns(RepairWarning) as said:
        RayScene.from_files(tmp_path / "a.glb")
    left_out = "left out, as they have no surface: points and lines; left out: cameras"
    assert [str(one.message) for one in said] == [f"{tmp_path / 'a.glb'}: {left_out}"]


# --- several files ----------------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with two mesh files, and what is none."""
    folder = tmp_path / "folder"
    (folder / "below.ply").mkdir(parents=True)
    box().save(folder / "b.ply")
    icosphere(1).save(folder / "below.ply" / "c.ply")
    (folder / ".hidden.ply").write_bytes(b"")
    (folder / "readme.txt").write_text("no mesh")
    glb = Glb()
    nodes = [{"mesh": 0}, {"mesh": 0, "translation": [2, 0, 0]}]
    (folder / "a.GLB.gz").write_bytes(gzip.compress(glb.file(meshes=shapes(glb), nodes=nodes)))
    more = Glb()
    two = [{"mesh": 0, "name": "one"}, {"mesh": 1, "name": "other"}]
    (folder / "c.glb").write_bytes(more.file(meshes=shapes(more) + shapes(more), nodes=two))
    return folder


def summary(scene: RayScene) -> list[tuple[str, int, NDArray[np.float64]]]:
    return [(scene.name(k), len(scene.mesh(k).faces), scene.transforms(k).tolist()) for k in scene.objects]


def test_a_folder_is_one_scene_of_the_meshes_of_its_files(folder: Path) -> None:
    scene = RayScene.from_files(folder)
    still = np.eye(4)[None, :3].tolist()
    moved = [[*still[0]], [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0]]]
    assert summary(scene) == [("a", 1, moved), ("b", 12, still), ("c/one", 1, still), ("c/other", 1, still)]
    assert summary(RayScene.from_files(str(folder / "b.ply"))) == [("b", 12, still)]
    several = RayScene.from_files([folder / "b.ply", folder, str(folder / "below.ply" / "c.ply")])
    assert [scene.name(k) for scene in [several] for k in scene.objects] == [
        "b", "a", "b", "c/one", "c/other", "c",
    ]  # fmt: skip
    expected = Mesh.concatenate([load_mesh(folder / "a.GLB.gz"), box(), load_mesh(folder / "c.glb")])
    assert scene.merged.triangles.tobytes() == expected.triangles.tobytes()


@cases(
    ("given", "message"),
    [
        ("absent.ply", r"absent\.ply: cannot be read: No such file"),
        (["b.ply", "absent.ply"], r"absent\.ply: cannot be read: No such file"),
        ("empty", r"empty: expected mesh files \(\.ply, \.obj, \.stl, \.glb, \.gltf\) in the folder, got none"),
        ("other.txt", r"other\.txt: expected a suffix of \.ply"),
        ("bad.ply", r"bad\.ply: "),
        (["b.ply", "bad.ply"], r"bad\.ply: "),
        ("nan.glb", r"nan\.glb: transforms: expected finite matrices, "),
        (
            "huge.glb",
            r"huge\.glb: transforms: expected matrices .* coordinates up to 1\.15e\+18 and factors ",
        ),
        ("lines.glb", r"lines\.glb: holds no good faces: left out, as they have no surface: points and lines"),
        ("none.glb", r"none\.glb: holds no faces"),
        ([], r"path: expected a string or path, got none of several"),
        (3, r"path: expected a string or path, got int"),
        ([3], r"path: expected a string or path, got int"),
        (b"a.ply", r"path: expected a string or path, got bytes"),
    ],
)
def test_files_that_make_no_scene_are_named(given: Any, message: str, tmp_path: Path) -> None:
    glb = Glb()
    meshes = shapes(glb)
    lines = [{"primitives": [{**meshes[0]["primitives"][0], "mode": 1}]}]
    for name, nodes in (("nan", [{"mesh": 0, "translation": [np.nan, 0, 0]}]), ("none", []),
                        ("huge", [{"mesh": 0, "translation": [1e20, 0, 0]}])):  # fmt: skip
        (tmp_path / f"{name}.glb").write_bytes(glb.file(meshes=meshes, nodes=nodes))
    (tmp_path / "lines.glb").write_bytes(glb.file(meshes=lines, nodes=[{"mesh": 0}]))
    box().save(tmp_path / "b.ply")
    (tmp_path / "empty").mkdir()
    for name in ("bad.ply", "other.txt"):
        (tmp_path / name).write_text("no mesh")
    if isinstance(given, str):
        given = tmp_path / given
    elif isinstance(given, list):
        given = [tmp_path / name if isinstance(name, str) else name for name in given]
    with pytest.raises(MeshError, match=message), warnings.catch_warnings():
        RayScene.from_files(given)
