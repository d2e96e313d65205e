"""Whole processes, from the shell's command to its end: a picture warm and for the first time ever, and imports."""

import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from validation.cases import SCENES
from validation.tradeoff import interleaved, timed

_RUNS = 3
WARM, FIRST, IMPORT = "render_warm", "render_first_ever", "import_renderer"


def measure(llvm: bool, installed: set[str], step: Callable[[str], None]) -> dict[str, Any]:
    """By name: the command and its seconds. Warm ones run three times in turn, after once unseen; the first is one."""
    step("processes")
    with tempfile.TemporaryDirectory() as folder:
        render = ["-m", "renderer.cli", "render", str(SCENES / "three_models.toml"), "-o", f"{folder}/out.png",
                  "--resolution", "512x512", "--quiet"]  # fmt: skip
        commands = {"python": ["-c", "pass"], IMPORT: ["-c", "import renderer"], WARM: render}
        if "embree" in installed:
            commands["import_embreex"] = ["-c", "import embreex.mesh_construction"]
        if "open3d" in installed:
            commands["import_open3d"] = ["-c", "import open3d"]
        variants = (["scalar_rgb"] if "mitsuba_scalar" in installed else []) + (["llvm_ad_rgb"] if llvm else [])
        for variant in variants:
            commands[f"import_mitsuba_{variant}"] = ["-c", f"import mitsuba; mitsuba.set_variant({variant!r})"]
        seconds = interleaved({name: timed(_run, arguments, {}) for name, arguments in commands.items()}, _RUNS)
        step("processes: the first run ever")
        commands[FIRST] = render
        cache = Path(folder) / "empty"
        cache.mkdir()
        seconds[FIRST] = [timed(_run, render, {"NUMBA_CACHE_DIR": str(cache)})()]
        shown = {name: " ".join(["python", *(a.replace(folder, ".") for a in c)]) for name, c in commands.items()}
    return {n: {"command": shown[n], "seconds": s, "median": statistics.median(s)} for n, s in seconds.items()}


def _run(arguments: list[str], more: dict[str, str]) -> None:
    subprocess.run([sys.executable, *arguments], env=os.environ | more, capture_output=True, check=True)
