"""All kernels compiled ahead, for CI and container images whose later runs then only load them."""

from itertools import product

import numpy as np

from renderer.camera import PerspectiveCamera
from renderer.light import PointLight
from renderer.material import Dielectric
from renderer.mesh import Mesh
from renderer.octree import BruteForce, Octree
from renderer.render import render
from renderer.scene import Scene, SceneObject

_CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
# Vertices that float32 holds, and others: their blocks, and so the kernels that read them, are of another type.
_SIZES = 1.0, 1.0 / 3.0


def compile_all() -> None:
    """Compile every kernel that a query or a picture calls, or load it where it was compiled before."""
    for size in _SIZES:
        mesh = Mesh(size * _CORNERS, np.array([[0, 1, 2]], np.int32))
        for accelerator in (Octree.from_mesh(mesh), Octree.from_mesh(mesh, split="sah"), BruteForce.from_mesh(mesh)):
            for t_max in (np.inf, np.ones(1)):
                accelerator.closest_hit([[0.1, 0.1, 1.0]], [[0.0, 0.0, -1.0]], t_max=t_max)
                accelerator.any_hit([[0.1, 0.1, 1.0]], [[0.0, 0.0, -1.0]], t_max=t_max)
        for normals, kind, split in product(("flat", "smooth"), ("octree", "brute"), ("midpoint", "sah")):
            render(_scene(mesh, normals), resolution=(1, 1), accelerator=kind, split=split)  # type: ignore[arg-type]


def _scene(mesh: Mesh, normals: str) -> Scene:
    """One triangle of glass before the eye: every kind of ray may come up."""
    return Scene(
        camera=PerspectiveCamera(type="perspective", eye=(0.1, 0.1, 1.0), target=(0.1, 0.1, 0.0)),
        materials={"glass": Dielectric(type="dielectric", ior=1.5)},
        lights=(PointLight(type="point", position=(0.0, 0.0, 2.0), intensity=(1.0, 1.0, 1.0)),),
        objects=(SceneObject(mesh=mesh, material="glass", normals=normals),),
    )
