"""A run in which our kernels are limited to AVX2, on a processor that has more. The others keep what it has."""

import os
import subprocess
import sys
from collections.abc import Sequence

from renderer.jit.levels import FEATURES, LEVELS
from renderer.system import child

# Set in the process of such a run, to the level.
VARIABLE = "OCTREE_BENCHMARK_LIMITED"
_LEVEL = "x86-64-v3"


def limited() -> str | None:
    """The level to which our kernels are limited; None for what the processor has."""
    return os.environ.get(VARIABLE)


def run_limited(arguments: Sequence[str]) -> int:
    """Run the benchmark with these arguments in a process of its own that is limited; returns its exit code."""
    features = ",".join(f"+{feature}" for feature in FEATURES[_LEVEL])
    settings = {"NUMBA_CPU_NAME": LEVELS[_LEVEL], "NUMBA_CPU_FEATURES": features, VARIABLE: _LEVEL}
    command = [sys.executable, "-P", "-m", "validation.benchmark", *arguments]
    return subprocess.run(command, env=child.environment(**settings), check=False).returncode
