"""Run inputs of all kinds, count what came of them, and tell and keep what is wrong."""

import argparse
import faulthandler
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

import fuzz
from fuzz import faults, files, rays, scenes
from fuzz.values import SECONDS, Kind
from renderer.mesh.ply import format_ply
from renderer.mesh.shapes import box

KINDS: dict[str, Kind] = {**files.KINDS, **scenes.KINDS, **rays.KINDS, **faults.KINDS}


def prepare(folder: Path) -> None:
    """Put beside the inputs what they refer to, and compile the kernels before a clock starts."""
    files.prepare(folder)
    for kinds in (scenes, rays, faults):
        kinds.prepare_kinds()
    (folder / "box.ply").write_bytes(format_ply(box()))


class Log:
    """What came of the inputs."""

    def __init__(self, keep: Path | None) -> None:
        self._keep = keep
        self.outcomes: dict[str, Counter[str]] = {}
        self.findings: Counter[str] = Counter()
        self.slowest = (0.0, "")

    def count(self, name: str, outcome: str) -> None:
        self.outcomes.setdefault(name, Counter())[outcome] += 1

    def find(self, name: str, index: int, given: Any, error: Exception) -> None:
        """Count a finding, and tell and keep the first of its place."""
        self.count(name, "WRONG")
        finding = f"{name}: {_place(error)}"
        self.findings[finding] += 1
        if self.findings[finding] > 1:
            return
        print(f"input {index} of {finding}: {str(error)[:300]!r}", flush=True)
        if self._keep:
            self._keep.mkdir(parents=True, exist_ok=True)
            text = isinstance(given, bytes)
            path = self._keep / (f"{index}.{name}" if text else f"{index}.{name}.txt")
            path.write_bytes(given if text else f"{given!r}\n".encode("utf-8", "backslashreplace"))

    def print(self, done: int, seconds: float) -> None:
        """Kinds, then findings."""
        for name, outcomes in self.outcomes.items():
            print(f"{name:12} {', '.join(f'{count} {outcome}' for outcome, count in sorted(outcomes.items()))}")
        slow, where = self.slowest
        print(f"{done} inputs in {seconds:.0f} s, slowest {slow:.2f} s ({where}); {len(self.findings)} findings")
        for finding, times in self.findings.most_common():
            print(f"  {times} x {finding}")


def _place(error: BaseException) -> str:
    """What went wrong and where: findings alike are one."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__} in {Path(frame.filename).name}:{frame.lineno} {frame.name}"


def judge(name: str, folder: Path, seed: int, index: int, log: Log) -> None:
    """Make one input, check it and log what came."""
    kind = KINDS[name]
    given = kind.make(seed, index)
    # The alarm waits for a kernel's end; this one does not.
    faulthandler.dump_traceback_later(20 * SECONDS, exit=True)
    start = time.perf_counter()
    try:
        log.count(name, kind.judge(folder, given, index))
    except Exception as error:
        log.find(name, index, given, error)
    seconds = time.perf_counter() - start
    log.slowest = max(log.slowest, (seconds, f"input {index} of {name}"))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="tests/fuzz", description=fuzz.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--first", type=int, default=0, help="the number of the first input")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--keep", type=Path, help="a folder for the first input of each finding")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after this long")
    return parser.parse_args()


def main() -> int:
    given = _arguments()
    turns = [name for name in given.kinds for _ in range(KINDS[name].share)]
    log = Log(given.keep)
    with tempfile.TemporaryDirectory() as name_of_folder:
        folder = Path(name_of_folder)
        prepare(folder)
        began, done = time.perf_counter(), 0
        for index in range(given.first, given.first + given.inputs):
            judge(turns[index % len(turns)], folder, given.seed, index, log)
            done += 1
            if time.perf_counter() - began > given.seconds:
                break
    faulthandler.cancel_dump_traceback_later()
    log.print(done, time.perf_counter() - began)
    return 1 if log.findings else 0
