"""The section on hits: octrees and scenes against every reference, disagreements judged by exact arithmetic."""

from collections import Counter
from typing import Any

import numpy as np

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from validation.gates import Gate
from validation.hits import mirrors, scenes, seams, starts
from validation.hits.check import SEED, HitEffort, check_mesh
from validation.hits.errors import EXPONENTS
from validation.hits.leaks import check_leaks, leak_meshes
from validation.hits.rays import families, float32_exact
from validation.hits.refit import check_refit
from validation.hits.verdicts import LISTED
from validation.hits.walks import check_walks
from validation.hits.watertight import KINDS
from validation.job import Job
from validation.meshes import loose
from validation.scenes import SCENES

__all__ = ["FULL", "QUICK", "HitEffort", "check_leaks", "check_mesh", "meshes", "run", "steps"]

QUICK = HitEffort(rays=4_000, exact=200, leaks=100_000)
FULL = HitEffort(rays=20_000, exact=2_000, leaks=1_000_000)


def meshes() -> dict[str, Mesh]:
    """The suite's meshes, all float32-exact: our models, spheres far away, small and large, and unordered triangles."""
    models = {name: load_mesh(SCENES / "models" / f"{name}.ply") for name in ("teapot", "torus_knot", "stairs")}
    ball, coarse = icosphere(5), icosphere(3)
    # These powers of ten are not powers of two: they change every digit, and so the shape by a rounding.
    placed = {
        "sphere_far_away": Mesh(float32_exact(ball.vertices + np.array([1000.0, -2000.0, 500.0])), ball.faces),
        "sphere_times_1e-3": Mesh(float32_exact(coarse.vertices * 1e-3), coarse.faces),
        "sphere_times_1e3": Mesh(float32_exact(coarse.vertices * 1e3), coarse.faces),
    }
    rng = np.random.default_rng(SEED)
    corners = float32_exact(rng.normal(size=(2000, 1, 3)) + 0.1 * rng.normal(size=(2000, 3, 3)))
    return {**models, **placed, "triangle_soup": loose(corners)}


def steps(job: Job) -> int:
    """Number of calls of ``job.step``: one a family and mesh, two a closed mesh of the leaks, one for refits, and those
    of scenes and starts.
    """
    triangle = np.eye(3), np.array([[0, 1, 2]])
    a_mesh = len(families(*triangle, 1, SEED)) + 1
    if not job.own:
        return len(job.meshes) * a_mesh
    placed = scenes.steps(a_mesh) + len(KINDS)
    return len(meshes()) * a_mesh + 2 * len(leak_meshes()) + placed + 1 + starts.steps() + 1 + mirrors.steps()


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Check all meshes, the suite's own or a user's; returns a record for JSON and the gates."""
    effort = QUICK if job.quick else FULL
    records: list[dict[str, Any]] = []
    gates: list[Gate] = []
    for name, mesh in meshes().items() if job.own else _given(job):
        record, found = check_mesh(name, mesh, effort, job)
        records.append(record)
        gates += found
    names = [*(reference.name for reference in effort.references), scenes.REFERENCE]
    result: dict[str, Any] = {"seed": SEED, "exponents": list(EXPONENTS), "listed": LISTED, "references": names}
    result["meshes"] = records
    if job.own:
        gates += _add_own(result, effort, job)
    else:
        reason = "they need a closed mesh and a place within that sees all of it, as the suite's own have"
        result["leaks_left_out"] = reason
    costs: Counter[str] = Counter()
    for one in (*records, result.get("leaks", {"costs": {}})):
        costs.update(one["costs"])
    return result | {"costs": dict(costs)}, gates


def _add_own(result: dict[str, Any], effort: HitEffort, job: Job) -> list[Gate]:
    """Add to the record the checks of the suite's own meshes and scenes; returns the gates."""
    records, gates = scenes.check_scenes(job)
    result["meshes"] += records
    result["leaks"], found = check_leaks(effort, job)
    gates += found
    records, found = seams.check_seams(job)
    result["leaks"]["sets"] += records
    gates += found
    for key, check in (
        ("refit", check_refit),
        ("starts", starts.check_starts),
        ("walks", check_walks),
        ("mirrors", mirrors.check_mirrors),
        ("parts", scenes.check_parts),
    ):
        result[key], found = check(job)
        gates += found
    return gates


def _given(job: Job) -> list[tuple[str, Mesh]]:
    """A user's meshes by the names of their files, or by their paths where two names are equal."""
    stems = Counter(path.stem for path in job.meshes)
    return [(path.stem if stems[path.stem] == 1 else str(path), load_mesh(path)) for path in job.meshes]
