"""Whole processes, from command to exit: a picture with compiled kernels, and imports."""

import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from typing import Any

from renderer.system import child
from validation.scenes import SCENES
from validation.timing import interleaved, timed

_RUNS = 3
WARM, IMPORT = "render_warm", "import_renderer"


def measure(llvm: bool, installed: set[str], step: Callable[[str], None]) -> dict[str, Any]:
    """By name: the command and its seconds, of three runs in turn after one untimed."""
    step("processes")
    with tempfile.TemporaryDirectory() as folder:
        render = ["-m", "renderer", "render", str(SCENES / "three_models.toml"), "-o", f"{folder}/out.png",
                  "--resolution", "512x512", "--quiet"]  # fmt: skip
        commands = {"python": ["-c", "pass"], IMPORT: ["-c", "import renderer"], WARM: render}
        if "embree" in installed:
            commands["import_embreex"] = ["-c", "import embreex.mesh_construction"]
        if "open3d" in installed:
            commands["import_open3d"] = ["-c", "import open3d"]
        variants = (["scalar_rgb"] if "mitsuba_scalar" in installed else []) + (["llvm_ad_rgb"] if llvm else [])
        for variant in variants:
            commands[f"import_mitsuba_{variant}"] = ["-c", f"import mitsuba; mitsuba.set_variant({variant!r})"]
        seconds = interleaved({name: timed(_run, arguments) for name, arguments in commands.items()}, _RUNS)
        shown = {name: " ".join(["python", *(a.replace(folder, ".") for a in c)]) for name, c in commands.items()}
    return {n: {"command": shown[n], "seconds": s, "median": statistics.median(s)} for n, s in seconds.items()}


def _run(arguments: list[str]) -> None:
    subprocess.run([sys.executable, "-P", *arguments], env=child.environment(), capture_output=True, check=True)
