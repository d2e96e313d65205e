"""GLB files that ask for hours or for all memory are refused at once, by name."""

import json
import struct

import pytest

from renderer import MeshError, load_mesh


def glb(tmp_path, document):
    """A file of one triangle's bytes and the given JSON, completed."""
    data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
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


@pytest.mark.parametrize(
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
