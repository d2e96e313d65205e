"""Locks of scenes that another thread never holds while the process forks."""

import os
from threading import Lock, RLock
from typing import Any
from weakref import WeakSet

# All locks, and one that is held while another is made or the process forks.
_locks: WeakSet[Any] = WeakSet()
_making = Lock()
_held: list[Any] = []


def new_lock() -> Any:
    """A reentrant lock. A forked child finds it free, and what it guards is whole."""
    lock = RLock()
    with _making:
        _locks.add(lock)
    return lock


def _hold() -> None:
    _making.acquire()
    for lock in list(_locks):
        lock.acquire()
        _held.append(lock)


def _free() -> None:
    while _held:
        _held.pop().release()
    _making.release()


if hasattr(os, "register_at_fork"):
    # What is registered last is held first: these before Numba's own lock, as by a thread that builds a scene and
    # compiles for that (``jit.compiler``).
    os.register_at_fork(before=_hold, after_in_parent=_free, after_in_child=_free)
