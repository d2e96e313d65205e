"""A run limited to AVX2 on a processor that has more: our kernels by Numba's settings, Embree's by its own file."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from renderer.jit.levels import FEATURES, LEVELS
from renderer.system import child

# Set in the process of such a run, to the level.
VARIABLE = "OCTREE_BENCHMARK_LIMITED"
_LEVEL = "x86-64-v3"


def limited() -> str | None:
    """The level to which this run is limited; None for what the processor has."""
    return os.environ.get(VARIABLE)


def run_limited(arguments: Sequence[str]) -> int:
    """Run the benchmark with these arguments in a process of its own that is limited; returns its exit code."""
    with tempfile.TemporaryDirectory(prefix="limited-") as home:
        # Embree reads it in the home folder, also where Mitsuba and Open3D contain it.
        Path(home, ".embree4").write_text("isa=avx2\n", encoding="ascii")
        features = ",".join(f"+{feature}" for feature in FEATURES[_LEVEL])
        settings = {"NUMBA_CPU_NAME": LEVELS[_LEVEL], "NUMBA_CPU_FEATURES": features, VARIABLE: _LEVEL, "HOME": home}
        command = [sys.executable, "-P", "-m", "validation.benchmark", *arguments]
        return subprocess.run(command, env=child.environment(**settings), check=False).returncode
