"""The section on efficiency: rays a second beside Embree's, the student program's table, and error against seconds.

Nothing here has a gate, because speed on a shared machine proves nothing.
"""

import statistics
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from renderer.mesh.load import load_mesh
from renderer.octree import Octree
from renderer.picture.render import render
from renderer.scene.scene import load_scene
from renderer.system.threads import available_threads
from validation.efficiency import hits, pictures
from validation.gates import Gate
from validation.hits.rays import camera_rays, random_rays
from validation.job import Job
from validation.references.embree import Embree
from validation.scenes import SCENES
from validation.timing import RUNS, interleaved, ratio, spending, timed

# The student's program timed each of its configurations three times; a quick run does once.
STUDENT_RUNS = 3
# Times printed by the student's C++ program from which this renderer grew, on another machine and other models: 100 x
# 100, depth 3.
_STUDENT_ROWS: tuple[tuple[Literal["octree", "brute"], int, int], ...] = (
    ("brute", 100, 3),
    ("octree", 100, 3),
    ("octree", 500, 6),
)
STUDENT_SECONDS = {"brute_seconds": 205.4, "octree_seconds": 0.411}


def steps(job: Job) -> int:
    """Number of calls of ``job.step``: two families of rays, the student program's rows, two of error against time."""
    return 2 + len(_STUDENT_ROWS) + 2


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Time hits and pictures; returns a record for JSON and no gate."""
    costs: dict[str, float] = {}
    record: dict[str, Any] = {"hits": _hits(200_000 if job.quick else 1_000_000, job.step, costs)}
    record["origin"] = _student_program(1 if job.quick else STUDENT_RUNS, job.step)
    job.step("efficiency: error of hits against run time")
    record["tradeoff_hits"] = hits.run(hits.QUICK if job.quick else hits.FULL, costs)
    job.step("efficiency: error of pictures against run time")
    effort = pictures.QUICK if job.quick else pictures.FULL
    scene = load_scene(SCENES / "mirrors.toml")
    record["tradeoff_pictures"], record["split"] = pictures.run(scene, "mirrors", effort, costs)
    return record | {"costs": costs}, []


def _hits(count: int, step: Callable[[str], None], costs: dict[str, float]) -> dict[str, object]:
    """Rays a second of ours and Embree's on one mesh with the same rays, in turn, after a warm-up."""
    mesh = load_mesh(SCENES / "models" / "displaced_sphere.ply")
    octree, embree = Octree.from_mesh(mesh), Embree(mesh.vertices, mesh.faces)
    single = Octree.from_mesh(mesh, threads=1)
    corners = mesh.vertices[mesh.faces]
    families = []
    for rays in (camera_rays(mesh.vertices, count), random_rays(corners, count, np.random.default_rng(1))):
        step(f"efficiency: {rays.name} rays")
        queries: dict[str, Callable[..., Any]] = {
            "ours": octree.closest_hit,
            "ours_one_thread": single.closest_hit,
            "embree": spending(costs, "Embree robust", embree.closest_hit),
        }
        calls = {name: timed(query, rays.origins, rays.directions) for name, query in queries.items()}
        seconds = interleaved(calls, RUNS)
        families.append(
            {
                "rays": rays.name,
                "count": len(rays),
                "mrays": {k: len(rays) / statistics.median(v) / 1e6 for k, v in seconds.items()},
                "ratio_to_embree": ratio(seconds["embree"], seconds["ours"]),
            }
        )
    return {"mesh": "displaced_sphere", "faces": len(mesh.faces), "runs": RUNS, "families": families}


def _student_program(runs: int, step: Callable[[str], None]) -> dict[str, object]:
    """The student program's table on our main scene: build and render, with a new tree in every run."""
    scene = load_scene(SCENES / "three_models.toml")
    # Compile both kernels before any clock starts.
    for accelerator, _, _ in _STUDENT_ROWS:
        render(scene, resolution=(4, 4), max_depth=1, accelerator=accelerator)
    # Time each row of the table, with a new tree in every run.
    rows: list[dict[str, Any]] = []
    for accelerator, size, depth in _STUDENT_ROWS:
        step(f"efficiency: student program, {accelerator} {size} x {size}")
        images = [render(scene, resolution=(size, size), max_depth=depth, accelerator=accelerator) for _ in range(runs)]
        seconds = [i.build_seconds + i.render_seconds for i in images]
        rows.append(
            {
                "accelerator": accelerator,
                "size": size,
                "max_depth": depth,
                "seconds": seconds,
                "median": statistics.median(seconds),
                "render_median": statistics.median(i.render_seconds for i in images),
                "rays": int(images[0].rays.sum()),
            }
        )
    # Compare with brute force, and with the times that the student's program printed.
    brute, octree = rows[0], rows[1]
    return {
        "faces": sum(len(i.mesh.faces) for i in scene.instances),
        "threads": available_threads(),
        "rows": rows,
        "speedup": brute["median"] / octree["median"],
        "render_speedup": brute["render_median"] / octree["render_median"],
        "origin": STUDENT_SECONDS | {"speedup": STUDENT_SECONDS["brute_seconds"] / STUDENT_SECONDS["octree_seconds"]},
    }
