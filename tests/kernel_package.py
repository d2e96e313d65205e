"""A small package beside the compiler's own modules, for tests that edit kernels' sources and run them anew."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "renderer"
_NEEDED = ("__init__.py", "kernels/*.py", "process/__init__.py", "process/files.py")

# One small kernel two imports away from the constant it uses, so that each run compiles in a second.
UPPER = """
from renderer.kernels.jit import kernel
from renderer.middle import (
    doubled,
)
@kernel
def answer(x):
    return doubled(x) + 1
"""
MIDDLE = """
from renderer.kernels.jit import kernel
from renderer.below.deep.bottom import STEP
@kernel
def doubled(x):
    return 2 * x + STEP
"""
RUN = """
from renderer.upper import answer
print(answer(3), sum(answer.entry.stats.cache_hits.values()), sum(answer.entry.stats.cache_misses.values()))
"""
# What RUN prints: the answer, kernels loaded, kernels compiled.
COMPILED, LOADED = ["17", "0", "1"], ["17", "1", "0"]


def write_package(parent: Path) -> Path:
    """Write it as ``renderer`` into ``parent``; the constant is two folders down."""
    folder = parent / "renderer"
    (folder / "below" / "deep").mkdir(parents=True)
    for source in (path for pattern in _NEEDED for path in PACKAGE.glob(pattern)):
        target = folder / source.relative_to(PACKAGE)
        target.parent.mkdir(exist_ok=True)
        shutil.copy(source, target)
    for package in (folder / "below", folder / "below" / "deep"):
        (package / "__init__.py").touch()
    (folder / "upper.py").write_text(UPPER)
    (folder / "middle.py").write_text(MIDDLE)
    for name in ("bottom", "aside"):
        (folder / "below" / "deep" / f"{name}.py").write_text("STEP = 10\n")
    return folder


def bottom_of(folder: Path) -> Path:
    """The file of the constant."""
    return folder / "below" / "deep" / "bottom.py"


def run(folder: Path, script: str = RUN, **environment: str) -> list[str]:
    """The words that a script prints in a process of its own beside the package."""
    return start(folder, script, **environment).stdout.split()


def start(folder: Path, script: str = RUN, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a script in a process of its own, where the package is found, with no cache folder but what is named."""
    own = {**os.environ, "NUMBA_CACHE_DIR": "", "PYTHONPATH": str(folder.parent), **environment}
    command = [sys.executable, "-B", "-P", "-c", script]
    done = subprocess.run(command, cwd=folder.parent, env=own, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done
