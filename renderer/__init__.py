"""An octree ray tracer for triangle meshes: ray queries, and Whitted pictures of scenes."""

from renderer.errors import MeshError, SceneError
from renderer.image import Image
from renderer.mesh import Mesh, Repairs, RepairWarning
from renderer.mesh_io import load_mesh
from renderer.octree import BruteForce, Octree
from renderer.query import Hits
from renderer.render import render
from renderer.scene import Scene, load_scene

__all__ = [
    "BruteForce",
    "Hits",
    "Image",
    "Mesh",
    "MeshError",
    "Octree",
    "RepairWarning",
    "Repairs",
    "Scene",
    "SceneError",
    "load_mesh",
    "load_scene",
    "render",
]
