"""Kernels compiled ahead, for CI, container images and folders that travel; and, for a first picture, in two processes.

Numba compiles in one thread of a process only, so a second process halves the wait.
"""

import os
import subprocess
from collections.abc import Callable, Iterator
from logging import getLogger
from pathlib import Path
from threading import Thread
from typing import NamedTuple

import numpy as np

from renderer import child, kernel_store
from renderer.camera import PerspectiveCamera
from renderer.compile_notice import QUIET_VARIABLE
from renderer.errors import expect
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

_TRIANGLE = Mesh([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0, 1, 2]])
# An icosphere of 20,480 faces: enough that its tree is built in parts, and quickly.
_SUBDIVISIONS = 5
_GLASS = Dielectric(type="dielectric", ior=1.5)


class Part(NamedTuple):
    """Kernels that are called together: what for, and a function that calls them all."""

    name: str
    call: Callable[[], object]


def queries() -> Iterator[Part]:
    """What builds, refits and asks an ``Octree`` or ``BruteForce``."""
    ray, rays = np.array([[0.1, 0.1, 1.0]]), np.tile([0.1, 0.1, 1.0], (20, 1))
    yield Part("build", lambda: Octree.from_mesh(icosphere(_SUBDIVISIONS)))
    sphere = Octree.from_mesh(icosphere(1))
    yield Part("refit", lambda: sphere.refit(sphere.mesh.vertices))
    yield Part("a few rays", lambda: sphere.closest_hit(ray, -ray))
    yield Part("many rays", lambda: sphere.closest_hit(rays, -rays))
    yield Part("brute force", lambda: BruteForce.from_mesh(_TRIANGLE).closest_hit(ray, -ray))


def pictures() -> Iterator[Part]:
    """What renders pictures and what the viewer calls beside them."""
    yield Part("pictures", lambda: render(_scene(_GLASS), resolution=(1, 1), accelerator="brute"))
    scene = _scene(Phong())
    stage = set_up(scene, needs_of(scene), "octree")
    yield Part("the viewer", lambda: touch_viewing(stage))


# By the name of the option.
PARTS: dict[str, tuple[Callable[[], Iterator[Part]], ...]] = {
    "queries": (queries,),
    "pictures": (queries, pictures),
    "all": (queries, pictures),
}


def compile_ahead(what: str = "all", began: Callable[[str], object] = lambda name: None) -> None:
    """Compile the kernels of ``PARTS[what]``, or load those that were compiled before.

    ``began(name)`` is called before each part.
    """
    expect(what in PARTS, "what", f"one of {sorted(PARTS)}", repr(what))
    for parts in PARTS[what]:
        for part in parts():
            began(part.name)
            part.call()


def compile_into(folder: Path) -> None:
    """Let kernels compiled from now on be kept in ``folder`` alone, which no run writes but this one."""
    folder.mkdir(parents=True, exist_ok=True)
    kernel_store.keep_in(folder)


def touch_viewing(stage: Stage) -> None:
    """Compile or load what the viewer calls beside pictures; takes milliseconds where that was done before."""
    eye, forward = stage.scene.camera.eye, stage.scene.camera.frame()[2]
    face_colors(stage.world, eye)
    ray_path(stage, eye, forward, 1)
    visited(stage.octree, eye, forward)


def compile_in_two() -> None:
    """Before a first picture: compile what builds trees here and what renders in another process.

    Does nothing where that was done before. Should the other process fail, that is said with its own last words, and
    its kernels are compiled here when needed.
    """
    if is_on_disk(render_tile) or available_threads() < 2:
        return
    log = getLogger("renderer.jit")
    log.info("compiling render_tile in another process meanwhile (once)")
    with subprocess.Popen(
        child.command(f"{__name__}:compile_picture"),
        env=child.environment(**{QUIET_VARIABLE: "1"}),
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as other:
        try:
            Octree.from_mesh(icosphere(_SUBDIVISIONS))
            # The child reads its input to the end, so that must stay open: no communicate().
            assert other.stderr is not None
            said = other.stderr.read().strip().splitlines()
            code = other.wait()
        finally:
            other.terminate()
    if code != 0:
        last = f": {said[-1]}" if said else ""
        log.warning("renderer: the process that compiles beside this one ended with exit code %s%s", code, last)


def compile_picture() -> None:
    """Compile what renders; no tree is built for it.

    Of use in a process of its own only, which it ends when standard input does, as it does when the parent is gone.
    """
    Thread(target=_end_with_input, daemon=True).start()
    render(_scene(_GLASS), resolution=(1, 1), accelerator="brute")


def _end_with_input() -> None:
    # Not by sys.stdin, whose lock a thread may not hold while the interpreter shuts down.
    os.read(0, 1)
    os._exit(1)


def _scene(material: Material) -> Scene:
    """One triangle before the eye; of glass, every kind of ray may come up."""
    return Scene(
        camera=PerspectiveCamera(type="perspective", eye=(0.1, 0.1, 1.0), target=(0.1, 0.1, 0.0)),
        materials={"its": material},
        lights=(PointLight(type="point", position=(0.0, 0.0, 2.0), intensity=(1.0, 1.0, 1.0)),),
        objects=(SceneObject(mesh=_TRIANGLE, material="its"),),
    )
