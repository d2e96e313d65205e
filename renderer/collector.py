"""The garbage collector rests while many objects are made that stay: modules, and what Numba knows of kernels.

Looking for cycles among them takes a tenth of the time until a process has its first hit, a fifth of that of a command
that renders a small picture, and 6 % of compiling.
"""

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def resting() -> Iterator[None]:
    """A context without garbage collection; what was made in it is old afterwards, so that no collection looks at it
    soon.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            _make_old()
            gc.enable()


def spare_at_exit() -> None:
    """Let this process end without a last collection; only for processes of our own, which leave no file open."""
    atexit.register(gc.freeze)


def _make_old() -> None:
    """Move all objects to the garbage collector's oldest generation, unless somebody has frozen some."""
    if gc.get_freeze_count() == 0:
        gc.freeze()
        gc.unfreeze()
