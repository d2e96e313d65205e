"""Reading GLB, the binary form of glTF 2.0, by trimesh; what trimesh drops or reads wrongly in silence is refused."""

from __future__ import annotations

import json
import struct
from io import BytesIO
from typing import Any

import numpy as np

from renderer.errors import MeshError
from renderer.mesh.foreign import attributes_of
from renderer.mesh.mesh import Mesh, Repairs, build_mesh, give_parts
from renderer.mesh.parts import Part, parts_of

# glTF 2.0, section 5.24.4, and the extensions that pack vertices.
_TRIANGLES, _TRIANGLE_FAN = 4, 6
# trimesh's time grows with the cube of the depth: a second at this one.
_MAX_NODE_DEPTH = 256
# What a file may require without a change of its triangles: the beginnings of names of extensions.
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "KHR_animation_", "KHR_xmp")
_FLOAT32 = 5126


def parse_glb(content: bytes, repairs: list[Repairs] | None = None) -> Mesh:
    """All triangle meshes in a file's content, each placed by the scene's transforms; points and lines have no surface.

    ``repairs`` as for ``build_mesh``. Raises ``MeshError``, which does not know the file's name.
    """
    import trimesh  # half a second, which scenes of PLY files need not spend

    document = _checked_document(content)
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # a signalling NaN, which Mesh rejects or repairs
            names = _node_names(document)
            plain, owners = _one_primitive_a_node(content, document)
            scene = trimesh.load_scene(BytesIO(plain), file_type="glb", process=False)
        meshes, nodes = [], []
        for node in scene.graph.nodes_geometry:
            transform, geometry_name = scene.graph[node]
            geometry = scene.geometry[geometry_name]
            if isinstance(geometry, trimesh.Trimesh):
                mesh = build_mesh(repairs, geometry.vertices, geometry.faces, **attributes_of(geometry))
                meshes.append(mesh.transformed(transform))
                nodes.append(owners[int(node)])
        return give_parts(Mesh.concatenate(meshes), _parts(meshes, nodes, names))
    except MeshError:
        raise
    except Exception as error:  # a library on malformed input raises anything: KeyError, struct.error, ...
        fault = " ".join(str(error).split())[:120]
        raise MeshError(f"malformed GLB: {type(error).__name__}: {fault}") from error


def _checked_document(content: bytes) -> Any:
    """The JSON chunk, after the 12-byte header (glTF 2.0, section 4.4): trimesh checks neither length nor encoding."""
    if content[:4] != b"glTF":
        raise MeshError(f"expected a first word 'glTF', got {content[:4]!r}")
    length, json_length = (int.from_bytes(content[at : at + 4], "little") for at in (8, 12))
    if len(content) < max(length, 20 + json_length):
        raise MeshError(f"truncated: expected {max(length, 20 + json_length)} bytes, got {len(content)}")
    try:
        document = json.loads(content[20 : 20 + json_length].decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise MeshError(f"malformed GLB: its JSON chunk: {str(error)[:120]}") from error
    _refuse_unread(document)
    return document


def _node_names(document: Any) -> list[str]:
    """The name of each node, or of its mesh where it has none."""
    meshes, names = document.get("meshes") or [], []
    for node in document.get("nodes") or []:
        mesh = meshes[node["mesh"]] if "mesh" in node else {}
        names.append(str(node.get("name") or mesh.get("name") or ""))
    return names


def _parts(meshes: list[Mesh], nodes: list[int], names: list[str]) -> tuple[Part, ...]:
    """A part for each node, whose meshes follow each other."""
    ends = np.cumsum([len(mesh.faces) for mesh in meshes]).tolist()
    last = [k for k, node in enumerate(nodes) if nodes[k + 1 : k + 2] != [node]]
    ends = [0, *(ends[k] for k in last)]
    return parts_of([names[nodes[k]] for k in last], np.diff(ends).tolist())


def _one_primitive_a_node(content: bytes, document: Any) -> tuple[bytes, list[int]]:
    """The file with a node of its own for each primitive of a mesh that has several, and the node that each is of.

    trimesh names the nodes of several primitives at random, so that of thousands some have the same name, and one of
    these is lost. Each node gets its number for a name.
    """
    meshes, nodes = document.get("meshes"), document.get("nodes") or []
    several = {i: mesh["primitives"] for i, mesh in enumerate(meshes or []) if len(mesh["primitives"]) > 1}
    owners = list(range(len(nodes)))
    first: dict[int, int] = {}
    for i, primitives in several.items():
        first[i] = len(meshes)
        meshes += [{"primitives": [primitive]} for primitive in primitives]
    for number, node in enumerate(list(nodes)):
        if node.get("mesh") in several:
            i = node.pop("mesh")
            count = len(several[i])
            # The last comes first.
            node["children"] = [*node.get("children", []), *reversed(range(len(nodes), len(nodes) + count))]
            nodes += [{"mesh": first[i] + k} for k in range(count)]
            owners += [number] * count
    for i in several:
        meshes[i]["primitives"] = meshes[i]["primitives"][:1]
    for number, node in enumerate(nodes):
        node["name"] = str(number)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + int.from_bytes(content[12:16], "little") :]
    length = 20 + len(text) + len(rest)
    return b"".join((content[:8], struct.pack("<II", length, len(text)), content[16:20], text, rest)), owners


