"""Runs the suite on machines that are unkind to it: python tests/machines.py [NAME ...]; all of them without names.

Each is a run of pytest with other orders, loads, processors and surroundings:

  busy        two loops compute beside it; tests in random order
  background  one processor, SIGINT ignored
  sixteen     as many processors as it is told; another random order
  elsewhere   no UTF-8 by default, a time zone 14 hours ahead, no file for others, no kernels kept, an empty HOME

Prints a line each; exit 1 where one fails, 2 for a name that is none.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Machine:
    """What is other than usual.

    environment  variables; {new} in a value is an empty folder
    options      of pytest
    busy         processes that compute beside it
    before       called in pytest's process before it starts
    """

    environment: dict[str, str] = field(default_factory=dict)
    options: tuple[str, ...] = ()
    busy: int = 0
    before: Callable[[], object] | None = None


def _one_processor_in_background() -> None:
    # As a shell starts a job in the background.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def _private() -> None:
    os.umask(0o077)


MACHINES = {
    "busy": Machine({"SHUFFLED": "1"}, ("-p", "shuffled", "-n", "2"), busy=2),
    "background": Machine(options=("-n", "2"), before=_one_processor_in_background),
    "sixteen": Machine({"SHUFFLED": "2", "PROCESSORS": "16"}, ("-p", "shuffled", "-n", "4")),
    "elsewhere": Machine(
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "TZ": "Pacific/Kiritimati", "HOME": "{new}",
         "NUMBA_CACHE_DIR": "{new}"}, ("-n", "2"), before=_private,
    ),
}  # fmt: skip


def main(names: list[str]) -> int:
    """Run the suite on the named machines, or on all."""
    unknown = [name for name in names if name not in MACHINES]
    if unknown:
        print(f"machines: expected some of {', '.join(MACHINES)}, got {unknown[0]!r}", file=sys.stderr)
        return 2
    failed = 0
    for name in names or MACHINES:
        began = time.monotonic()
        code = _run(MACHINES[name])
        print(f"{name}: {'green' if code == 0 else f'exit code {code}'}, {time.monotonic() - began:.0f} s", flush=True)
        failed += code != 0
    return int(failed > 0)


def _run(machine: Machine) -> int:
    with tempfile.TemporaryDirectory(prefix="machine-") as folder, _busy(machine.busy):
        made = {name: value.replace("{new}", _made(folder, name)) for name, value in machine.environment.items()}
        own = {**os.environ, "PYTHONPATH": str(ROOT / "tests"), **made}
        command = [sys.executable, "-m", "pytest", "--dist", "worksteal", *machine.options]
        return subprocess.run(command, cwd=ROOT, env=own, preexec_fn=machine.before, check=False).returncode


def _made(folder: str, name: str) -> str:
    path = Path(folder, name)
    path.mkdir()
    return str(path)


@contextmanager
def _busy(count: int) -> Iterator[None]:
    """While some processes do nothing but compute."""
    # A loop ends with this process too, however that ends.
    code = "import os\nparent = os.getppid()\nwhile os.getppid() == parent: pass"
    loops = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


if __name__ == "__main__":
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)  # as Ctrl-C, which ends the tests too
    sys.exit(main(sys.argv[1:]))
