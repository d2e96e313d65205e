"""Seeded defects: each is injected into its own process, where at least one gate must fail.

First the sound renderer runs the same way, and no gate may fail. Each defect starts from its compiled kernels, in a
separate folder, so this checkout's kernels stay unchanged.
"""

import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from renderer.system import child
from validation.defects.answer import MARK
from validation.defects.answers import HANGS, Answer, Known, together
from validation.defects.record import gates, idle, record
from validation.defects.seeded.defect import Defect
from validation.gates import Gate

# Seconds of computing, ten times those of the slowest defect: beyond them a kernel does not terminate.
_PATIENCE = 600
# Seconds by the clock, on a machine on which ten others compute too.
_LONGEST = 10.0 * _PATIENCE
# The signal that ends a process whose seconds of computing are spent: SIGXCPU, or where there is none SIGKILL.
_OUT_OF_TIME = getattr(signal, "SIGXCPU", 9)
# Each process compiles on one core.
_AT_ONCE = 2


class Modules(NamedTuple):
    """The modules that have the defects, ``DEFECTS``, and the checks that judge them, ``run(group)``."""

    defects: str = "validation.defects.list"
    checks: str = "validation.defects.checks"


OURS = Modules()


def chosen(quick: bool, modules: Modules = OURS) -> list[Defect]:
    """All defects, or the ``quick`` ones, for which no kernel is compiled."""
    return [defect for defect in import_module(modules.defects).DEFECTS if not (quick and defect.compiles)]


def run(
    defects: Sequence[Defect], step: Callable[[str], None], modules: Modules = OURS, known: Known | None = None
) -> tuple[dict[str, Any], list[Gate]]:
    """Inject every defect whose answer is not ``known``; returns a record for JSON and the gates.

    One gate requires that no gate fails for the sound renderer, and one for each defect that some gate fails. A run of
    the whole list has one more, ``idle``. Raises ``ChildProcessError`` where the checks end with an error without any
    defect.
    """
    known = Known() if known is None else known
    groups = sorted({defect.group for defect in defects})
    with TemporaryDirectory(prefix="defects-") as folder, ThreadPoolExecutor(_AT_ONCE) as pool:
        sound, broken = Path(folder) / "sound", Path(folder) / "broken"
        step("defects: none, as the control")
        control = together(list(pool.map(lambda group: run_checks(None, group, sound, modules), groups)))
        if control.error is not None:
            raise ChildProcessError(f"defects: the checks of the sound renderer end with {control.error}")

        def answer(numbered: tuple[int, Defect]) -> Answer:
            number, defect = numbered
            step(f"defects: {defect.name}")
            if defect.name in known.answers:
                return known.answers[defect.name]
            # Kernels are written to new files, so links serve as copies.
            cache = Path(shutil.copytree(sound, broken / str(number), copy_function=os.link))
            try:
                found = run_checks(defect.name, defect.group, cache, modules)
            finally:
                shutil.rmtree(cache, ignore_errors=True)
            known.add(defect.name, found)
            return found

        answers = list(pool.map(answer, enumerate(defects)))
    found, judged = record(defects, control, answers), gates(defects, control, answers)
    whole = modules == OURS and len(defects) == len(chosen(quick=False))
    return found, [*judged, idle(found)] if whole else judged


def run_checks(name: str | None, group: str, cache: Path, modules: Modules = OURS) -> Answer:
    """Run the checks of ``group`` in a new process with one defect, or none; its kernels go to ``cache``."""
    began = time.perf_counter()
    cache.mkdir(parents=True, exist_ok=True)
    command = child.command("validation.defects.answer:answer", json.dumps([name, *modules, group, _PATIENCE]))
    environment = child.environment(NUMBA_CACHE_DIR=str(cache))
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=_LONGEST, check=False)
        hangs = done.returncode == -_OUT_OF_TIME
    except subprocess.TimeoutExpired:
        hangs = True
    seconds = time.perf_counter() - began
    if hangs:
        # A kernel that runs for ever is noticed by whoever waits for the report.
        return Answer((), (HANGS,), None, seconds)
    said = [line for line in done.stdout.splitlines() if line.startswith(MARK)]
    if done.returncode or not said:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        return Answer((), (), last, seconds)
    found = json.loads(said[-1].removeprefix(MARK))
    return Answer(tuple(found["gates"]), tuple(found["red"]), None, seconds)
