"""The data that the page fetches: a scene's description as JSON, its triangles and its octree's boxes as arrays."""

import struct
from collections.abc import Iterator
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.diagnostics.tree_boxes import boxes_at, levels
from renderer.errors import expect
from renderer.materials.base import appearance_of
from renderer.materials.columns import DIFFUSE, MATERIAL_COLUMNS, REFLECTANCE, SHININESS, SPECULAR, TRANSMITTANCE
from renderer.materials.registry import Material
from renderer.mesh.mesh import face_normals
from renderer.picture.image import srgb
from renderer.picture.prepare import PreparedScene
from renderer.scene.hide import is_side
from renderer.scene.light import DirectionalLight, Light
from renderer.scene.needs import examine
from renderer.shade.surface import SceneArrays
from renderer.viewer.parts import parts_of
from renderer.viewer.protocol import MODES
from renderer.viewer.references import references
from renderer.viewer.shown import UNSEEN, ShownScene
from renderer.viewer.viewpoint import page_camera

MAGIC = 0x4853454D
# Materials are told apart by a uint16.
_MAX_MATERIALS = 65536
# Faces or boxes of a piece, some 100 KB: all that a client that stops reading keeps in memory.
_FACES = 4096


def description(shown: ShownScene) -> dict[str, Any]:
    """The answer to GET /scene: numbers, strings, lists and tables that JSON has."""
    scene, mesh = shown.scene, shown.prepared.mesh
    settings, stats = scene.render, shown.prepared.octree.stats
    return {
        "id": shown.id,
        "name": shown.name,
        "files": shown.files,
        "camera": page_camera(scene.camera).model_dump(),
        "bounds": [corner.tolist() for corner in mesh.bounds],
        "faces": len(mesh.faces),
        "vertices": len(mesh.vertices),
        "render": settings.model_dump(include={"resolution", "samples", "max_depth", "shadows"}),
        "materials": [_material(name, material) for name, material in scene.materials.items()],
        "objects": _objects(shown),
        "section": {
            "hidden": [name for name in shown.hidden if is_side(name)],
            "bounds": [corner.tolist() for corner in shown.whole.prepared.mesh.bounds],
        },
        "lights": [_light(light) for light in scene.lights],
        "ambient": scene.ambient,
        "background": scene.background,
        "sky": scene.sky and scene.sky.model_dump(exclude_none=True),
        "up": scene.up,
        "needs": {feature: [value, reason] for feature, value, reason in examine(scene)},
        "octree": {
            "levels": levels(shown.prepared.octree),
            "nodes": stats.nodes,
            "leaves": stats.leaves,
            "bytes": stats.bytes,
            "build_seconds": shown.prepared.build_seconds,
        },
        "threads": shown.threads,
        "modes": MODES,
        "references": list(references()),
    }


class Payload(NamedTuple):
    """Data for a client: its size in bytes, and the pieces that are sent as fast as the client reads."""

    size: int
    pieces: Iterator[bytes]


def mesh_payload(prepared: PreparedScene) -> Payload:
    """The answer to GET /mesh, little-endian: uint32 MAGIC and F, then for each of F faces the corners as 9 float32,
    then for each their shading normals as 9 float32, then the materials as F uint16, filled up to four bytes. If a
    material uses colours of vertices, then those of corners in 8-bit sRGB, 9 bytes for each face, white of others.

    Raises ``ValueError`` where there are more materials than a uint16 counts.
    """
    arrays, count = prepared.arrays, len(prepared.arrays.faces)
    expect(len(arrays.materials) <= _MAX_MATERIALS, "materials", f"at most {_MAX_MATERIALS}", len(arrays.materials))
    head = struct.pack("<2I", MAGIC, count)
    starts, filling = range(0, count, _FACES), count % 2 * 2
    parts = (_corners, _normals, _materials)
    chunks = (part(arrays, slice(i, i + _FACES)).tobytes() for part in parts for i in starts)
    tinted = count > 0 and bool((arrays.tints != 1.0).any())
    tints = (_tints(arrays, slice(i, i + _FACES)).tobytes() for i in (starts if tinted else ()))
    size = 8 + 74 * count + filling + 9 * count * tinted
    return Payload(size, chain([head], chunks, [bytes(filling)], tints))


def boxes_payload(prepared: PreparedScene, level: int) -> Payload:
    """The answer to GET /octree, little-endian: uint32 n and the number of levels, then n boxes of 6 float32: the lower
    and the upper corner of each node of ``level``, the root's being 0.
    """
    boxes = boxes_at(prepared.octree, level).astype("<f4")
    head = struct.pack("<2I", len(boxes), levels(prepared.octree))
    chunks = (boxes[i : i + _FACES].tobytes() for i in range(0, len(boxes), _FACES))
    return Payload(8 + boxes.nbytes, chain([head], chunks))


def _corners(arrays: SceneArrays, some: slice) -> NDArray[np.float32]:
    return arrays.vertices[arrays.faces[some]].astype("<f4")


def _normals(arrays: SceneArrays, some: slice) -> NDArray[np.float32]:
    """The normal at each corner, (F, 3, 3): the vertex's where a face is smooth, else the face's; 0 without area."""
    corners = arrays.vertices[arrays.faces[some]]
    normals = np.repeat(face_normals(corners)[:, None], 3, axis=1)
    if len(arrays.smooth):
        smooth = arrays.smooth[some]
        normals[smooth] = arrays.normals[arrays.faces[some][smooth]]
    return normals.astype("<f4")


def _tints(arrays: SceneArrays, some: slice) -> NDArray[np.uint8]:
    return srgb(arrays.tints[arrays.faces[some]])


def _materials(arrays: SceneArrays, some: slice) -> NDArray[np.uint16]:
    return (arrays.material[some] // MATERIAL_COLUMNS).astype("<u2")


def _material(name: str, material: Material) -> dict[str, Any]:
    look = appearance_of(material)
    row = look.row().tolist()
    colors = {"diffuse": DIFFUSE, "specular": SPECULAR, "reflectance": REFLECTANCE, "transmittance": TRANSMITTANCE}
    return {
        "name": name,
        "type": material.type,
        **{color: row[column : column + 3] for color, column in colors.items()},
        "shininess": row[SHININESS],
        "emission": look.emission,
        "fields": material.model_dump(exclude_none=True, exclude=set(UNSEEN)),
    }


def _objects(shown: ShownScene) -> list[dict[str, Any]]:
    """All objects of the scene, hidden ones too."""
    return [
        {
            "name": part.name,
            "label": part.label,
            "materials": sorted({instance.material for instance in part.instances}),
            "faces": part.faces,
            "bounds": part.bounds,
            "shown": part.name not in shown.hidden,
        }
        for part in parts_of(shown.whole.scene)
    ]


def _light(light: Light) -> dict[str, Any]:
    if isinstance(light, DirectionalLight):
        return {"type": light.type, "direction": light.direction, "color": light.irradiance}
    return {"type": light.type, "position": light.position, "color": light.intensity}
