"""A scene's instances merged into the arrays that the Whitted kernel reads, and the mesh that the tree is built on."""

import numpy as np

from renderer.light import LIGHT_COLUMNS
from renderer.material import MATERIAL_COLUMNS
from renderer.mesh import Mesh
from renderer.scene import Scene
from renderer.whitted import World


def pack(scene: Scene) -> tuple[Mesh, World]:
    """The merged mesh of all instances in their order, and everything else that the kernel reads."""
    instances = scene.instances
    rows = {name: i for i, name in enumerate(scene.materials)}
    starts = np.cumsum([0] + [len(i.mesh.vertices) for i in instances])
    if instances:
        vertices = np.concatenate([i.mesh.vertices for i in instances])
        faces = np.concatenate([i.mesh.faces + np.int32(s) for i, s in zip(instances, starts, strict=False)])
    else:
        vertices, faces = np.zeros((0, 3)), np.zeros((0, 3), np.int32)
    counts = [len(i.mesh.faces) for i in instances]
    mesh = Mesh(vertices, faces)
    world = World(
        vertices=mesh.vertices,
        normals=_normals(scene, len(vertices)),
        faces=mesh.faces,
        material=np.repeat(np.array([rows[i.material] for i in instances], np.int32), counts),
        smooth=np.repeat(np.array([i.smooth for i in instances], np.bool_), counts),
        materials=np.array([m.row() for m in scene.materials.values()]).reshape(-1, MATERIAL_COLUMNS),
        lights=np.array([light.row() for light in scene.lights]).reshape(-1, LIGHT_COLUMNS),
        colors=np.array([scene.ambient, scene.background]),
    )
    return mesh, world


def _normals(scene: Scene, count: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Vertex normals, (V, 3), or (0, 3) where no instance is smooth."""
    if not any(i.smooth for i in scene.instances):
        return np.zeros((0, 3))
    normals = np.zeros((count, 3))
    start = 0
    for instance in scene.instances:
        end = start + len(instance.mesh.vertices)
        if instance.smooth:
            normals[start:end] = vertex_normals(instance.mesh)
        start = end
    return normals


def vertex_normals(mesh: Mesh) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """The file's own normals, or else the mean of the faces around each vertex, (V, 3) float64."""
    return mesh.normals if mesh.normals is not None else mesh.vertex_normals()
