"""The garbage collector rests while many objects are made that stay: modules, and what Numba knows of kernels.

Looking for cycles among them takes a tenth of the time until a process has its first hit, a fifth of that of a command
that renders a small picture, and 6 % of compiling.
"""

import atexit
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager


class _Rest:
    """The thresholds of before the rest under way, none if there is none."""

    before: tuple[int, ...] = ()


@contextmanager
def resting() -> Iterator[None]:
    """A context without garbage collection; what was made in it is old afterwards, so that no collection looks at it
    soon.

    By its threshold: ``gc.disable`` of another thread holds then, also after the context.
    """
    before = gc.get_threshold()
    if before[0] == 0 or not gc.isenabled():
        yield
        return
    try:
        _Rest.before = before
        gc.set_threshold(0)
        yield
    finally:
        try:
            _make_old()
        finally:
            gc.set_threshold(*before)
            _Rest.before = ()


def _wake() -> None:
    """End the rest in a forked child, where no other thread does."""
    if _Rest.before:
        gc.set_threshold(*_Rest.before)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_wake)


def spare_at_exit() -> None:
    """Let this process end without a last collection; only for processes of our own, which leave no file open."""
    atexit.register(gc.freeze)


def _make_old() -> None:
    """Move all objects to the garbage collector's oldest generation, unless somebody has frozen some."""
    if gc.get_freeze_count() == 0:
        try:
            gc.freeze()
        finally:
            gc.unfreeze()
