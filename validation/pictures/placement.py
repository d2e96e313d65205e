"""The objects of a scene against trimesh: their files read, turned, moved and given vertex normals by somebody else.

Mitsuba is given our meshes as they stand in the world, so no picture could tell that one was read or placed wrongly.
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
from renderer.scene.scene import Instance, Scene, SceneObject
from validation.gates import Gate

NAME = "trimesh, files and their places"

# Of the scene's radius. Files hold float32, and a matrix of float64 adds nothing that shows: 1e-7 at most.
_VERTICES = 1e-6
# Length of the difference of unit vectors, as for the normals of AOVs: 1e-4 rad would show on no picture.
_NORMALS = 1e-4


def check(name: str, scene: Scene) -> tuple[dict[str, Any], list[Gate]]:
    """Judge every object that comes from a file; returns a record for JSON and a gate each for vertices and normals.

    An object that trimesh cuts into other triangles is left out with the reason, and so are normals that leave a
    choice. No gate where no object is left to judge.
    """
    began = time.perf_counter()
    corners = [instance.mesh.vertices for instance in scene.instances]
    radius = float(np.linalg.norm(np.concatenate(corners), axis=1).max()) if corners else 0.0
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
            # One by one they are hardly farther apart then.
            in_order = bool(np.abs(theirs - ours).max(initial=0.0) <= 4.0 * apart + _VERTICES * radius)
            open_to_choice = _normals_open(placed, instance.mesh, thing, in_order) if instance.smooth else None
            if open_to_choice is not None:
                left_out[f"{where}, normals"] = open_to_choice
            elif instance.smooth:
                normals.append(_between(placed, instance))
    record = {"reference": NAME, "objects": len(vertices), "smooth": len(normals), "left_out": left_out}
    record["seconds"] = time.perf_counter() - began
    gates = []
    if vertices:
        reason = "a file is read and placed as its scene says; Mitsuba is given our meshes"
        quantity = "vertices off trimesh's, of the radius"
        gates.append(Gate("images", f"{name}, objects", quantity, max(vertices), "at most", _VERTICES, reason))
    if normals:
        reason = "vertex normals are weighted by angles; Mitsuba is given ours"
        quantity = "vertex normals off trimesh's"
        gates.append(Gate("images", f"{name}, objects", quantity, max(normals), "at most", _NORMALS, reason))
    return record | {gate.quantity: gate.value for gate in gates}, gates


def _placed(thing: SceneObject) -> trimesh.Trimesh | None:
    """The object in the world: scaled, turned about x, y and z in this order, moved. None if trimesh has no mesh."""
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
    """Means and bounds of the corners (F, 3, 3), (F, 9): their order in a face says nothing about its place."""
    return np.concatenate([triangles.mean(axis=1), triangles.min(axis=1), triangles.max(axis=1)], axis=1)


def _apart(theirs: NDArray[np.float64], ours: NDArray[np.float64]) -> float:
    """How far the farthest triangle of either side is from the nearest of the other, by their extents.

    The order of the triangles says nothing either: trimesh puts those of a file's quads behind the others.
    """
    pairs = ((theirs, ours), (ours, theirs))
    return max(float(cKDTree(a).query(b, p=np.inf)[0].max(initial=0.0)) for a, b in pairs)


def _normals_open(placed: trimesh.Trimesh, mesh: Mesh, thing: SceneObject, in_order: bool) -> str | None:
    """Why two programs may have other vertex normals, both rightly, or in another order; None where they may not."""
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