def _refuse_unread(document: Any) -> None:
    """Raise ``MeshError`` for contents that trimesh drops or reads wrongly in silence. It refuses malformed entries."""
    required = document.get("extensionsRequired") if isinstance(document, dict) else None
    for extension in required if isinstance(required, list) else []:
        if not str(extension).startswith(_HARMLESS):
            raise MeshError(f"GLB: expected plain buffers, got the extension {extension}: save it without compression")
    accessors = _dicts(document, "accessors")
    for number, mesh in enumerate(_dicts(document, "meshes")):
        _refuse_mesh(mesh, accessors, number)
    for number, accessor in enumerate(accessors):
        if "sparse" in accessor:
            raise MeshError(f"GLB: expected plain accessors, got a sparse one, accessor {number}")
        if "bufferView" not in accessor:  # all zeros, as many as it says
            raise MeshError(f"GLB: expected accessors with data, got none in accessor {number}")
    for number, buffer in enumerate(_dicts(document, "buffers")):
        if not str(buffer.get("uri", "data:")).startswith("data:"):
            raise MeshError(f"GLB: expected its own bytes, got another file for buffer {number}: put it in")
    nodes = _dicts(document, "nodes")
    for number, node in enumerate(nodes):
        for key in ("skin", "weights"):  # they move the vertices of the node's mesh
            if "mesh" in node and node.get(key) not in (None, []):
                raise MeshError(f"GLB: expected a mesh that stands still, got {key} in node {number}: apply them")
    _refuse_deep(nodes)


def _dicts(owner: Any, key: str) -> list[dict[str, Any]]:
    """The entries of a list in ``owner`` that are objects; none where there is no such list."""
    entries = owner.get(key) if isinstance(owner, dict) else None
    return [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []


def _refuse_mesh(mesh: dict[str, Any], accessors: list[dict[str, Any]], number: int) -> None:
    """Raise ``MeshError`` for a mesh that moves, has fans, or has vertices that are no float32."""
    weights = mesh.get("weights")
    if isinstance(weights, list) and any(weights):
        raise MeshError(f"GLB: expected a mesh that stands still, got morph weights in mesh {number}: apply them")
    for primitive in _dicts(mesh, "primitives"):
        _refuse_integers(primitive, accessors, number)
        if primitive.get("mode", _TRIANGLES) == _TRIANGLE_FAN:
            raise MeshError(f"GLB: expected triangles or strips, got a TRIANGLE_FAN in mesh {number}")


def _refuse_integers(primitive: dict[str, Any], accessors: list[dict[str, Any]], mesh: int) -> None:
    """Raise ``MeshError`` for vertices that are no float32: trimesh reads quantized ones as they stand."""
    attributes = primitive.get("attributes")
    for key in ("POSITION", "TEXCOORD_0"):
        number = attributes.get(key) if isinstance(attributes, dict) else None
        kind = accessors[number].get("componentType") if isinstance(number, int) and 0 <= number < len(accessors) else 0
        if kind not in (0, _FLOAT32):
            raise MeshError(f"GLB: expected float32 {key}, got component type {kind} in mesh {mesh}: not quantized")


def _refuse_deep(nodes: list[dict[str, Any]]) -> None:
    """Raise ``MeshError`` for nodes in circles, or so deep within each other that trimesh takes minutes."""
    lists = [node.get("children") for node in nodes]
    children = [[c for c in row if isinstance(c, int)] if isinstance(row, list) else [] for row in lists]
    below = [child for row in children for child in row]
    if len(set(below)) < len(below):
        raise MeshError("GLB: expected each node below at most one other, got one below two")
    level, seen = set(range(len(nodes))) - {child for row in children for child in row}, 0
    for _ in range(_MAX_NODE_DEPTH):
        seen += len(level)
        level = {child for number in level for child in children[number] if 0 <= child < len(nodes)}
    if level or seen < len(nodes):
        raise MeshError(f"GLB: expected nodes at most {_MAX_NODE_DEPTH} deep and without circles, got others")
