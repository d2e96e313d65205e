"""Processes that need the same kernel at once: one compiles it, the others wait and read what it wrote."""

import hashlib
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

try:
    import fcntl
except ImportError:  # on Windows
    fcntl = None  # type: ignore[assignment]

# One file for all kernels of a folder: each has a byte of it, by the hash of its name.
_FILE = "compiling.lock"
# Seconds: no kernel compiles so long. A process that was stopped meanwhile holds the others up no longer.
_LONGEST = 300.0
_STEP = 0.05


class _Patience:
    """Whether this process waits for others."""

    left = True


def wait_no_more() -> None:
    """From now on this process waits for no other."""
    _Patience.left = False


@contextmanager
def turn(folder: Path | None, name: str) -> Iterator[bool]:
    """Hold the byte of a name in a folder; yields whether another process held it first.

    The system frees it when its process ends. In a folder where nothing can be locked, and in no folder, nobody waits.
    """
    file = -1 if folder is None or fcntl is None or not _Patience.left else _opened(folder)
    if file < 0:
        yield False
        return
    byte = _byte(name)
    waited = _take(file, byte)
    try:
        yield waited
    finally:
        with suppress(OSError):
            fcntl.lockf(file, fcntl.LOCK_UN, 1, byte)


@cache
def _opened(folder: Path) -> int:
    """The file of a folder, -1 if there can be none. It stays open: to close it would free all bytes of the process."""
    try:
        return os.open(folder / _FILE, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError:
        return -1


def _byte(name: str) -> int:
    return int(hashlib.sha256(name.encode()).hexdigest()[:15], 16)


def _take(file: int, byte: int) -> bool:
    """Wait for a byte and lock it; whether somebody else had it."""
    end = time.monotonic() + _LONGEST
    waited = False
    while time.monotonic() < end:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, byte)
        except (BlockingIOError, PermissionError):
            waited = True
            time.sleep(_STEP)
        except OSError:
            break
        else:
            break
    return waited
