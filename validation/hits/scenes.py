"""Scenes of placed meshes: hits against exact arithmetic on the placed corners, and against Embree's instances."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from renderer.mesh.mesh import Mesh
from validation.gates import Gate
from validation.hits import mirrors
from validation.hits.check import EXACT, HitEffort, Target, check, load_reference
from validation.hits.placements import placements
from validation.hits.walks import check_walks
from validation.job import Job
from validation.merged import Merged, changed, made, parted
from validation.oracle.placing import Body, placed
from validation.references.mitsuba.hits import version
from validation.references.mitsuba.instances import MitsubaInstances
from validation.references.table import ALL, HitReference

# Rays of each family, and of these in the exact sample: the scenes differ in what they place, not in how rays meet it.
QUICK = HitEffort(rays=150, exact=30, leaks=0)
FULL = HitEffort(rays=2_000, exact=300, leaks=0)
# Rays through each body of parts, and of each kind in each mirror.
_PARTS_QUICK, _PARTS_FULL = (8, 100), (100, 3_000)
REFERENCE = "Embree's instances"
_NAMES = ("RayScene", "RayScene.add", "RayScene.closest_hit", "RayScene.any_hit", "SceneHits.object",
          "SceneHits.instance", "SceneHits.face")  # fmt: skip
_LEAVING = ("RayScene.closest_hit", "SceneHits.points", "SceneHits.normals", "SceneHits.through")
_CHANGES = ("RayScene.move", "RayScene.refit", "RayScene.remove", "RayScene.show")


def steps(a_mesh: int) -> int:
    """Number of calls of ``job.step``, of which a mesh takes so many."""
    return a_mesh * len(_cases()) + 2 * (1 + mirrors.steps())


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


def check_parts(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Rays that go through bodies of placed parts, and that such mirrors reflect; as ``check_walks`` and its like."""
    through, reflected = _PARTS_QUICK if job.quick else _PARTS_FULL
    found: dict[str, Any] = {"walks": [], "mirrors": []}
    gates: list[Gate] = []
    for kind, masked in (("placed parts", False), ("placed parts among others that the mask leaves out", True)):
        make = partial(parted, masked=masked)
        for key, (records, judged) in (
            ("walks", check_walks(job, through, make)),
            ("mirrors", mirrors.check_mirrors(job, reflected, make)),
        ):
            found[key] += records
            gates += [replace(gate, subject=f"{kind}: {gate.subject}", judged=_LEAVING) for gate in judged]
    return found, gates


def _cases() -> dict[str, tuple[list[Body], Callable[[list[Body]], Merged]]]:
    """By name bodies, and how a scene of them is made."""
    bodies = placements()
    found: dict[str, tuple[list[Body], Callable[[list[Body]], Merged]]] = {
        name: (bodies[name], made) for name in bodies
    }
    for name in ("mirrors", "shared edges and planes"):
        found[f"{name}, after changes"] = bodies[name], changed
    return found
