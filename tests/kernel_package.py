"""A small package beside the compiler's own modules, for tests that edit kernels' sources and run them anew."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "renderer"
_NEEDED = (
    "__init__.py*", "collector.py", "lazy*.py", "jit/*.py", "numerics/*.py", "system/__init__.py", "system/files.py"
)  # fmt: skip

# One small kernel two imports away from the constant it uses, so that each run compiles in a second.
UPPER = """
from renderer.jit.decorators import kernel
from renderer.middle import (
    doubled,
)
@kernel
def answer(x):
    return doubled(x) + 1
"""
MIDDLE = """
from renderer.jit.decorators import kernel
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


def write_package(parent: Path, **more: str) -> Path:
    """Write it as ``renderer`` into ``parent``, and more modules by their names; the constant is two folders down."""
    folder = parent / "renderer"
    (folder / "below" / "deep").mkdir(parents=True)
    for source in (path for pattern in _NEEDED for path in PACKAGE.glob(pattern)):
        target = folder / source.relative_to(PACKAGE)
        target.parent.mkdir(exist_ok=True)
        shutil.copy(source, target)
    for package in (folder / "below", folder / "below" / "deep"):
        (package / "__init__.py").touch()
    for name, text in {"upper": UPPER, "middle": MIDDLE, **more}.items():
        (folder / f"{name}.py").write_text(text)
    for name in ("bottom", "aside"):
        (folder / "below" / "deep" / f"{name}.py").write_text("STEP = 10\n")
    return folder


def bottom_of(folder: Path) -> Path:
    """The file of the constant."""
    return folder / "below" / "deep" / "bottom.py"


# A process that has imported Numba and compiled once, most of a small run's time, and forks for each script: a line
# of JSON says what to run, and the exit code is the answer. Nothing of ours is imported before the fork.
_SERVER = """
import json, os, sys, types
import numba
numba.njit(lambda x: x + 1)(1)
assert not any(name.split(".")[0] == "renderer" for name in sys.modules)
for line in sys.stdin:
    asked = json.loads(line)
    child = os.fork()
    if child:
        status = os.waitpid(child, 0)[1]
        print(os.waitstatus_to_exitcode(status), flush=True)
        continue
    for number, name in enumerate((os.devnull, asked["out"], asked["err"])):
        file = os.open(name, os.O_RDWR | os.O_CREAT)
        os.dup2(file, number)
        os.close(file)
    os.environ.clear()
    os.environ.update(asked["environment"])
    os.chdir(asked["folder"])
    sys.path[:0] = asked["environment"]["PYTHONPATH"].split(os.pathsep)
    numba.config.reload_config()
    main = sys.modules["__main__"] = types.ModuleType("__main__")
    exec(compile(asked["script"], "<string>", "exec"), vars(main))
    break
"""
# What Numba reads before that: a script with other values needs a process that is not forked.
_EARLY = ("NUMBA_DISABLE_JIT", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")


@cache
def _server(process: int) -> "subprocess.Popen[str]":
    """The forking process of the process that runs the tests; it ends with it, at the end of its input."""
    own = {**os.environ, "PYTHONPATH": ""}
    command = [sys.executable, "-B", "-P", "-c", _SERVER]
    return subprocess.Popen(command, env=own, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def run(folder: Path, script: str = RUN, **environment: str) -> list[str]:
    """The words that a script prints in a process of its own beside the package."""
    return start(folder, script, **environment).stdout.split()


def start(folder: Path, script: str = RUN, **environment: str) -> "subprocess.CompletedProcess[str]":
    """Run a script in a process of its own, where the package is found, with no cache folder but what is named.

    Where there is ``fork``, it is forked from a process that has imported Numba, unless its environment forbids that.
    """
    own = {**os.environ, "NUMBA_CACHE_DIR": "", "PYTHONPATH": str(folder.parent), **environment}
    if hasattr(os, "fork") and not any(name in environment for name in _EARLY):
        done = _forked(folder.parent, script, own)
    else:
        command = [sys.executable, "-B", "-P", "-c", script]
        done = subprocess.run(command, cwd=folder.parent, env=own, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"ended with {done.returncode}: {done.stderr}"
    return done


def _forked(folder: Path, script: str, environment: dict[str, str]) -> "subprocess.CompletedProcess[str]":
    server = _server(os.getpid())
    assert server.stdin is not None and server.stdout is not None
    with tempfile.TemporaryDirectory() as place:
        out, err = Path(place, "out"), Path(place, "err")
        asked = {"folder": str(folder), "script": script, "environment": environment, "out": str(out), "err": str(err)}
        server.stdin.write(json.dumps(asked) + "\n")
        server.stdin.flush()
        code = int(server.stdout.readline())
        return subprocess.CompletedProcess(
            script, code, out.read_text(encoding="utf-8"), err.read_text(encoding="utf-8")
        )
