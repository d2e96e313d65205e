"""The data that the page fetches: a scene's description as JSON, its triangles and its octree's boxes as arrays."""

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.inspect.tree_boxes import boxes_at, levels
from renderer.mesh.mesh import face_normals
from renderer.picture.prepare import PreparedScene
from renderer.scene.light import DirectionalLight, Light
from renderer.scene.material import Material
from renderer.scene.needs import examine
from renderer.shade.records import DIFFUSE, MATERIAL_COLUMNS, REFLECTANCE, SHININESS, SPECULAR, TRANSMITTANCE
from renderer.viewer.protocol import MODES
from renderer.viewer.shown import ShownScene

MAGIC = 0x4853454D
# Materials are told apart by a uint16.
_MAX_MATERIALS = 65536


def description(shown: ShownScene) -> dict[str, Any]:
    """The answer to GET /scene: numbers, strings, lists and tables that JSON has."""
    scene, mesh = shown.scene, shown.prepared.mesh
    settings, stats = scene.render, shown.prepared.octree.stats
    return {
        "name": shown.name,
        "files": shown.files,
        "camera": scene.camera.model_dump(),
        "bounds": [corner.tolist() for corner in mesh.bounds],
        "faces": len(mesh.faces),
        "vertices": len(mesh.vertices),
        "render": settings.model_dump(include={"resolution", "samples", "max_depth", "shadows"}),
        "materials": [_material(name, material) for name, material in scene.materials.items()],
        "lights": [_light(light) for light in scene.lights],
        "ambient": scene.ambient,
        "background": scene.background,
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
    }


def mesh_bytes(prepared: PreparedScene) -> bytes:
    """The answer to GET /mesh, little-endian: uint32 MAGIC and F, then for each of F faces the corners as 9 float32 and
    their shading normals as 9 float32, then the materials as F uint16, filled up to four bytes.

    Raises ``ValueError`` where there are more materials than a uint16 counts.
    """
    arrays = prepared.arrays
    expect(len(arrays.materials) <= _MAX_MATERIALS, "materials", f"at most {_MAX_MATERIALS}", len(arrays.materials))
    corners = arrays.vertices[arrays.faces]
    normals = _normals(prepared, corners)
    material = (arrays.material // MATERIAL_COLUMNS).astype("<u2")
    head = struct.pack("<2I", MAGIC, len(arrays.faces))
    return b"".join(
        (
            head,
            corners.astype("<f4").tobytes(),
            normals.astype("<f4").tobytes(),
            material.tobytes(),
            bytes(len(material) % 2 * 2),
        )
    )


def boxes_bytes(prepared: PreparedScene, level: int) -> bytes:
    """The answer to GET /octree, little-endian: uint32 n and the number of levels, then n boxes of 6 float32: the lower
    and the upper corner of each node of ``level``, the root's being 0.
    """
    boxes = boxes_at(prepared.octree, level).astype("<f4")
    return struct.pack("<2I", len(boxes), levels(prepared.octree)) + boxes.tobytes()


def _normals(prepared: PreparedScene, corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """The normal at each corner, (F, 3, 3): the vertex's where a face is smooth, else the face's; 0 without area."""
    arrays = prepared.arrays
    normals = np.repeat(face_normals(corners)[:, None], 3, axis=1)
    if len(arrays.smooth):
        normals[arrays.smooth] = arrays.normals[arrays.faces[arrays.smooth]]
    return normals


def _material(name: str, material: Material) -> dict[str, Any]:
    row = material.row().tolist()
    colors = {"diffuse": DIFFUSE, "specular": SPECULAR, "reflectance": REFLECTANCE, "transmittance": TRANSMITTANCE}
    return {
        "name": name,
        "type": material.type,
        **{color: row[column : column + 3] for color, column in colors.items()},
        "shininess": row[SHININESS],
    }


def _light(light: Light) -> dict[str, Any]:
    if isinstance(light, DirectionalLight):
        return {"type": light.type, "direction": light.direction, "color": light.irradiance}
    return {"type": light.type, "position": light.position, "color": light.intensity}
