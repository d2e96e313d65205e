"""The one decorator that makes a kernel, a log line when it is compiled, and a disk cache that no edit leaves stale."""

import hashlib
import logging
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import numba
from numba.core import event, types
from numba.core.caching import IndexDataCacheFile

_PACKAGE = Path(__file__).parent
_IMPORT = re.compile(r"^from renderer\.(\w+) import", re.MULTILINE)
_LOG = logging.getLogger(__name__)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` as a kernel: no GIL, no fastmath, C's rules for division, cached on disk.

    Numba stamps a cached kernel with the file that defines it only, so an edited callee or constant would leave
    a stale kernel behind. The stamp is replaced by a digest of every source that the kernel's module imports.

    It may decorate kernels of other packages that call ours; their digest is that of their own file and of all of
    ours, but not of other files that they import. A plain ``numba.njit(cache=True)`` on top of ours has no such
    protection: delete its cache after an update of this package.
    """
    return _compiled(function, forceinline=False)


def inlined(function: Callable[..., Any]) -> Any:
    """A kernel that LLVM must inline: for the tests of the innermost loop, whose vectors would go through memory."""
    return _compiled(function, forceinline=True)


def _compiled(function: Callable[..., Any], forceinline: bool) -> Any:
    # Nobody calls a kernel through a C function pointer; its wrapper would take a tenth of all compiling.
    dispatcher = numba.njit(nogil=True, error_model="numpy", forceinline=forceinline, no_cfunc_wrapper=True)(function)
    # With NUMBA_DISABLE_JIT there is no dispatcher and no cache.
    if dispatcher is not function:
        _see_no_literals(dispatcher)
        try:
            dispatcher.enable_caching()
        except RuntimeError:  # no folder can be written, neither ours nor the user's: compile in each process
            return dispatcher
        stored = dispatcher._cache
        digest = source_digest(Path(function.__code__.co_filename))
        stored._cache_file = _CacheFile(stored.cache_path, stored._impl.filename_base, digest)
    return dispatcher


def _see_no_literals(dispatcher: Any) -> None:
    """Let a kernel be compiled once for all constants: Numba would once for each that a caller writes as a literal."""
    template = dispatcher.get_call_template

    def plain(arguments: Any, keywords: Any) -> Any:
        return template([types.unliteral(a) for a in arguments], {k: types.unliteral(v) for k, v in keywords.items()})

    dispatcher.get_call_template = plain


def is_on_disk(dispatcher: Any) -> bool:
    """Whether some version of a kernel is in the cache, so that another process need not compile it.

    True, too, where nothing can be cached: then no process can help another.
    """
    files = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    return files is None or bool(files._load_index())


class _CacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """The files of one kernel, with the digest in the names of those that hold code.

    Numba numbers them, and writes the index before the code. Killed between the two, or with a process of older
    sources writing at the same time, a fresh index would point to old code for good.
    """

    def __init__(self, folder: str, base: str, digest: str) -> None:
        super().__init__(folder, base, digest)
        self._base, self._current = base, f"{base}.{digest[:16]}."
        self._data_name_pattern = self._current + "{number:d}.nbc"

    def _save_index(self, overloads: dict[Any, str]) -> None:
        super()._save_index(overloads)
        # Remove what older sources left: an edit of a low module would else leave megabytes each time.
        for path in Path(self._cache_path).iterdir():
            name = path.name
            if name.startswith(f"{self._base}.") and name.endswith(".nbc") and not name.startswith(self._current):
                path.unlink(missing_ok=True)


@cache
def source_digest(path: Path) -> str:
    """Hex digest of a source file, of all it imports from this package, directly or not, and of the compiler.

    For a file outside the package's own folder: of that file and of the whole package.
    """
    seen: set[Path] = set()
    pending = [path] if path.parent == _PACKAGE else [path, *_PACKAGE.rglob("*.py")]
    while pending:
        found = pending.pop()
        if found not in seen and found.exists():
            seen.add(found)
            pending += _imports(found)
    digest = hashlib.sha256(f"numba {numba.__version__} llvmlite {llvmlite.__version__}\0".encode())
    for found in sorted(seen):
        digest.update(found.name.encode() + b"\0" + _source(found) + b"\0")
    return digest.hexdigest()


@cache
def _source(path: Path) -> bytes:
    return path.read_bytes()


@cache
def _imports(path: Path) -> list[Path]:
    return [_PACKAGE / f"{name}.py" for name in _IMPORT.findall(_source(path).decode())]


class _Announcer(event.Listener):  # type: ignore[misc]
    """Logs each kernel that Numba compiles rather than loads; those compiled on its behalf go unmentioned."""

    def __init__(self) -> None:
        self._depth = 0  # Numba compiles under a lock of the whole process, so this needs none

    def on_start(self, event: Any) -> None:
        dispatcher = event.data["dispatcher"]
        if self._depth == 0 and dispatcher.py_func.__module__.startswith("renderer."):
            folder = dispatcher._cache.cache_path
            kept = f"once, kept in {folder}" if folder else "for this process only: no cache folder can be written"
            _LOG.info("compiling %s (%s)", dispatcher.py_func.__qualname__, kept)
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth -= 1


event.register("numba:compile", _Announcer())
