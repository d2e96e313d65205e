"""The one decorator that makes a kernel, and a disk cache that an edit anywhere below a kernel invalidates."""

import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit

_PACKAGE = Path(__file__).parent
_IMPORT = re.compile(r"^from renderer\.(\w+) import", re.MULTILINE)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` as a kernel: no GIL, no fastmath, C's rules for division, cached on disk.

    Numba stamps a cached kernel with the file that defines it only, so an edited callee or constant would leave
    a stale kernel behind. The stamp is replaced by a digest of every source that the kernel's module imports.
    """
    return _compiled(function, forceinline=False)


def inlined(function: Callable[..., Any]) -> Any:
    """A kernel that LLVM must inline: for the tests of the innermost loop, whose vectors would go through memory."""
    return _compiled(function, forceinline=True)


def _compiled(function: Callable[..., Any], forceinline: bool) -> Any:
    dispatcher = njit(nogil=True, cache=True, error_model="numpy", forceinline=forceinline)(function)
    module = Path(function.__code__.co_filename)
    # With NUMBA_DISABLE_JIT there is no dispatcher and no cache.
    if module.parent == _PACKAGE and hasattr(dispatcher, "_cache"):
        dispatcher._cache._cache_file._source_stamp = source_digest(module.stem)
    return dispatcher


@cache
def source_digest(module: str) -> str:
    """Hex digest of ``renderer/<module>.py`` and of all it imports from the package, directly or not."""
    sources: dict[str, bytes] = {}
    pending = [module]
    while pending:
        name = pending.pop()
        path = _PACKAGE / f"{name}.py"
        if name not in sources and path.exists():
            sources[name] = path.read_bytes()
            pending += _IMPORT.findall(sources[name].decode())
    digest = hashlib.sha256()
    for name in sorted(sources):
        digest.update(name.encode() + b"\0" + sources[name] + b"\0")
    return digest.hexdigest()
