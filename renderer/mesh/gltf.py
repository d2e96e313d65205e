"""Reading glTF 2.0: GLB, and JSON with its buffers in data URIs or files beside it.

Own code, because trimesh reads quantized numbers as they stand, leaves out instances, skins and morph targets, and
takes minutes for deep nodes, all in silence; pygltflib reads no arrays. The format: Khronos, "glTF 2.0 Specification".
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeGuard, TypeVar
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MeshError
from renderer.mesh.accessors import Accessors, data_of
from renderer.mesh.face_materials import checked_materials
from renderer.mesh.gltf_materials import Materials
from renderer.mesh.material import MeshMaterial
from renderer.mesh.mesh import Mesh, give_materials, give_parts
from renderer.mesh.parts import parts_of
from renderer.mesh.placements import Nodes, Placed
from renderer.mesh.reading import Reading
from renderer.system.files import read_whole

Floats = NDArray[np.float64]
T = TypeVar("T")

_JSON, _BINARY = b"JSON", b"BIN\0"
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
# What a file may require: what is read here, and the beginnings of names of extensions that move no vertex.
_READ = ("KHR_mesh_quantization", "EXT_mesh_gpu_instancing")
_HARMLESS = (
    "KHR_materials_",
    "KHR_technique",
    "KHR_texture_",
    "KHR_lights_",
    "EXT_texture_",
    "KHR_animation_",
    "KHR_xmp",
)
# What of a document has no place in a mesh.
_LEFT_OUT = ("animations", "cameras")


class _Shown(NamedTuple):
    """A node's meshes, one for each primitive, and their placements.

    name      of the node, or else of its mesh
    of_mesh   the name of the mesh
    key       nodes of one key show the same meshes
    matrices  None where the meshes stand in the world already
    """

    name: str
    of_mesh: str
    key: tuple[Any, ...]
    meshes: list[Mesh]
    matrices: list[Floats] | None

    def placed(self) -> list[Mesh]:
        """The meshes in the world."""
        if self.matrices is None:
            return self.meshes
        return [mesh.transformed(matrix) for mesh in self.meshes for matrix in self.matrices]


class _Corners(NamedTuple):
    """The corners of a primitive: positions, and what else its file gives each; and the material of its faces."""

    positions: Floats
    faces: NDArray[np.int64]
    attributes: dict[str, Any]
    material: MeshMaterial | None

    def mesh(self, reading: Reading) -> Mesh:
        mesh = reading.mesh(self.positions, self.faces, **self.attributes)
        if self.material is None:
            return mesh
        return give_materials(mesh, *checked_materials([self.material], None, len(mesh.faces)))


def parse_gltf(content: bytes, reading: Reading) -> Mesh:
    """All triangle meshes in a file's content, each where its nodes, instances and joints place it.

    Skins stand as the file's nodes are, morph targets by the file's weights. Nodes with meshes are parts. Buffers and
    images in files of their own are looked for in ``reading.folder``. Faces have the materials of their primitives.

    Raises ``MeshError``, which does not know the file's name.
    """
    return _parsed(content, reading, _merged)


def placed_gltf(content: bytes, reading: Reading) -> list[Placed]:
    """The same meshes, each once, with the matrices of the nodes and instances that show it.

    A mesh that joints pull is placed. A mesh has the name of its node, or that of the file's mesh if several show it.
    """
    return _parsed(content, reading, _apart)


def _parsed(content: bytes, reading: Reading, made: Callable[[list[_Shown], Reading], T]) -> T:
    """What is made of that which the nodes in a file's content show."""
    document, binary = _document(content)
    try:
        _refuse_unread(document)
        accessors = Accessors(document, _buffers(document, binary, reading.folder))
        with np.errstate(over="ignore", invalid="ignore"):  # what float64 cannot hold is rejected or repaired
            shown = list(_shown(document, accessors, Materials(document, accessors, reading), reading))
            found = made(shown, reading)
        left_out = [key for key in _LEFT_OUT if document.get(key)]
        if left_out and any(node.meshes for node in shown):
            reading.note("left out:", left_out)
    except MeshError:
        raise
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        # Each entry of a malformed document may be of any type, or missing.
        fault = " ".join(str(error).split())[:120]
        raise MeshError(f"malformed glTF: {type(error).__name__}: {fault}") from error
    return found


def buffer_names(content: bytes) -> list[str]:
    """The names of the files that a glTF file's content has its buffers in. Raises ``MeshError``."""
    buffers = _document(content)[0].get("buffers")
    entries = buffers if isinstance(buffers, list) else []
    uris = [entry.get("uri") for entry in entries if isinstance(entry, dict)]
    return [unquote(uri) for uri in uris if _names_file(uri)]


