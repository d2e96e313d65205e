"""A copy of the checkout, with machine code of its own, in which one file at a time is broken.

The tests' own child processes get the fault too, which a fault injected into one process would not reach.
"""

import math
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from renderer.system import child
from validation.mutants.sites import Mutant, text_of

_FOLDERS = ("renderer", "validation", "tests", "scenes", "docs", ".ci", ".github")
_FILES = ("pyproject.toml", "Makefile", "README.md", "requirements.lock", "LICENSE", ".gitignore", "reports/README.md",
          "reports/baseline.json")  # fmt: skip


# The variable that names the folder where the plugin of pytest writes, a file for each process of the run.
TOUCHED = "TOUCHED_FOLDER"
# Bytes that a file of the broken copy may have, and bytes of what it prints that are read: an endless loop may print.
_LARGEST, _READ = 1 << 30, 1 << 20


@dataclass(frozen=True)
class Ended:
    """How a process ended: its exit code, None where it had to be killed; what it printed; its seconds."""

    code: int | None
    output: str
    seconds: float


class Workshop:
    """The copy in ``folder``, of the checkout in ``root``."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.root, self._folder = folder / "copy", folder
        for name in _FOLDERS:
            shutil.copytree(root / name, self.root / name, ignore=shutil.ignore_patterns("__pycache__", "compiled"))
        (self.root / "reports").mkdir()
        for name in _FILES:
            shutil.copy(root / name, self.root / name)
        self._cache, self._sound = folder / "cache", folder / "sound"
        self._cache.mkdir()
        self._running: subprocess.Popen[bytes] | None = None
        self._stopped = False

    def keep(self) -> None:
        """Keep the kernels compiled so far as those of the sound renderer."""
        shutil.rmtree(self._sound, ignore_errors=True)
        shutil.copytree(self._cache, self._sound)

    @contextmanager
    def broken(self, mutant: Mutant) -> Iterator[None]:
        """While the mutant's file is broken. Its kernels are forgotten afterwards."""
        path = self.root / mutant.file
        text = path.read_bytes()
        path.write_text(text_of(mutant, self.root), encoding="utf-8")
        try:
            yield
        finally:
            path.write_bytes(text)
            shutil.rmtree(self._cache)
            shutil.copytree(self._sound, self._cache)

    def call(self, target: str, *arguments: str, patience: float) -> Ended:
        """Call a function, such as "validation.mutants.answer:answer", with strings, in a new process."""
        program = str(self.root / "renderer" / "process" / "child.py")
        return self.run(["-P", program, target, *arguments], patience)

    def run(self, arguments: Sequence[str], patience: float, **environment: str) -> Ended:
        """Run Python with arguments in the copy, for at most ``patience`` seconds."""
        own = child.environment(
            PYTHONPATH=str(self.root),
            NUMBA_CACHE_DIR=str(self._cache),
            PYTHONDONTWRITEBYTECODE="1",  # bytecode is told from newer text by size and second alone
            TMPDIR=str(self._scratch()),
            **environment,
        )
        began = time.perf_counter()
        with open(self._folder / "output.txt", "w+b") as output:
            process = subprocess.Popen(
                [sys.executable, *arguments], cwd=self.root, env=own, stdin=subprocess.DEVNULL,
                stdout=output, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
            _limit(process, patience)
            self._running = process
            if self._stopped:
                _end_all(process)
            try:
                code: int | None = process.wait(patience)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                _end_all(process)
            output.seek(max(0, output.seek(0, os.SEEK_END) - _READ))
            text = output.read().decode(errors="replace")
        if self._stopped:
            raise ChildProcessError("mutants: a process was stopped")
        return Ended(code, text, time.perf_counter() - began)

    def stop(self) -> None:
        """End what runs here, from another thread; what would run next raises ``ChildProcessError``."""
        self._stopped = True
        if self._running is not None:
            _end_all(self._running)

    def _scratch(self) -> Path:
        """An empty folder for temporary files: a process that was killed leaves its own."""
        scratch = self._folder / "scratch"
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir()
        return scratch


def _limit(process: "subprocess.Popen[bytes]", patience: float) -> None:
    """Have the system end an endless loop too, and one that prints: nobody else would where this process is killed."""
    if hasattr(resource, "prlimit"):
        seconds = math.ceil(patience * (os.cpu_count() or 1))
        with suppress(ProcessLookupError):
            resource.prlimit(process.pid, resource.RLIMIT_CPU, (seconds, seconds + 1))
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (_LARGEST, _LARGEST))


def _end_all(process: "subprocess.Popen[bytes]") -> None:
    """End a process and its children."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
