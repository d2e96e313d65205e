"""GLB files that ask for hours or for all memory are refused at once, by name."""

import json
import struct

import pytest
from cases import cases

from renderer import MeshError, load_mesh


def glb(tmp_path, document, copies=1):
    """A file of the bytes of some triangles, one above the other, and the given JSON, completed."""
    data = b"".join(struct.pack("<9f", 0, 0, z, 1, 0, z, 0, 1, z) for z in range(copies))
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
    whole = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "accessors": [accessor],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}], "buffers": [{"byteLength": len(data)}], **document,
    }  # fmt: skip
    text = json.dumps(whole).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    path = tmp_path / "m.glb"
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def chain(length):
    return {"nodes": [*({"children": [i + 1]} for i in range(length)), {"mesh": 0}]}


def test_a_plain_file_and_a_chain_of_some_nodes_load(tmp_path):
    assert len(load_mesh(glb(tmp_path, {})).faces) == 1
    assert len(load_mesh(glb(tmp_path, chain(255))).faces) == 1
    assert len(load_mesh(glb(tmp_path, {"nodes": [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0}]})).faces) == 2


def test_of_thousands_of_primitives_none_is_lost_and_they_keep_their_order(tmp_path):
    """trimesh names their nodes at random: of 3,000 it lost one now and then, of 20,000 ten each time."""
    count = 20_000
    view = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    primitives = [{"attributes": {"POSITION": i % 2}} for i in range(count)]
    data = {"accessors": [view, {**view, "byteOffset": 36}], "meshes": [{"primitives": primitives}]}
    mesh = load_mesh(glb(tmp_path, {**data, "nodes": [{"mesh": 0, "scale": [2, 2, 2]}]}, copies=2))
    assert len(mesh.faces) == count
    assert mesh.triangles[:, 0, 2].tolist() == [0.0, 2.0] * (count // 2)


@cases(
    ("document", "message"),
    [
        (chain(256), "nodes at most 256 deep"),
        (chain(100_000), "nodes at most 256 deep"),
        ({"nodes": [{"children": [1]}, {"children": [0], "mesh": 0}]}, "without circles"),
        ({"nodes": [{"children": [0], "mesh": 0}]}, "without circles"),
        ({"accessors": [{"componentType": 5126, "count": 3 * 10**9, "type": "VEC3"}]}, "accessors with data"),
    ],
)
def test_what_has_no_end_is_refused(tmp_path, document, message):
    with pytest.raises(MeshError, match=f"GLB: expected (nodes .*)?{message}"):
        load_mesh(glb(tmp_path, document))


@cases("kind", [5120, 5121, 5122, 5123])
@cases("required", [[], ["KHR_mesh_quantization"]])
def test_quantized_positions_are_refused(tmp_path, kind, required):
    """They were read as they stand: 32767 for 1.0."""
    accessor = {"bufferView": 0, "componentType": kind, "normalized": True, "count": 3, "type": "VEC3"}
    message = "KHR_mesh_quantization" if required else f"component type {kind}"
    with pytest.raises(MeshError, match=message):
        load_mesh(glb(tmp_path, {"accessors": [accessor], "extensionsRequired": required}))


def test_quantized_texture_coordinates_are_refused(tmp_path):
    """They were read as they stand, and 1 - v wrapped around."""
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 0, "componentType": 5123, "normalized": True, "count": 3, "type": "VEC2"},
    ]
    meshes = [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}]
    with pytest.raises(MeshError, match="expected float32 TEXCOORD_0, got component type 5123 in mesh 0"):
        load_mesh(glb(tmp_path, {"accessors": accessors, "meshes": meshes}))


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"nodes": [{"mesh": 0, "skin": 0}]}, "skin in node 0"),
        ({"nodes": [{"mesh": 0, "weights": [0.5]}]}, "weights in node 0"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}], "weights": [0.0, 1.0]}]}, "weights in mesh 0"),
    ],
)
def test_what_moves_vertices_is_refused(tmp_path, document, message):
    """They were left out: the mesh stood at another place, in another size."""
    with pytest.raises(MeshError, match=f"GLB: expected a mesh that stands still, got .*{message}"):
        load_mesh(glb(tmp_path, document))


def test_weights_that_move_nothing_are_taken(tmp_path):
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}}], "weights": [0.0, 0.0]}]
    assert len(load_mesh(glb(tmp_path, {"meshes": meshes})).faces) == 1


@pytest.mark.parametrize("extension", ["EXT_mesh_gpu_instancing", "KHR_meshopt_compression", "FOO_bar"])
def test_required_extensions_that_may_change_triangles_are_refused(tmp_path, extension):
    with pytest.raises(MeshError, match=f"got the extension {extension}"):
        load_mesh(glb(tmp_path, {"extensionsRequired": [extension]}))


def test_required_extensions_of_materials_change_no_triangle(tmp_path):
    assert len(load_mesh(glb(tmp_path, {"extensionsRequired": ["KHR_materials_unlit"]})).faces) == 1


def test_bytes_in_another_file_are_refused_by_name(tmp_path):
    """It was malformed: TypeError: 'NoneType' object is not subscriptable."""
    with pytest.raises(MeshError, match="GLB: expected its own bytes, got another file for buffer 0"):
        load_mesh(glb(tmp_path, {"buffers": [{"byteLength": 36, "uri": "a.bin"}]}))


def test_a_node_below_two_others_is_refused(tmp_path):
    """It was placed once."""
    nodes = [{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"mesh": 0}]
    with pytest.raises(MeshError, match="each node below at most one other"):
        load_mesh(glb(tmp_path, {"nodes": nodes}))


@cases(
    ("document", "message"),
    [
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}]}, "got a TRIANGLE_FAN in mesh 0"),
        ({"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {"count": 1}}]},
         "expected plain accessors, got a sparse one, accessor 0"),
    ],
)  # fmt: skip
def test_what_would_be_read_wrongly_is_refused_by_name(tmp_path, document, message):
    with pytest.raises(MeshError, match=f"GLB: .*{message}"):
        load_mesh(glb(tmp_path, document))
