"""glTF: what quantized numbers, instances, joints and targets make of a mesh, and documents without end."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from glb_bytes import Glb

from renderer import MeshError, load_mesh
from renderer.mesh.load import parse_mesh
from renderer.mesh.mesh import RepairWarning

pytestmark = pytest.mark.judges("load_mesh")

TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
SCENE = {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}]}
TURN = {"rotation": [0.0, 0.0, 0.5**0.5, 0.5**0.5]}  # by a quarter about z


def triangle(glb: Glb, **more: Any) -> dict[str, Any]:
    return {"meshes": [{"primitives": [{"attributes": {"POSITION": glb.add(TRIANGLE, "f", 5126, "VEC3", 0)}, **more}]}]}


def corners(glb: Glb, **document: Any) -> Any:
    return parse_mesh(glb.file(**{**SCENE, **document}), ".glb").triangles.round(9).tolist()


@cases(
    ("letter", "kind", "normalized", "one"),
    [("b", 5120, True, 127), ("B", 5121, True, 255), ("h", 5122, True, 32767), ("H", 5123, True, 65535),
     ("b", 5120, False, 1), ("H", 5123, False, 1)],
)  # fmt: skip
def test_quantized_numbers_are_what_their_accessor_says(letter: str, kind: int, normalized: bool, one: int) -> None:
    """They were read as they stand, 32767 for 1, and 1 - v wrapped around."""
    glb = Glb()
    rows = (np.array(TRIANGLE, int) * one).tolist()
    given = {"POSITION": glb.add(rows, letter, kind, "VEC3", 1 if letter in "bB" else 2, normalized=normalized)}
    given["TEXCOORD_0"] = glb.add([[0, one], [one, 0], [0, 0]], letter, kind, "VEC2", 2, normalized=normalized)
    mesh = parse_mesh(glb.file(**SCENE, meshes=[{"primitives": [{"attributes": given}]}],
                               extensionsRequired=["KHR_mesh_quantization"]), ".glb")  # fmt: skip
    assert mesh.triangles.tolist() == [TRIANGLE]
    assert mesh.texcoords is not None and mesh.texcoords.tolist() == [[0, 0], [1, 1], [0, 1]]


def test_the_least_of_a_signed_byte_is_no_less_than_minus_one() -> None:
    glb = Glb()
    rows = [[-128, 0, 0], [-127, 0, 0], [0, 127, 0]]
    position = glb.add(rows, "b", 5120, "VEC3", 1, normalized=True)
    found = corners(glb, meshes=[{"primitives": [{"attributes": {"POSITION": position}}]}])
    assert found == [[[-1, 0, 0], [-1, 0, 0], [0, 1, 0]]]


@pytest.mark.parametrize("key", ["extensionsUsed", "extensionsRequired"])
def test_each_instance_is_placed(key: str) -> None:
    """Where the extension was used and not required, two of three were lost in silence."""
    glb = Glb()
    document = triangle(glb)
    attributes = {
        "TRANSLATION": glb.add([[0.0, 0, 0], [2, 0, 0], [4, 0, 0]], "f", 5126, "VEC3", 0),
        "ROTATION": glb.add([[0.0, 0, 0, 1], [0, 0, 0, 1], TURN["rotation"]], "f", 5126, "VEC4", 0),
        "SCALE": glb.add([[1.0, 1, 1], [3, 1, 1], [1, 1, 1]], "f", 5126, "VEC3", 0),
    }
    node = {"mesh": 0, "name": "tree", "translation": [0, 0, 5], "scale": [2, 1, 1],
            "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}  # fmt: skip
    mesh = parse_mesh(glb.file(**{**SCENE, **document, "nodes": [node], key: ["EXT_mesh_gpu_instancing"]}), ".glb")
    assert mesh.triangles.round(6).tolist() == [
        [[0, 0, 5], [2, 0, 5], [0, 1, 5]], [[4, 0, 5], [10, 0, 5], [4, 1, 5]], [[8, 0, 5], [8, 1, 5], [6, 0, 5]],
    ]  # fmt: skip
    assert [(part.name, part.faces) for part in mesh.parts] == [("tree", slice(0, 3))]


def test_joints_pull_vertices_by_their_weights_and_the_meshs_own_node_does_not() -> None:
    glb = Glb()
    document = triangle(glb)
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    attributes["NORMAL"] = glb.add([[0.0, 1, 0]] * 3, "f", 5126, "VEC3", 0)
    attributes["JOINTS_0"] = glb.add([[0, 1, 0, 0]] * 3, "B", 5121, "VEC4", 0)
    attributes["WEIGHTS_0"] = glb.add([[1.0, 0, 0, 0], [0, 1, 0, 0], [0.5, 0.5, 0, 0]], "f", 5126, "VEC4", 0)
    bound = np.eye(4)
    bound[0, 3] = -1.0  # the second joint is bound at x = 1
    matrices = glb.add([np.eye(4).T.tolist(), bound.T.tolist()], "f", 5126, "MAT4", 0)
    nodes = [{"mesh": 0, "skin": 0, "translation": [9, 9, 9]}, {}, {"translation": [1, 0, 2], **TURN}]
    skins = [{"joints": [1, 2], "inverseBindMatrices": matrices}]
    mesh = parse_mesh(glb.file(**{**SCENE, **document, "nodes": nodes, "skins": skins}), ".glb")
    # The first stays; the second is at its joint; the third is half way from (0, 1, 0) to (1, 0, 2) + turn (-1, 1, 0).
    assert mesh.triangles.round(6).tolist() == [[[0, 0, 0], [1, 0, 2], [0, 0, 1]]]
    assert mesh.normals is not None
    assert mesh.normals.round(6).tolist()[:2] == [[0, 1, 0], [-1, 0, 0]]


def test_a_skin_without_joints_in_the_mesh_moves_nothing() -> None:
    glb = Glb()
    nodes = [{"mesh": 0, "skin": 0, "translation": [1, 0, 0]}]
    found = corners(glb, **triangle(glb), nodes=nodes, skins=[{"joints": [0]}])
    assert found == [[[1, 0, 0], [2, 0, 0], [1, 1, 0]]]


@cases(
    ("of_mesh", "of_node", "height"),
    [([0.0, 0.0], None, 0), ([0.5, 0.0], None, 1), ([0.5, 0.0], [0.0, 1.0], -4), (None, [1.0, 1.0], -2)],
)
def test_targets_move_vertices_by_the_nodes_weights_or_the_meshs(of_mesh: Any, of_node: Any, height: float) -> None:
    glb = Glb()
    up, down = (glb.add([[0.0, 0, z]] * 3, "f", 5126, "VEC3", 0) for z in (2, -4))
    document = triangle(glb, targets=[{"POSITION": up}, {"POSITION": down}])
    document["meshes"][0] |= {} if of_mesh is None else {"weights": of_mesh}
    nodes = [{"mesh": 0} | ({} if of_node is None else {"weights": of_node})]
    assert corners(glb, **document, nodes=nodes) == [[[x, y, height] for x, y, _ in TRIANGLE]]


def test_sparse_accessors_replace_their_rows() -> None:
    glb = Glb()
    document = triangle(glb)
    rows, values = glb.add([2], "H", 5123, "SCALAR", 0), glb.add([[7.0, 8, 9]], "f", 5126, "VEC3", 0)
    view = [glb.accessors[k]["bufferView"] for k in (rows, values)]
    sparse = {"count": 1, "indices": {"bufferView": view[0], "componentType": 5123}, "values": {"bufferView": view[1]}}
    glb.accessors[0]["sparse"] = sparse
    assert corners(glb, **document) == [[*TRIANGLE[:2], [7, 8, 9]]]
    del glb.accessors[0]["bufferView"]  # then the others are 0
    assert corners(glb, **document) == [[[0, 0, 0], [0, 0, 0], [7, 8, 9]]]


@cases(("mode", "faces"), [(4, [[0, 1, 2]]), (5, [[0, 1, 2], [2, 1, 3]]), (6, [[0, 1, 2], [0, 2, 3]])])
def test_triangles_strips_and_fans(mode: int, faces: Any) -> None:
    glb = Glb()
    square = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    primitive = {"attributes": {"POSITION": glb.add(square, "f", 5126, "VEC3", 0)}, "mode": mode}
    mesh = parse_mesh(glb.file(**SCENE, meshes=[{"primitives": [primitive]}]), ".glb")
    assert mesh.faces.tolist() == faces


@pytest.mark.parametrize("where", ["data", "file", "file with a blank"])
def test_text_has_its_bytes_in_itself_or_beside_it(where: str, tmp_path: Path) -> None:
    glb = Glb()
    document = {**SCENE, **triangle(glb), "accessors": glb.accessors, "bufferViews": glb.views}
    names = {"data": "data:application/octet-stream;base64," + base64.b64encode(glb.data).decode(), "file": "a.bin"}
    uri = names.get(where, "a%20b.bin")
    if where != "data":
        (tmp_path / uri.replace("%20", " ")).write_bytes(glb.data)
    (tmp_path / "a.gltf").write_text(json.dumps({**document, "buffers": [{"byteLength": len(glb.data), "uri": uri}]}))
    assert load_mesh(tmp_path / "a.gltf").triangles.tolist() == [TRIANGLE]
    if where == "data":
        assert load_mesh((tmp_path / "a.gltf").read_bytes()).triangles.tolist() == [TRIANGLE]


def test_what_has_no_place_in_a_mesh_is_named_once(tmp_path: Path) -> None:
    glb = Glb()
    line = {"attributes": {"POSITION": glb.add(TRIANGLE, "f", 5126, "VEC3", 0)}, "mode": 1}
    document = triangle(glb)
    document["meshes"][0]["primitives"] += [line, line]
    (tmp_path / "a.glb").write_bytes(glb.file(**SCENE, **document, materials=[{}, {}], cameras=[{}]))
    with pytest.warns(RepairWarning) as said:
        load_mesh(tmp_path / "a.glb")
    left_out = "left out, as they have no surface: points and lines; left out: cameras"
    assert [str(one.message) for one in said] == [f"{tmp_path / 'a.glb'}: {left_out}"]


def chain(length: int) -> dict[str, Any]:
    return {"nodes": [*({"children": [i + 1]} for i in range(length)), {"mesh": 0}]}


def test_nodes_may_be_deep_and_many_and_keep_their_order() -> None:
    glb = Glb()
    assert corners(glb, **triangle(glb), **chain(20_000)) == [TRIANGLE]
    moved = [{"mesh": 0, "translation": [k, 0, 0]} for k in range(2000)]
    found = corners(glb, **triangle(glb), nodes=[{"children": list(range(1, 2001))}, *moved])
    assert [face[0][0] for face in found] == list(range(2000))


ZEROS = {"componentType": 5126, "count": 3 * 10**9, "type": "VEC3"}


@cases(
    ("document", "message"),
    [
        ({"nodes": [{"children": [1]}, {"children": [0], "mesh": 0}]}, "expected nodes without circles"),
        ({"nodes": [{"children": [0], "mesh": 0}]}, "expected nodes without circles"),
        ({"nodes": [{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"mesh": 0}]}, "at most one other"),
        ({"nodes": [{"children": [7], "mesh": 0}]}, "node 0: expected children of 1 nodes, got 7"),
        ({"accessors": [ZEROS]}, "accessor 0: its 3000000000 rows are more than the buffers hold"),
        ({"accessors": [ZEROS | {"count": 3}]}, "expected accessors with data, got none in accessor 0"),
        ({"accessors": [ZEROS | {"count": 4, "bufferView": 0}]}, "accessor 0: its 4 rows end beyond their bytes"),
        ({"asset": {"version": "1.0"}, "meshes": {}}, "expected version 2.0, got version 1.0"),
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "needs the extension KHR_draco_mesh_compression"),
        ({"buffers": [{"byteLength": 36, "uri": "a.bin"}]}, r"buffer 0, 'a\.bin': cannot be read: No such file"),
        ({"buffers": [{"byteLength": 36, "uri": "http://x/a.bin"}]}, "expected the bytes of buffer 0, got 'http"),
        ({"meshes": [{"primitives": [{"attributes": {"NORMAL": 0}}]}]}, "malformed glTF: KeyError: 'POSITION'"),
        ({"meshes": [3]}, "malformed glTF: AttributeError"),
        ({"nodes": [{"mesh": 9}]}, "malformed glTF: IndexError"),
    ],
)
def test_what_cannot_be_read_is_refused_by_name(document: dict[str, Any], message: str, tmp_path: Path) -> None:
    glb = Glb()
    (tmp_path / "a.glb").write_bytes(glb.file(**{**SCENE, **triangle(glb), **document}))
    with pytest.raises(MeshError, match=message):
        load_mesh(tmp_path / "a.glb")


def test_extensions_that_move_no_vertex_may_be_required() -> None:
    glb = Glb()
    assert corners(glb, **triangle(glb), extensionsRequired=["KHR_materials_unlit"]) == [TRIANGLE]


def test_chunks_of_other_kinds_are_passed_over() -> None:
    glb = Glb()
    content = glb.file(**SCENE, **triangle(glb))
    more = content + struct.pack("<I4s", 4, b"MORE") + b"abcd"
    content = content[:8] + struct.pack("<I", len(more)) + more[12:]
    assert parse_mesh(content, ".glb").triangles.tolist() == [TRIANGLE]
