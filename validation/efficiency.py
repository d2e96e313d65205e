"""Seconds: our closest hits beside Embree's in the same run, and the origin's table of brute force and octree."""

import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np

from renderer.mesh_io import load_mesh
from renderer.octree import Octree
from renderer.parallel import available_threads
from renderer.render import render
from renderer.scene import load_scene
from validation.cases import SCENES
from validation.embree import Embree
from validation.rays import camera_rays, random_rays

RUNS = 5
# The origin timed each of its configurations three times.
ORIGIN_RUNS = 3
# What the C++ program that this grew out of printed, on another machine and other models: 100 x 100, depth 3.
_ORIGIN_ROWS: tuple[tuple[Literal["octree", "brute"], int, int], ...] = (
    ("brute", 100, 3),
    ("octree", 100, 3),
    ("octree", 500, 6),
)
ORIGIN = {"brute_seconds": 205.4, "octree_seconds": 0.411}


def run(quick: bool, step: Callable[[str], None]) -> dict[str, object]:
    """Time hits and pictures; nothing here is gated, because speed on a shared machine proves nothing."""
    return {"hits": _hits(200_000 if quick else 1_000_000, step), "origin": _origin(step)}


def _hits(count: int, step: Callable[[str], None]) -> dict[str, object]:
    """Rays a second of ours and Embree's on one mesh and the same rays, in turn, after a warm-up."""
    mesh = load_mesh(SCENES / "models" / "displaced_sphere.ply")
    octree, embree = Octree.from_mesh(mesh), Embree(mesh.vertices, mesh.faces)
    single = Octree.from_mesh(mesh, threads=1)
    corners = mesh.vertices[mesh.faces]
    families = []
    for rays in (camera_rays(mesh.vertices, count), random_rays(corners, count, np.random.default_rng(1))):
        step(f"efficiency: {rays.name} rays")
        contenders: dict[str, Callable[[], Any]] = {
            "ours": partial(octree.closest_hit, rays.origins, rays.directions),
            "ours_one_thread": partial(single.closest_hit, rays.origins, rays.directions),
            "embree": partial(embree.closest_hit, rays.origins, rays.directions),
        }
        seconds = _interleaved(contenders)
        ratios = [e / o for e, o in zip(seconds["embree"], seconds["ours"], strict=True)]
        families.append(
            {
                "rays": rays.name,
                "count": len(rays),
                "mrays": {k: len(rays) / statistics.median(v) / 1e6 for k, v in seconds.items()},
                "ratio_to_embree": statistics.median(ratios),
            }
        )
    return {"mesh": "displaced_sphere", "faces": len(mesh.faces), "runs": RUNS, "families": families}


def _interleaved(contenders: dict[str, Callable[[], Any]]) -> dict[str, list[float]]:
    """Seconds of each contender in each of RUNS rounds; one round unseen first, for caches and compilation."""
    seconds: dict[str, list[float]] = {name: [] for name in contenders}
    for round_ in range(RUNS + 1):
        for name, call in contenders.items():
            began = time.perf_counter()
            call()
            if round_ > 0:
                seconds[name].append(time.perf_counter() - began)
    return seconds


def _origin(step: Callable[[str], None]) -> dict[str, object]:
    """The origin's table on our main scene: build and render, every run a new tree."""
    scene = load_scene(SCENES / "three_models.toml")
    # Compile both kernels before any clock starts.
    for accelerator, _, _ in _ORIGIN_ROWS:
        render(scene, resolution=(4, 4), max_depth=1, accelerator=accelerator)
    rows: list[dict[str, Any]] = []
    for accelerator, size, depth in _ORIGIN_ROWS:
        step(f"efficiency: origin, {accelerator} {size} x {size}")
        images = [
            render(scene, resolution=(size, size), max_depth=depth, accelerator=accelerator)
            for _ in range(ORIGIN_RUNS)
        ]
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
    brute, octree = rows[0], rows[1]
    return {
        "faces": sum(len(i.mesh.faces) for i in scene.instances),
        "threads": available_threads(),
        "rows": rows,
        "speedup": brute["median"] / octree["median"],
        "render_speedup": brute["render_median"] / octree["render_median"],
        "origin": ORIGIN | {"speedup": ORIGIN["brute_seconds"] / ORIGIN["octree_seconds"]},
    }
