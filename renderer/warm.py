"""All kernels compiled ahead, for CI and container images whose later runs then only load them; and, for the first
picture ever, in two processes at once, because Numba compiles in one thread only.
"""

import os
import subprocess
import sys
from itertools import product
from logging import getLogger
from threading import Thread

import numpy as np

from renderer.camera import PerspectiveCamera
from renderer.face_phong import face_colors
from renderer.jit import is_on_disk
from renderer.light import PointLight
from renderer.material import Dielectric, Material, Phong
from renderer.mesh import Mesh
from renderer.needs import needs_of
from renderer.octree import BruteForce, Octree
from renderer.parallel import available_threads
from renderer.ray_path import ray_path
from renderer.render import render
from renderer.scene import Scene, SceneObject
from renderer.shapes import icosphere
from renderer.stage import Stage, set_up
from renderer.tile import render_tile
from renderer.tree_boxes import visited

_CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
# Vertices that float32 holds, and others: their blocks, and so the kernels that read them, are of another type.
_SIZES = 1.0, 1.0 / 3.0
# An icosphere of 20,480 faces: enough that its tree is built in parts, and quickly.
_SUBDIVISIONS = 5
_GLASS = Dielectric(type="dielectric", ior=1.5)


def compile_all() -> None:
    """Compile every kernel that a query, a picture or the viewer calls, or load it where it was compiled before."""
    for split in ("midpoint", "sah"):
        octree = Octree.from_mesh(icosphere(_SUBDIVISIONS), split=split)
        octree.refit(octree.mesh.vertices)
    for size in _SIZES:
        mesh = Mesh(size * _CORNERS, np.array([[0, 1, 2]], np.int32))
        for accelerator in (Octree.from_mesh(mesh), Octree.from_mesh(mesh, split="sah"), BruteForce.from_mesh(mesh)):
            for t_max in (np.inf, np.ones(1)):
                accelerator.closest_hit([[0.1, 0.1, 1.0]], [[0.0, 0.0, -1.0]], t_max=t_max)
                accelerator.any_hit([[0.1, 0.1, 1.0]], [[0.0, 0.0, -1.0]], t_max=t_max)
        for normals, kind, split in product(("flat", "smooth"), ("octree", "brute"), ("midpoint", "sah")):
            render(_scene(mesh, normals), resolution=(1, 1), accelerator=kind, split=split)  # type: ignore[arg-type]
        for material in (_GLASS, Phong()):
            scene = _scene(mesh, "flat", material)
            touch_viewing(set_up(scene, needs_of(scene), "octree"))


def touch_viewing(stage: Stage) -> None:
    """Compile or load what the viewer calls beside pictures; takes milliseconds where that was done before."""
    eye, forward = stage.scene.camera.eye, stage.scene.camera.frame()[2]
    face_colors(stage.world, eye)
    ray_path(stage, eye, forward, 1)
    visited(stage.octree, eye, forward)


def compile_in_two() -> None:
    """Before a first picture: compile what builds trees here and what renders in another process.

    Does nothing where that was done before. Should the other process fail, its kernels are compiled here when needed.
    """
    if is_on_disk(render_tile) or available_threads() < 2:
        return
    getLogger("renderer.jit").info("compiling render_tile in another process meanwhile (once)")
    command = [sys.executable, "-c", "from renderer.warm import compile_picture; compile_picture()"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL) as other:
        try:
            Octree.from_mesh(icosphere(_SUBDIVISIONS))
            other.wait()
        finally:
            other.terminate()


def compile_picture() -> None:
    """Compile what renders, for vertices that float32 holds; no tree is built for it.

    Of use in a process of its own only, which it ends when standard input does, as it does when the parent is gone.
    """
    Thread(target=_end_with_input, daemon=True).start()
    scene = _scene(Mesh(_CORNERS, np.array([[0, 1, 2]], np.int32)), "flat")
    render(scene, resolution=(1, 1), accelerator="brute")


def _end_with_input() -> None:
    # Not by sys.stdin, whose lock a thread may not hold while the interpreter shuts down.
    os.read(0, 1)
    os._exit(1)


def _scene(mesh: Mesh, normals: str, material: Material = _GLASS) -> Scene:
    """One triangle before the eye; of glass, every kind of ray may come up."""
    return Scene(
        camera=PerspectiveCamera(type="perspective", eye=(0.1, 0.1, 1.0), target=(0.1, 0.1, 0.0)),
        materials={"its": material},
        lights=(PointLight(type="point", position=(0.0, 0.0, 2.0), intensity=(1.0, 1.0, 1.0)),),
        objects=(SceneObject(mesh=mesh, material="its", normals=normals),),
    )
