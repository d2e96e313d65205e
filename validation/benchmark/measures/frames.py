"""Whole Whitted pictures: ours beside Mitsuba's with the same rays, and beside its own integrators."""

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.picture.render import render
from renderer.scene.scene import Scene, load_scene
from validation.scenes import SCENES
from validation.timing import RUNS, interleaved, ratio, timed

OURS, OURS_BUILT, LISTS = "ours", "ours_with_build", "mitsuba_llvm_lists"
SCALAR = "mitsuba_scalar_recursion"
LABELS = {
    OURS: "ours", OURS_BUILT: "ours, octree and scene arrays built too",
    LISTS: "Mitsuba llvm, Whitted by ray lists", "mitsuba_llvm_path": "Mitsuba llvm, path",
    "mitsuba_llvm_direct": "Mitsuba llvm, direct", "mitsuba_scalar_path": "Mitsuba scalar, path",
    SCALAR: "Mitsuba scalar, Whitted recursion",
}  # fmt: skip
_DEPTH = 6


def measure(quick: bool, llvm: bool, scalar: bool, step: Callable[[str], None]) -> dict[str, Any]:
    """``checkered.toml`` at 512 x 512 (256 x 256 if quick), depth 6, all contenders in turn; see ``record``."""
    size = 256 if quick else 512
    scene = load_scene(SCENES / "checkered.toml")
    step(f"frames: {size} x {size}")
    calls: dict[str, Callable[[], float]] = {
        OURS: lambda: _render(scene, size).render_seconds,
        OURS_BUILT: lambda: (lambda i: i.build_seconds + i.render_seconds)(_render(scene, size)),
    }
    image = _render(scene, size)
    counts: dict[str, dict[str, int]] = {OURS: {"all": int(image.rays.sum())}}
    pictures: dict[str, NDArray[Any]] = {}
    if scalar:
        _add_mitsuba(scene, size, llvm, calls, counts, pictures)
    seconds = interleaved(calls, RUNS)
    return {
        "scene": "checkered",
        "size": size,
        "max_depth": _DEPTH,
        "faces": sum(len(i.mesh.faces) for i in scene.instances),
        "labels": {name: LABELS[name] for name in calls},
        "contenders": {n: {"seconds": s, "median": statistics.median(s)} for n, s in seconds.items()},
        "ratios": {n: ratio(s, seconds[OURS]) for n, s in seconds.items() if n != OURS},
        "rays": counts,
        "pictures": {name: _difference(image.radiance, picture) for name, picture in pictures.items()},
    }


def _render(scene: Scene, size: int) -> Any:
    return render(scene, resolution=(size, size), max_depth=_DEPTH)


def _add_mitsuba(
    scene: Scene, size: int, llvm: bool, calls: dict[str, Any], counts: dict[str, Any], pictures: dict[str, Any]
) -> None:
    from validation.benchmark.peers.mitsuba_native import drawing
    from validation.references.mitsuba import scene as mitsuba_scene
    from validation.references.mitsuba import whitted as mitsuba_whitted

    rays = mitsuba_scene.camera_rays(scene, size, size, 1)[0]

    def recursion() -> float:
        """Seconds from the end of the first row, which shows background, to the picture's end: setup is excluded."""
        marks: list[float] = []
        pictures[SCALAR] = mitsuba_whitted.whitted(
            scene, size, size, max_depth=_DEPTH, rays=rays, progress=lambda *_: marks.append(time.perf_counter())
        )
        return marks[-1] - marks[0]

    if llvm:
        from validation.benchmark.peers.mitsuba_lists import RayLists

        lists = RayLists(scene, rays, _DEPTH)
        counts[LISTS] = {}
        pictures[LISTS] = lists.draw(counts[LISTS]).reshape(size, size, 3)
        calls[LISTS] = timed(lists.draw)
        calls["mitsuba_llvm_path"] = timed(drawing(scene, "llvm_ad_rgb", "path", size, _DEPTH))
        calls["mitsuba_llvm_direct"] = timed(drawing(scene, "llvm_ad_rgb", "direct", size, _DEPTH))
    calls["mitsuba_scalar_path"] = timed(drawing(scene, "scalar_rgb", "path", size, _DEPTH))
    calls[SCALAR] = recursion


def _difference(ours: NDArray[Any], theirs: NDArray[Any]) -> dict[str, float]:
    from validation.pictures.compare import compare

    compared = compare(ours, np.asarray(theirs, np.float64))
    return {"ssim": compared.ssim, "mean_error": compared.mean_error, "pixel_share": compared.pixel_share}