def _document(content: bytes) -> tuple[dict[str, Any], bytes | None]:
    """The JSON document, and the binary chunk of a GLB."""
    text, binary = content, None
    if content[:4] == b"glTF":
        version, length = (int.from_bytes(content[at : at + 4], "little") for at in (4, 8))
        if version != 2:
            raise MeshError(f"GLB: expected version 2, got version {version}")
        if len(content) < length:
            raise MeshError(f"truncated: expected {length} bytes, got {len(content)}")
        chunks = dict(reversed(list(_chunks(content, length))))  # the first of a kind counts
        text, binary = chunks.get(_JSON, b""), chunks.get(_BINARY)
    if text is content and content.lstrip()[:1] != b"{":
        raise MeshError(f"expected a first word 'glTF', got {content[:4]!r}")
    try:
        document = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise MeshError(f"malformed glTF: its JSON: {str(error)[:120]}") from error
    if not isinstance(document, dict):
        raise MeshError(f"malformed glTF: expected a JSON object, got {type(document).__name__}")
    return document, binary


def _chunks(content: bytes, length: int) -> Iterator[tuple[bytes, bytes]]:
    at = 12
    while at + 8 <= length:
        size = int.from_bytes(content[at : at + 4], "little")
        if at + 8 + size > len(content):
            raise MeshError(f"truncated: expected {at + 8 + size} bytes, got {len(content)}")
        yield content[at + 4 : at + 8], content[at + 8 : at + 8 + size]
        at += 8 + size


def _refuse_unread(document: dict[str, Any]) -> None:
    """Raise ``MeshError`` for a file that needs what is not read here."""
    version = str((document.get("asset") or {}).get("version", "2.0"))
    if isinstance(document.get("meshes"), dict) or version.startswith("1"):
        raise MeshError(f"glTF: expected version 2.0, got version {version if version[:1] == '1' else '1.0'}")
    for extension in document.get("extensionsRequired") or []:
        if extension not in _READ and not str(extension).startswith(_HARMLESS):
            raise MeshError(f"glTF: needs the extension {extension}, which is not read")


def _buffers(document: dict[str, Any], binary: bytes | None, folder: Path | None) -> list[bytes]:
    return [_buffer(number, buffer, binary, folder) for number, buffer in enumerate(document.get("buffers") or [])]


def _names_file(uri: object) -> TypeGuard[str]:
    return isinstance(uri, str) and not uri.startswith("data:") and "://" not in uri


def _buffer(number: int, buffer: dict[str, Any], binary: bytes | None, folder: Path | None) -> bytes:
    uri = buffer.get("uri")
    if uri is None and number == 0 and binary is not None:
        return binary
    if isinstance(uri, str) and uri.startswith("data:"):
        return data_of(uri)
    if not _names_file(uri) or folder is None:
        raise MeshError(f"glTF: expected the bytes of buffer {number}, got {str(uri)[:80]!r}")
    try:
        return read_whole(folder / unquote(uri))
    except OSError as error:
        raise MeshError(f"glTF: buffer {number}, {uri[:80]!r}: cannot be read: {error.strerror}") from error


def _shown(document: dict[str, Any], accessors: Accessors, materials: Materials, reading: Reading) -> Iterator[_Shown]:
    """The mesh that each node with one shows, in their order."""
    nodes = Nodes(document, accessors)
    known: dict[tuple[Any, ...], list[Mesh]] = {}
    for number, node in nodes.with_meshes():
        mesh = document["meshes"][node["mesh"]]
        weights = node.get("weights") or mesh.get("weights") or []
        of_mesh = str(mesh.get("name") or "")
        joined = any(nodes.have_joints(number, primitive["attributes"]) for primitive in mesh["primitives"])
        key = ("joints", number) if joined else (node["mesh"], *weights)
        if key not in known:
            cornered = ((each, _corners(each, weights, accessors, materials, reading)) for each in mesh["primitives"])
            primitives = [(each["attributes"], corners) for each, corners in cornered if corners is not None]
            known[key] = (
                list(_pulled(primitives, number, nodes, reading))
                if joined
                else [corners.mesh(reading) for _, corners in primitives]
            )
        matrices = None if joined else nodes.matrices(number)
        yield _Shown(str(node.get("name") or of_mesh), of_mesh, key, known[key], matrices)


def _pulled(
    primitives: list[tuple[dict[str, int], _Corners]], number: int, nodes: Nodes, reading: Reading
) -> Iterator[Mesh]:
    """The meshes in the world of a node's primitives, of which joints pull one at least."""
    for attributes, corners in primitives:
        if nodes.have_joints(number, attributes):
            yield _skinned(corners, nodes.joints(number, attributes)).mesh(reading)
        else:
            mesh = corners.mesh(reading)
            yield from (mesh.transformed(matrix) for matrix in nodes.matrices(number))


