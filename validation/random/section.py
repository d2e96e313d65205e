"""The section on scenes and meshes drawn at random: no pixel without a reason, no wrong hit.

What fails is kept whole, and made small.
"""

import shutil
from collections import Counter
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from renderer.scene.scene import load_scene
from validation.gates import Gate
from validation.hits.check import HitEffort, check_mesh
from validation.job import Job, Task
from validation.pictures.check import SHOWN
from validation.pictures.plan import PictureEffort
from validation.pictures.section import check_scene
from validation.random.meshes import draw_mesh
from validation.random.scenes import Drawn, draw_scene
from validation.random.shrink import shrunk, smaller_meshes, smaller_scenes
from validation.references.table import REFERENCES
from validation.thresholds import Thresholds

# How many of each; a quick run draws the first of them.
_FULL, _QUICK = 20, 4
_SIZE = 64
# Embree in its robust mode raises disagreements, and exact arithmetic decides.
_EMBREE = tuple(reference for reference in REFERENCES if reference.key == "embree_robust")
_HITS = HitEffort(rays=1_000, exact=60, leaks=0, references=_EMBREE)


def steps(job: Job) -> int:
    """Number of calls of ``job.step``."""
    return 2 * _count(job)


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Judge all that the seed draws; returns a record for JSON and the gates."""
    tasks = [
        Task(f"random: {kind} {number} of seed {job.seed}", partial(judge, job.seed, number, job.folder))
        for number in range(_count(job))
        for kind, judge in (("scene", judge_scene), ("mesh", judge_mesh))
    ]
    rows = job.each(tasks)
    costs = Counter[str]()
    for row in rows:
        costs.update(row.pop("costs"))
    return {"seed": job.seed, "rows": rows, "costs": dict(costs)}, [_gate(row) for row in rows]


def judge_scene(seed: int, number: int, folder: Path) -> dict[str, Any]:
    """The verdict on one scene; it is kept in ``folder`` where it fails."""
    drawn = draw_scene(np.random.default_rng([seed, number, 0]))
    record, red = _scene_gates(drawn)
    names = [drawn.table["materials"][thing["material"]].get("type", "phong") for thing in drawn.table["objects"]]
    subject = f"scene {number} of seed {seed}: {', '.join(names)}"
    row = {"subject": subject, "red": red, "kept": None} | record
    if red:
        kept = folder / "failed" / f"random-{seed}-scene-{number}"
        drawn.write(kept)
        small = shrunk(drawn, smaller_scenes, lambda other: bool(set(_scene_gates(other)[1]) & set(red)))
        small.write(kept / "small")
        row["kept"] = kept.relative_to(folder).as_posix()
    return row


def judge_mesh(seed: int, number: int, folder: Path) -> dict[str, Any]:
    """The verdict on the hits of one mesh; it is kept in ``folder`` where it fails."""
    mesh = draw_mesh(np.random.default_rng([seed, number, 1]))
    record, red = _mesh_gates(mesh)
    subject = f"mesh {number} of seed {seed}: {len(mesh.faces):,} faces"
    row = {"subject": subject, "red": red, "kept": None} | record
    if red:
        kept = folder / "failed" / f"random-{seed}-mesh-{number}"
        kept.mkdir(parents=True, exist_ok=True)
        save_ply(mesh, kept / "mesh.ply")
        small = shrunk(mesh, smaller_meshes, lambda other: bool(set(_mesh_gates(other)[1]) & set(red)))
        save_ply(small, kept / "small.ply")
        row["kept"] = kept.relative_to(folder).as_posix()
    return row


def _scene_gates(drawn: Drawn) -> tuple[dict[str, Any], list[str]]:
    """The counts of a scene's verdict, and the quantities of the gates that fail."""
    with TemporaryDirectory(prefix="random-") as name:
        folder = Path(name)
        path = drawn.write(folder / "scene")
        job = Job(True, Thresholds(), folder, lambda _: None, (path,))
        effort = PictureEffort(_SIZE, None, paths=False)
        record, gates = check_scene("drawn", "drawn at random", load_scene(path), effort, job)
        shutil.rmtree(folder / "failed", ignore_errors=True)
    verdict = record["rungs"][-1].get("verdict")
    counts = {"offsets": verdict["offsets"], "media": verdict["media"]["share"]} if verdict else {}
    seconds = {c["reference_name"]: c["reference_seconds"] for c in record["rungs"][-1]["comparisons"]}
    return {"faces": record["faces"], "gates": len(gates), "costs": seconds} | counts, _red(gates)


def _mesh_gates(mesh: Mesh) -> tuple[dict[str, Any], list[str]]:
    with TemporaryDirectory(prefix="random-") as name:
        job = Job(True, Thresholds(), Path(name), lambda _: None)
        record, gates = check_mesh("drawn", mesh, _HITS, job)
    return {"faces": len(mesh.faces), "gates": len(gates), "costs": record["costs"]}, _red(gates)


def _red(gates: list[Gate]) -> list[str]:
    """The quantities of the gates that fail; a camera drawn at random may look at nothing."""
    return sorted({gate.quantity for gate in gates if not gate.passed} - {SHOWN})


def _gate(row: dict[str, Any]) -> Gate:
    reason = (
        f"of {row['gates']}: on random input too, each pixel is explained and each hit confirmed by exact arithmetic"
    )
    return Gate("random", row["subject"], "failing gates", len(row["red"]), "at most", 0.0, reason)


def _count(job: Job) -> int:
    return _QUICK if job.quick else _FULL
