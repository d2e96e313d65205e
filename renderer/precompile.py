"""Compiles kernels in two processes: ahead, for CI, container images and copied folders, and before a first picture.

Numba compiles in only one thread of a process, so a second process halves the wait.
"""

import os
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from logging import getLogger
from pathlib import Path
from threading import Thread
from typing import NamedTuple

import numpy as np

from renderer.arguments.split import SPLIT, Split
from renderer.diagnostics.face_phong import face_colors
from renderer.diagnostics.ray_path import ray_path
from renderer.diagnostics.tree_boxes import visited
from renderer.errors import expect
from renderer.jit import cache as kernel_store
from renderer.jit.decorators import is_on_disk
from renderer.jit.notice import QUIET_VARIABLE
from renderer.materials.dielectric import Dielectric
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.octree import BruteForce, Octree
from renderer.picture.prepare import PreparedScene, prepare_scene
from renderer.picture.render import render
from renderer.rayscene.scene import RayScene
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import PointLight
from renderer.scene.needs import needs_of
from renderer.scene.scene import Scene, SceneObject
from renderer.shade.tile import render_tile
from renderer.studies.factors.compute import checked_tracing
from renderer.studies.factors.free import without_matrix
from renderer.studies.factors.rows import nothing_known, trace_rows
from renderer.studies.factors.work import face_pairs
from renderer.studies.hidden import occlusion
from renderer.studies.scanner import scan
from renderer.studies.views import visible_faces
from renderer.system import child
from renderer.system.threads import available_threads

_TRIANGLE = Mesh([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0, 1, 2]])
# Two triangles that see each other.
_FACING = Mesh([*_TRIANGLE.vertices, [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]], [[0, 1, 2], [3, 4, 5]])
# An icosphere of 20,480 faces: enough that its tree is built in parts, and quickly.
_SUBDIVISIONS = 5
_GLASS = Dielectric(type="dielectric", ior=1.5)
_GLOWING = Phong(emission=1.0)


class Part(NamedTuple):
    """Kernels with a common purpose: its name, and a function that calls them."""

    name: str
    call: Callable[[], object]


def _build(split: Split = SPLIT) -> None:
    Octree.from_mesh(icosphere(_SUBDIVISIONS), split=split)


def _refit() -> None:
    octree = Octree.from_mesh(_TRIANGLE)
    octree.refit(octree.mesh.vertices)


def _trace(count: int) -> None:
    # Hits of rays that start on a face are uncertain.
    for height in (1.0, 0.0):
        rays, octree = np.tile([0.1, 0.1, height], (count, 1)), Octree.from_mesh(_TRIANGLE)
        for query in (octree.closest_hit, octree.any_hit):
            query(rays, [0.0, 0.0, -1.0])


def _leave() -> None:
    octree, starts = Octree.from_mesh(_TRIANGLE), np.tile([0.1, 0.1, 0.0], (20, 1))
    for accelerator in (octree, BruteForce.from_mesh(_TRIANGLE)):
        for query in (accelerator.closest_hit, accelerator.any_hit):
            query(starts[:1], [0.0, 0.0, 1.0], leaving=0)
            query(starts, [0.0, 0.0, 1.0], leaving=0)
    octree.visible([0.1, 0.1, 0.0], [0.1, 0.1, 1.0], leaving=0)


def _contain() -> None:
    mesh = icosphere(0)
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        # So many that they are put in order.
        accelerator.contains(np.zeros((64, 3)))


def _gather() -> None:
    Octree.from_mesh(_TRIANGLE).all_hits([[0.1, 0.1, 1.0]], [[0.0, 0.0, -1.0]])


def _bound_errors() -> None:
    Octree.from_mesh(_TRIANGLE).closest_hit([0.1, 0.1, 1.0], [0.0, 0.0, -1.0], t_error=True)


def _find_nearest() -> None:
    for accelerator in (Octree.from_mesh(_TRIANGLE), BruteForce.from_mesh(_TRIANGLE)):
        # float64 decides for one point, not for the other.
        accelerator.closest_point([[0.0, 0.0, 1.0], [0.5, 0.5, 1e-300]])


def _count_steps() -> None:
    Octree.from_mesh(_TRIANGLE).count_steps([0.1, 0.1, 1.0], [0.0, 0.0, -1.0])


