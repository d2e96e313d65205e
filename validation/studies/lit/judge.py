"""Pictures of scenes lit by radiosity against Mitsuba's path integrator, with their meshing error; and a furnace."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.picture.render import render
from renderer.radiosity import lit_scene
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.scene import Scene, SceneObject
from validation.gates import Gate
from validation.job import Job, Task
from validation.references.mitsuba import global_light
from validation.studies.lit.scenes import LIT

Floats = NDArray[np.float64]

# Pixels of a side, and of the squares whose means are compared: at edges of objects single pixels differ.
_SIZE, _SQUARE = 48, 4
# Paths a pixel: their standard error of a square is below 1 %.
_PATHS, _QUICK_PATHS = 2048, 512
# Of view factors: their errors are then smaller than those of meshing.
_RTOL = 0.02
# Mean relative error with these patches. Shadows are as blurred as patches are wide.
_ERROR = 0.03
# Of all light in the picture: blurring moves light, and makes none. At outlines of objects some of it is moved out of
# sight.
_LIGHT = 0.015
# Radiance is stored as float32, and colours between vertices are blended; the solution errs by 1e-6.
_FURNACE = 1e-5
_JUDGED = ("radiosity.lit_scene",)
_MESHED = "the difference to the picture with patches twice as long, and three standard errors of the paths"
_BLURRED = "shadows are as blurred as patches are wide"
_KEPT = "patches blur light, and make none"
_CONSTANT = "closed form: what emits all that it does not return is equally bright everywhere"


def run(job: Job) -> list[Gate]:
    """The gates of all checks."""
    return gates(record(iter(job.each(tasks(job.quick)))))


def tasks(quick: bool) -> list[Task]:
    """The tasks of the section on studies whose results ``record`` takes."""
    return [
        *(Task(f"studies: {name}", partial(check_scene, name, quick)) for name in LIT),
        Task("studies: a furnace by radiosity", check_furnace),
    ]


def record(found: Iterator[Any]) -> dict[str, Any]:
    """The results of ``tasks`` for JSON."""
    return {"scenes": [next(found) for _ in LIT], "furnace": next(found)}


def gates(record: dict[str, Any]) -> list[Gate]:
    """The gates of a record."""
    found = []
    for row in record["scenes"]:
        subject = row["subject"]
        found += [
            Gate("studies", subject, "error over its bound", row["share_of_bound"], "at most", 1.0, _MESHED, _JUDGED),
            Gate("studies", subject, "mean relative error", row["error"], "at most", _ERROR, _BLURRED, _JUDGED),
            Gate("studies", subject, "relative error of all light", row["light"], "at most", _LIGHT, _KEPT, _JUDGED),
        ]
    off = record["furnace"]["error"]
    return [
        *found,
        Gate("studies", "a furnace", "largest error by radiosity", off, "at most", _FURNACE, _CONSTANT, _JUDGED),
    ]


def check_scene(name: str, quick: bool) -> dict[str, Any]:
    """A row: our picture against random paths, in means over squares of pixels."""
    made, fine, coarse = LIT[name]
    scene, edge = made(), coarse if quick else fine
    theirs = global_light.global_light(scene, _SIZE, _SIZE, _QUICK_PATHS if quick else _PATHS)
    judged = _without_lamps(scene)
    ours, rough = (_squares(shown(scene, length))[judged] for length in (edge, 2.0 * edge))
    mean = _squares(theirs.mean)[judged]
    # The errors of pixels are independent.
    noise = np.sqrt(_squares(theirs.error**2))[judged] / _SQUARE
    whole = float(mean.mean())
    error, meshing, paths = (float(part.mean()) / whole for part in (np.abs(ours - mean), np.abs(ours - rough), noise))
    return {
        "subject": name, "edge": edge, "error": error, "meshing": meshing, "paths": paths,
        "share_of_bound": error / (meshing + 3.0 * paths), "light": abs(float(ours.mean()) / whole - 1.0),
    }  # fmt: skip


def shown(scene: Scene, edge: float) -> Floats:
    """Our picture with patches of that length."""
    return render(lit_scene(scene, edge, rtol=_RTOL), resolution=_SIZE, samples=16).radiance.astype(np.float64)


def _without_lamps(scene: Scene) -> NDArray[np.bool_]:
    """The squares that show nothing that shines by itself: at its edges samples decide more than light does."""
    dark = scene.altered(lights=(), background=0.0)
    shines = render(dark, resolution=_SIZE, samples=16).radiance.max(axis=2) > 0.0
    # And no neighbour of a pixel that does: other samples may.
    near: Any = np.lib.stride_tricks.sliding_window_view(np.pad(shines, 1), (3, 3)).any(axis=(2, 3))
    return np.asarray(_squares(np.repeat(near[..., None], 3, axis=2))[..., 0] == 0.0)


def check_furnace() -> dict[str, Any]:
    """The largest error of a closed body's inside that emits what it does not return."""
    ball = icosphere(2)
    inside = Mesh(ball.vertices, ball.faces[:, ::-1])
    rho = np.array([0.2, 0.5, 0.8])
    eye = PerspectiveCamera(eye=(0.1, 0.2, 0.3), target=(0.0, 0.0, -1.0), fov=120.0)
    walls = SceneObject(mesh=inside, material="walls")
    scene = Scene(camera=eye, materials={"walls": Phong(diffuse=rho, emission=1.0 - rho)}, objects=[walls])
    picture = render(lit_scene(scene, 0.5), resolution=32).radiance
    return {"error": float(np.abs(picture - 1.0).max())}


def _squares(picture: Floats) -> Floats:
    """Means over squares of pixels."""
    count = _SIZE // _SQUARE
    return np.asarray(picture.reshape(count, _SQUARE, count, _SQUARE, 3).mean(axis=(1, 3)))