def _merged(shown: list[_Shown], reading: Reading) -> Mesh:
    """One mesh, of which each node is a part."""
    placed = [node.placed() for node in shown]
    counts = [sum(len(mesh.faces) for mesh in meshes) for meshes in placed]
    names = [node.name for node in shown]
    return give_parts(_joined([mesh for meshes in placed for mesh in meshes], reading), parts_of(names, counts))


def _apart(shown: list[_Shown], reading: Reading) -> list[Placed]:
    """A mesh for each key."""
    of_key: dict[tuple[Any, ...], list[_Shown]] = {}
    for node in shown:
        if node.meshes and node.matrices != []:
            of_key.setdefault(node.key, []).append(node)
    found = []
    for nodes in of_key.values():
        first = nodes[0]
        name = first.name if len(nodes) == 1 else first.of_mesh or first.name
        matrices = [[np.eye(4)] if node.matrices is None else node.matrices for node in nodes]
        names = [node.name for node, own in zip(nodes, matrices, strict=True) for _ in own]
        found.append(Placed(_joined(first.meshes, reading, name), np.concatenate(matrices), tuple(names)))
    return found


def _joined(meshes: list[Mesh], reading: Reading, name: str = "") -> Mesh:
    """One mesh without parts. Where only some primitives have them, others get white and texture coordinates (0, 0)."""
    if len({mesh.normals is None for mesh in meshes}) > 1:
        reading.note("left out, as only some primitives have them: normals")
    for attribute, width, value in (("colors", 3, 1.0), ("texcoords", 2, 0.0)):
        lacking = [getattr(mesh, attribute) is None for mesh in meshes]
        if any(lacking) and not all(lacking):
            rows: list[Any] = [{attribute: np.full((len(mesh.vertices), width), value)} for mesh in meshes]
            pairs = zip(meshes, rows, lacking, strict=True)
            meshes = [replace(mesh, **filled) if lacks else mesh for mesh, filled, lacks in pairs]
    return give_parts(Mesh.concatenate(meshes, name=name), ())


def _corners(
    primitive: dict[str, Any], weights: list[float], accessors: Accessors, materials: Materials, reading: Reading
) -> _Corners | None:
    mode = primitive.get("mode", _TRIANGLES)
    if mode not in (_TRIANGLES, _STRIP, _FAN):
        reading.note("left out, as they have no surface: points and lines")
        return None
    given = primitive["attributes"]
    positions = accessors.floats(given["POSITION"])
    indices = primitive.get("indices")
    order = np.arange(len(positions)) if indices is None else accessors.integers(indices)
    normals = accessors.floats(given["NORMAL"]) if "NORMAL" in given else None
    for weight, target in zip(weights, primitive.get("targets") or [], strict=False):
        if weight and "POSITION" in target:
            positions = positions + weight * accessors.floats(target["POSITION"])
        if weight and "NORMAL" in target and normals is not None:
            normals = normals + weight * accessors.floats(target["NORMAL"])
    attributes: dict[str, Any] = {"normals": normals}
    if "COLOR_0" in given:
        colors = accessors.floats(given["COLOR_0"])
        if colors.shape[1] == 4 and (colors[:, 3] < 1.0).any():
            reading.note("left out: the alpha of colours of vertices")
        attributes["colors"] = colors[:, :3]
    if "TEXCOORD_0" in given:
        # From the lower left, where the file counts from the upper.
        attributes["texcoords"] = accessors.floats(given["TEXCOORD_0"]) * [1.0, -1.0] + [0.0, 1.0]
    material = materials.material(primitive.get("material"))
    return _Corners(positions, _triangles(order, mode), attributes, material)


def _triangles(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    if mode == _TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if mode == _FAN:
        first = np.broadcast_to(order[:1], max(len(order) - 2, 0))
        return np.stack([first, order[1:-1], order[2:]], axis=1)
    found = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
    found[1::2] = found[1::2, [1, 0, 2]]  # every second one of a strip is turned
    return found


def _skinned(corners: _Corners, matrices: Floats) -> _Corners:
    """The corners moved by a matrix each, (V, 4, 4)."""
    moved = np.einsum("vij,vj->vi", matrices[:, :3, :3], corners.positions) + matrices[:, :3, 3]
    attributes = dict(corners.attributes)
    if attributes.get("normals") is not None:
        # By the matrix of cofactors, which a singular matrix has too.
        rows = matrices[:, :3, :3]
        cofactors = np.stack([np.cross(rows[:, 1], rows[:, 2]), np.cross(rows[:, 2], rows[:, 0]),
                              np.cross(rows[:, 0], rows[:, 1])], axis=1)  # fmt: skip
        attributes["normals"] = np.einsum("vij,vj->vi", cofactors, attributes["normals"])
    return corners._replace(positions=moved, attributes=attributes)