def _wind() -> None:
    for accelerator in (Octree.from_mesh(_TRIANGLE), BruteForce.from_mesh(_TRIANGLE)):
        accelerator.winding_number([0.0, 0.0, 1.0])
        accelerator.contains([0.0, 0.0, 1.0], winding=True)


def _study() -> None:
    octree = Octree.from_mesh(_TRIANGLE)
    for transmittance in (None, [0.5]):
        occlusion(octree, [0.1, 0.1, 1.0], None, [[0.0, 0.0, -1.0]], transmittance=transmittance)
    # The face is seen edge-on, and the scanner stands on it.
    visible_faces(octree, [9.0, 0.1, 0.0])
    scan(octree, [0.1, 0.1, 0.0], [[0.0, 0.0, 1.0]])
    _exchange()


def _place() -> None:
    # Of one instance the mesh alone is traced.
    scene, ball = RayScene(), icosphere(0)
    scene.add(ball, np.stack([np.eye(3, 4)] * 2))
    for count in (1, 20):
        origins, down = np.tile([0.1, 0.1, 2.0], (count, 1)), [0.0, 0.0, -1.0]
        hits = scene.closest_hit(origins, down)
        scene.any_hit(origins, down)
        for query in (scene.closest_hit, scene.any_hit):
            query(hits.points, down, leaving=hits)
    for ask in (scene.all_hits, scene.count_steps):
        ask(origins, down)
    scene.contains(origins)
    scene.closest_point(origins)
    # The scanner stands on a face.
    scan(scene, ball.triangles[0].mean(axis=0), [[0.0, 0.0, 1.0]])


def _exchange() -> None:
    # Not by view_factors, which needs SciPy.
    for accelerator in (Octree.from_mesh(_FACING), BruteForce.from_mesh(_FACING)):
        # The rays that one face lets through start again.
        tracing = checked_tracing(accelerator, sides="both", transmittance=[0.5, 0.0], max_rays=256)
        trace_rows(tracing, np.arange(2), nothing_known(2))
        face_pairs(tracing, np.array([[0, 1]]))
        without_matrix(tracing)


def _search() -> None:
    brute = BruteForce.from_mesh(_TRIANGLE)
    for query in (brute.closest_hit, brute.any_hit):
        query([[0.1, 0.1, 1.0]], [[0.0, 0.0, -1.0]])


def _render(material: Material = _GLASS) -> None:
    # Brute force, so that no tree is built.
    render(_scene(material), resolution=(1, 1), accelerator="brute")


def _render_copies(material: Material = _GLASS) -> None:
    # So many faces in all that the mesh is kept once.
    ball = SceneObject(mesh=icosphere(4), material="its")
    render(_scene(material, *[ball] * 6), resolution=(1, 1))


def _view() -> None:
    for material in (_GLASS, Phong()):
        scene = _scene(material)
        touch_viewing(prepare_scene(scene, needs_of(scene), "octree"))


_QUERIES = (
    Part("build", _build),
    Part("build by middles", partial(_build, "midpoint")),
    Part("refit", _refit),
    Part("a few rays", partial(_trace, 1)),
    Part("many rays", partial(_trace, 20)),
    Part("rays that leave faces", _leave),
    Part("brute force", _search),
    Part("all hits", _gather),
    Part("errors of t", _bound_errors),
    Part("points inside", _contain),
    Part("closest points", _find_nearest),
    Part("steps of a search", _count_steps),
    Part("winding numbers", _wind),
    Part("studies", _study),
    Part("scenes of instances", _place),
)
_PICTURES = (
    Part("pictures", _render),
    Part("pictures with textures", partial(_render, _GLOWING)),
    Part("pictures of copies", _render_copies),
    Part("pictures of copies with textures", partial(_render_copies, _GLOWING)),
    Part("the viewer", _view),
)
# By the name of the command's option.
PARTS: dict[str, tuple[Part, ...]] = {
    "queries": _QUERIES,
    "pictures": (*_QUERIES, *_PICTURES[:-1]),
    "all": (*_QUERIES, *_PICTURES),
}


