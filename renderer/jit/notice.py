"""Messages about compiling and its time: one line on standard error, each kernel at level INFO.

The line comes from the logger ``renderer.jit`` at level WARNING, which Python prints if logging is not configured;
``logging.getLogger("renderer").setLevel("ERROR")`` or the environment variable OCTREE_RENDERER_QUIET=1 turns it off.
"""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from logging import getLogger

from renderer.collector import resting

QUIET_VARIABLE = "OCTREE_RENDERER_QUIET"
_LOG = getLogger("renderer.jit")


class _Clock:
    """Kernels that this process has compiled, those that it is compiling, one within another, and seconds.

    Numba compiles under one lock, so all that it is compiling is for one kernel.
    """

    kernels = 0
    under_way = 0
    seconds = 0.0


def compile_seconds() -> float:
    """Seconds that this process has spent compiling kernels so far; loading them does not count."""
    return _Clock.seconds


class Stopwatch:
    """Seconds since it was created, without those that this process spent compiling, on any thread."""

    def __init__(self) -> None:
        self._began = time.perf_counter() - compile_seconds()

    def seconds(self) -> float:
        """Seconds so far."""
        return time.perf_counter() - compile_seconds() - self._began


_said: set[str] = set()


def warn_once(kind: str, message: str) -> None:
    """Log the first message of each kind: if one kernel has a fault, most have it."""
    if kind not in _said:
        _said.add(kind)
        _LOG.warning(message)


@contextmanager
def compiling(name: str, folder: str | None) -> Iterator[None]:
    """A context for compiling one kernel: logs it, and adds its time to ``compile_seconds``."""
    kept = f"once, kept in {folder}" if folder else "for this process only: no cache folder can be written"
    if _Clock.kernels == 0 and os.environ.get(QUIET_VARIABLE, "0") in ("", "0"):
        _LOG.warning("renderer: compiling kernels, which can take a minute (%s)", kept)
    _LOG.info("compiling %s (%s)", name, kept)
    _Clock.kernels += 1
    _Clock.under_way += 1
    began = time.perf_counter()
    try:
        with resting():
            yield
    finally:
        _Clock.under_way -= 1
        if _Clock.under_way == 0:
            _Clock.seconds += time.perf_counter() - began
