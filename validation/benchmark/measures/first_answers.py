"""Seconds to the first results: with nothing compiled, and with kernels compiled ahead.

CPU seconds are those of a process and its children, as the system counts them, so that compiling in two processes at
once does not look cheaper. Each process starts with its own cache folder.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from renderer.jit.levels import AHEAD_VARIABLE
from renderer.system import child
from validation.scenes import SCENES

_RUNS = 3
_HERE = "validation.benchmark.measures.first_answers"
_FIRST_HIT = "validation.benchmark.measures.first_hit:first_hit"
# Python keeps bytecode of the sources, as after an installation.
_WITH_BYTECODE = {"PYTHONDONTWRITEBYTECODE": ""}
# Sizes of the mesh: float32 does not hold its vertices times a third, and holds them as they are.
_FLOAT64, _FLOAT32 = "0.3333333333333333", "1.0"


class Spent(NamedTuple):
    """Wall seconds of a process, and CPU seconds including its children's."""

    wall: float
    cpu: float


def measure(step: Callable[[str], None]) -> dict[str, Any] | None:
    """The first results as ``rows`` by name, and ``level``, the level of the kernels compiled ahead.

    Each row has ``unit``, the ``values`` of all runs and their ``median``. None where the system does not count the
    seconds of children.
    """
    if os.name != "posix":
        return None
    step("first answers")
    found: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory(prefix="first-") as name:
        folder = Path(name)
        level, ahead = _kernels_ahead(folder)
        for run in range(_RUNS):
            for what, value in _one_round(folder / str(run), ahead).items():
                found.setdefault(what, []).append(value)
        step("first answers: kernels compiled for a level beside native ones")
        found |= _level_speed(folder, ahead)
    units = {"cpu": "CPU s", "wall": "s", "ratio": "times"}
    rows = {
        name: {"unit": units[name.rpartition("_")[2]], "values": values, "median": statistics.median(values)}
        for name, values in found.items()
    }
    return {"level": level, "rows": rows}


def _one_round(cache: Path, ahead: Path) -> dict[str, float]:
    """Each first result once, with an empty cache for the cold ones."""
    render = [sys.executable, "-P", "-m", "renderer", "render", str(SCENES / "three_models.toml"), "-o",
              f"{cache}.png", "--resolution", "512x512", "--quiet"]  # fmt: skip
    hit, single = child.command(_FIRST_HIT, _FLOAT64), child.command(_FIRST_HIT, _FLOAT32)
    cold = _spend(hit, NUMBA_CACHE_DIR=f"{cache}/hit")
    again, other = _spend(hit, NUMBA_CACHE_DIR=f"{cache}/hit"), _spend(single, NUMBA_CACHE_DIR=f"{cache}/hit")
    picture = _spend(render, NUMBA_CACHE_DIR=f"{cache}/picture")
    named = {AHEAD_VARIABLE: str(ahead)}
    return {
        "first_hit_cpu": cold.cpu,
        "first_hit_again_cpu": again.cpu,
        "first_float32_hit_after_it_cpu": max(0.0, other.cpu - again.cpu),
        "first_picture_wall": picture.wall,
        "first_picture_cpu": picture.cpu,
        "first_hit_ahead_cpu": _spend(hit, NUMBA_CACHE_DIR=f"{cache}/none1", **named).cpu,
        "first_picture_ahead_wall": _spend(render, NUMBA_CACHE_DIR=f"{cache}/none2", **named).wall,
    }


def _spend(command: list[str], **more: str) -> Spent:
    """Run a process as our child, so that the system counts it and its children."""
    import resource  # POSIX only, as ``measure`` asks

    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = child.environment(OCTREE_RENDERER_QUIET="1", **_WITH_BYTECODE, **more)
    subprocess.run(command, env=environment, capture_output=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    wall = time.perf_counter() - began
    return Spent(wall, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)


def _kernels_ahead(folder: Path) -> tuple[str, Path]:
    """The level for which kernels are compiled ahead, and a folder of all kernels for it."""
    from renderer.jit.cache import runnable_levels

    levels = runnable_levels()
    # Most machines of today have x86-64-v3; without it, the best level that this machine runs.
    level = "x86-64-v3" if "x86-64-v3" in levels else levels[0]
    ahead = folder / "ahead"
    command = [sys.executable, "-P", "-m", "renderer", "compile", "--level", level, "-o", str(ahead), "--quiet"]
    subprocess.run(command, env=child.environment(), capture_output=True, check=True)
    return level, ahead


def _level_speed(folder: Path, ahead: Path) -> dict[str, list[float]]:
    """Ratio of seconds, native kernels over those for the level, in turn, with equal hits; 1 means equal speed."""
    command, rounds = child.command(f"{_HERE}:trace"), []
    places = {"native": {"NUMBA_CACHE_DIR": f"{folder}/native"},
              "level": {"NUMBA_CACHE_DIR": f"{folder}/empty", AHEAD_VARIABLE: str(ahead)}}  # fmt: skip
    for _ in range(_RUNS):
        said = {}
        for name, more in places.items():
            environment = child.environment(OCTREE_RENDERER_QUIET="1", **more)
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
            said[name] = json.loads(done.stdout.splitlines()[-1])
        if said["native"]["digest"] != said["level"]["digest"]:
            raise ValueError("kernels compiled for a level answer other bits than native ones")
        rounds.append(said)
    return {
        f"level_speed_{family}_ratio": [r["native"][family] / r["level"][family] for r in rounds]
        for family in ("camera", "random")
    }


def trace() -> None:
    """In its own process: print the seconds of camera and of random rays, and a digest of their hits."""
    import hashlib

    import numpy as np

    from renderer import Octree
    from validation.benchmark.measures.families import families
    from validation.benchmark.measures.meshes import displaced_spheres
    from validation.timing import RUNS, median_seconds, timed

    octree, digest, found = Octree.from_mesh(displaced_spheres(100_000)), hashlib.sha256(), {}
    for family in families(octree, 200_000):
        if family.name in ("camera", "random"):
            ask = timed(octree.closest_hit, family.origins, family.directions)
            found[family.name] = median_seconds({"": ask}, RUNS)[""]
            hits = octree.closest_hit(family.origins, family.directions)
            digest.update(np.concatenate([hits.t, hits.face, hits.u, hits.v]).tobytes())
    print(json.dumps(found | {"digest": digest.hexdigest()}))