def compile_ahead(what: str = "all", began: Callable[[str], object] = lambda name: None) -> None:
    """Compile the kernels of ``PARTS[what]``, or load them if they are on disk.

    ``began(name)`` is called before each part.
    """
    expect(what in PARTS, "what", f"one of {sorted(PARTS)}", repr(what))
    for part in PARTS[what]:
        began(part.name)
        part.call()


def compile_into(folder: Path) -> None:
    """From now on keep compiled kernels only in ``folder``, to which no other run writes."""
    with suppress(FileExistsError, NotADirectoryError):
        folder.mkdir(parents=True, exist_ok=True)
    expect(folder.is_dir(), "output", "a folder, or the path of a new one", repr(str(folder)))
    kernel_store.keep_in(folder)


def touch_viewing(prepared: PreparedScene) -> None:
    """Compile or load the kernels that the viewer needs besides pictures; takes milliseconds if they are on disk."""
    eye, forward = prepared.scene.camera.eye, prepared.scene.camera.frame()[2]
    face_colors(prepared.arrays, eye)
    ray_path(prepared, eye, forward, 1)
    visited(prepared.octree, eye, forward)
    prepared.octree.count_steps(eye, forward)
    prepared.octree.closest_hit(eye, forward, t_error=True)


def compile_in_two(textures: bool = False) -> None:
    """Before a first picture, or one with ``textures``: compile the kernels that build trees and what the others search
    carefully with here, and those that render in another process. Does nothing if they are on disk.
    """
    if is_on_disk(render_tile) or available_threads() < 2:
        return
    getLogger("renderer.jit").info("compiling render_tile in another process meanwhile (once)")
    # No tree is built for either.
    with _beside(["pictures with textures" if textures else "pictures"]):
        # First what the other process needs later than this one has it.
        BruteForce.from_mesh(_TRIANGLE).closest_hit([0.1, 0.1, 0.0], [0.0, 0.0, 1.0], leaving=0)
        _build()


def compile_ahead_in_two(what: str, folder: Path | None, began: Callable[[str], object]) -> None:
    """``compile_ahead``, while another process compiles the same parts from the last on; ``folder`` as chosen by
    ``compile_into``.
    """
    backwards = [part.name for part in reversed(PARTS[what])]
    with nullcontext() if available_threads() < 2 else _beside(backwards, folder):
        compile_ahead(what, began)


@contextmanager
def _beside(names: Sequence[str], folder: Path | None = None) -> Iterator[None]:
    """Another process compiles the parts of these names meanwhile, into ``folder`` or where this one does by itself.

    If it fails, its last line of output is logged, and its kernels are compiled here when needed.
    """
    with subprocess.Popen(
        child.command(f"{__name__}:compile_parts", str(folder or ""), *names),
        env=child.environment(**{QUIET_VARIABLE: "1"}),
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as other:
        try:
            yield
            # The child reads its input to the end, so that must stay open: no communicate().
            assert other.stderr is not None
            said = other.stderr.read().strip().splitlines()
            code = other.wait()
        finally:
            other.terminate()
    if code != 0:
        last = f": {said[-1]}" if said else ""
        getLogger("renderer.jit").warning(
            "renderer: the process that compiles beside this one ended with exit code %s%s", code, last
        )


def compile_parts(folder: str, *names: str) -> None:
    """Compile the parts of these names, into ``folder`` unless it is "".

    Call it only in a process of its own: it ends the process when standard input ends, for instance because the parent
    is gone.
    """
    Thread(target=_end_with_input, daemon=True).start()
    if folder:
        compile_into(Path(folder))
    parts = {part.name: part for part in PARTS["all"]}
    for name in names:
        parts[name].call()


def _end_with_input() -> None:
    # Not by sys.stdin, whose lock a thread may not hold while the interpreter shuts down.
    os.read(0, 1)
    os._exit(1)


def _scene(material: Material, *objects: SceneObject) -> Scene:
    """Objects of ``material``, or one triangle of it, before the eye; for glass, every kind of ray may occur."""
    return Scene(
        camera=PerspectiveCamera(type="perspective", eye=(0.1, 0.1, 1.0), target=(0.1, 0.1, 0.0)),
        materials={"its": material},
        lights=(PointLight(type="point", position=(0.0, 0.0, 2.0), intensity=(1.0, 1.0, 1.0)),),
        objects=objects or (SceneObject(mesh=_TRIANGLE, material="its"),),
    )
