"""Scenes of placed meshes: hits against exact arithmetic on the placed corners, and against Embree's instances."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.rayscene.scene import RayScene
from validation.gates import Gate
from validation.hits.check import EXACT, HitEffort, Target, check, load_reference
from validation.hits.placements import placements
from validation.job import Job
from validation.oracle.placing import Body, placed
from validation.references.mitsuba.hits import version
from validation.references.mitsuba.instances import MitsubaInstances
from validation.references.table import ALL, HitReference

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Rays of each family, and of these in the exact sample: the scenes differ in what they place, not in how rays meet it.
QUICK = HitEffort(rays=150, exact=30, leaks=0)
FULL = HitEffort(rays=2_000, exact=300, leaks=0)
REFERENCE = "Embree's instances"
_NAMES = ("RayScene", "RayScene.add", "RayScene.closest_hit", "RayScene.any_hit", "SceneHits.object",
          "SceneHits.instance", "SceneHits.face")  # fmt: skip
_CHANGES = ("RayScene.move", "RayScene.refit", "RayScene.remove", "RayScene.show")


class MergedHits(NamedTuple):
    """Hits by the faces of the mesh that the placed meshes make together."""

    t: Floats
    face: Ints


class Merged:
    """A scene that tells its hits as the mesh of ``oracle.placing.placed`` would."""

    def __init__(self, scene: RayScene, bodies: list[Body]) -> None:
        self.scene = scene
        self._first = np.zeros(max(scene.objects) + 1, np.int64)
        self._faces = self._first.copy()
        self._faces[scene.objects] = [len(body.faces) for body in bodies]
        counts = [len(body.faces) * len(body.matrices) for body in bodies]
        self._first[scene.objects] = np.cumsum([0, *counts[:-1]])

    def closest_hit(self, origins: Floats, directions: Floats, **options: Any) -> MergedHits:
        """``RayScene.closest_hit``."""
        hits = self.scene.closest_hit(origins, directions, **options)
        return MergedHits(hits.t, self.faces(hits))

    def faces(self, found: Any) -> Ints:
        """The numbers of the faces that were found, -1 for none."""
        number = self._first[found.object] + found.instance * self._faces[found.object] + found.face
        return np.where(found.object >= 0, number, -1)

    def any_hit(self, origins: Floats, directions: Floats) -> NDArray[np.bool_]:
        """``RayScene.any_hit``."""
        return self.scene.any_hit(origins, directions)


def steps(a_mesh: int) -> int:
    """Number of calls of ``job.step``, of which a mesh takes so many."""
    return a_mesh * len(_cases())


def check_scenes(job: Job, effort: HitEffort | None = None) -> tuple[list[dict[str, Any]], list[Gate]]:
    """Check all families of rays on each scene; returns records for JSON, as of meshes, and the gates."""
    effort = effort or (QUICK if job.quick else FULL)
    records, gates = [], []
    for name, (bodies, make) in _cases().items():
        mesh = Mesh(*placed(bodies))
        # Made of the bodies: the mesh's corners are float64 numbers.
        reference = HitReference("embree_instances", REFERENCE, version(), "float32", ALL, ALL,
                                 lambda *_, bodies=bodies: MitsubaInstances(bodies))  # fmt: skip
        judged = _NAMES if make is made else _NAMES + _CHANGES
        target = Target(name, mesh, make(bodies), (load_reference(reference, mesh),), judged, {EXACT: 0.0})
        record, found = check(target, effort, job)
        records.append(record)
        gates += found
    return records, gates


def _cases() -> dict[str, tuple[list[Body], Callable[[list[Body]], Merged]]]:
    """By name bodies, and how a scene of them is made."""
    found = placements()
    return {name: (bodies, made) for name, bodies in found.items()} | {
        f"{name}, after changes": (found[name], changed) for name in ("mirrors", "shared edges and planes")
    }


def made(bodies: list[Body]) -> Merged:
    """A scene of all bodies."""
    scene = RayScene()
    for body in bodies:
        scene.add(Mesh(body.vertices, body.faces), body.matrices)
    return Merged(scene, bodies)


def changed(bodies: list[Body]) -> Merged:
    """The same scene, made of other vertices and matrices, with more objects, and queried before each change."""
    scene = RayScene()
    ray = np.zeros(3), np.ones(3)
    extra = scene.add(box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)), np.eye(4))
    for body in bodies:
        turned, inverted = np.roll(body.matrices, 1, axis=0) + 0.25, body.vertices[::-1] * 3.0
        object_ = scene.add(Mesh(inverted, body.faces), turned)
        scene.closest_hit(*ray)
        scene.refit(object_, body.vertices)
        scene.closest_hit(*ray)
        scene.move(object_, body.matrices)
        scene.show(object_, False)
        scene.closest_hit(*ray)
        some = np.arange(0, len(body.matrices), 2)
        scene.move(object_, turned[some], instances=some)
        scene.closest_hit(*ray)
        scene.move(object_, body.matrices[some], instances=some)
        scene.show(object_)
    scene.remove(extra)
    return Merged(scene, bodies)
