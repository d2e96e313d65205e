"""A scene's objects against trimesh, which reads, rotates and moves their files and computes vertex normals on its own.

Mitsuba gets our meshes in world coordinates, so no picture could show that one was read or placed wrongly.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from trimesh import transformations

from renderer.mesh.mesh import Mesh
from renderer.scene.instance import Instance
from renderer.scene.scene import Scene, SceneObject
from validation.gates import Gate

NAME = "trimesh, files and their places"

# Share of the scene's radius. Files hold float32, and a float64 matrix adds no visible error: 1e-7 at most.
_VERTICES = 1e-6
# Length of the difference of unit vectors, as for the normals of AOVs: 1e-4 rad is invisible in any picture.
_NORMALS = 1e-4


def check(name: str, scene: Scene) -> tuple[dict[str, Any], list[Gate]]:
    """Judge every object that comes from a file; returns a record for JSON and a gate each for vertices and normals.

    An object that trimesh cuts into other triangles is left out with the reason, and so are ambiguous normals. Where no
    object is left to judge there is no gate.
    """
    began = time.perf_counter()
    corners = [instance.mesh.vertices for instance in scene.instances]
    radius = float(np.linalg.norm(np.concatenate(corners), axis=1).max()) if corners else 0.0

    # Compare each object with trimesh's, or note why it cannot be compared.
    vertices: list[float] = []
    normals: list[float] = []
    left_out: dict[str, str] = {}
    for number, (thing, instance) in enumerate(zip(scene.objects, scene.instances, strict=False)):
        where = f"objects.{number}"
        placed = None if not isinstance(thing.mesh, str | Path) else _placed(thing)
        if placed is None:
            left_out[where] = "it comes from no file that trimesh reads"
        elif placed.triangles.shape != instance.mesh.triangles.shape:
            left_out[where] = f"trimesh makes {len(placed.faces)} triangles of it, and we {len(instance.mesh.faces)}"
        else:
            theirs, ours = _extents(placed.triangles), _extents(instance.mesh.triangles)
            apart = _apart(theirs, ours) if len(ours) else 0.0
            vertices.append(apart / radius)
            # In the same order the triangles also match one by one, up to a small multiple of that distance.
            in_order = bool(np.abs(theirs - ours).max(initial=0.0) <= 4.0 * apart + _VERTICES * radius)
            open_to_choice = _normals_open(placed, instance.mesh, thing, in_order) if instance.smooth else None
            if open_to_choice is not None:
                left_out[f"{where}, normals"] = open_to_choice
            elif instance.smooth:
                normals.append(_between(placed, instance))

    # Make the record and the gates.
    record = {"reference": NAME, "objects": len(vertices), "smooth": len(normals), "left_out": left_out}
    record["seconds"] = time.perf_counter() - began
    gates, where = [], f"{name}, objects"
    if vertices:
        reason = "trimesh reads and places the same files; Mitsuba gets our meshes"
        quantity = "distance of vertices from trimesh's, share of the radius"
        judged: tuple[str, ...] = ("Scene.instances", "load_mesh")
        gates.append(Gate("images", where, quantity, max(vertices), "at most", _VERTICES, reason, judged))
    if normals:
        reason = "vertex normals are weighted by angles; Mitsuba gets ours"
        quantity = "distance of vertex normals from trimesh's"
        judged = ("Mesh.vertex_normals", "Mesh.transformed")
        gates.append(Gate("images", where, quantity, max(normals), "at most", _NORMALS, reason, judged))
    return record | {gate.quantity: gate.value for gate in gates}, gates


def _placed(thing: SceneObject) -> trimesh.Trimesh | None:
    """The object in the world: scaled, rotated about x, y and z in this order, moved. None if trimesh has no mesh."""
    untyped: Any = transformations
    try:
        read: Any = trimesh.load(str(thing.mesh), process=False, force="mesh")
    except (ValueError, NotImplementedError, OSError):
        return None
    x, y, z = np.radians(thing.rotate).tolist()
    matrix = untyped.compose_matrix(angles=(x, y, z), translate=thing.translate) @ np.diag([*thing.scale, 1.0])
    corners = trimesh.transform_points(np.asarray(read.vertices, np.float64), matrix)
    return trimesh.Trimesh(corners, read.faces, process=False)


def _extents(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means and bounds of the corners (F, 3, 3), as (F, 9): independent of the order of the corners in a face."""
    return np.concatenate([triangles.mean(axis=1), triangles.min(axis=1), triangles.max(axis=1)], axis=1)


def _apart(theirs: NDArray[np.float64], ours: NDArray[np.float64]) -> float:
    """Largest distance from a triangle of either side to the nearest of the other, by their extents.

    The result does not depend on the order of the triangles: trimesh puts those of a file's quads behind the others.
    """
    pairs = ((theirs, ours), (ours, theirs))
    return max(float(cKDTree(a).query(b, p=np.inf)[0].max(initial=0.0)) for a, b in pairs)


def _normals_open(placed: trimesh.Trimesh, mesh: Mesh, thing: SceneObject, in_order: bool) -> str | None:
    """Why two programs may rightly have different vertex normals, or in another order; None where they may not."""
    if not in_order:
        return "trimesh has its faces in another order"
    if mesh.normals is not None:
        return "its file brings them along"
    if not (placed.area_faces > 0.0).all():
        return "it has faces without area"
    return "it is mirrored" if np.prod(thing.scale) < 0.0 else None


def _between(placed: trimesh.Trimesh, instance: Instance) -> float:
    """Largest distance between the unit normals of the corners of all faces."""
    theirs: NDArray[np.float64] = np.asarray(placed.vertex_normals)[placed.faces]
    return float(np.linalg.norm(theirs - instance.normals[instance.mesh.faces], axis=-1).max())
