"""Compiled kernels on disk: one file for each kernel, argument types, sources, Python, Numba and processor.

Files are found by name, without an index. An unreadable file counts as absent, and a kernel that cannot be written is
compiled in each process; neither stops a run. A folder compiled ahead (``octree-render compile -o FOLDER``) is only
read, after the user's own.
"""

import hashlib
import os
import pickle
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from stat import S_ISREG
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import llvmlite.binding as llvm  # type: ignore[import-untyped]
import numba
from numba.core import config
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from renderer.collector import resting
from renderer.jit.digest import PACKAGE, is_ours
from renderer.jit.levels import AHEAD_VARIABLE, LEVELS, lacking
from renderer.jit.notice import warn_once
from renderer.jit.origin import digest_of, digests_of, values_of
from renderer.jit.turns import turn, wait_no_more
from renderer.lazy import lazy
from renderer.system.files import write_atomically

# The kernels that a wheel for one platform contains.
_CARRIED = PACKAGE / "compiled"
_SUFFIX = ".kernel"
_HEADER = b"octree-renderer kernel 1\n"
# To be changed when older files are no longer right, for a reason that no digest of kernels' sources shows.
_FORM = "origins in the key"


@dataclass(frozen=True)
class Folders:
    """The folders for kernels of one source folder: ``written`` (None if nothing can be written), and all that are
    read.
    """

    written: Path | None
    read: tuple[Path, ...]


class KernelStore:
    """The files of one kernel, with the interface that Numba's dispatchers expect of a cache."""

    suffix = _SUFFIX

    def __init__(self, function: Any) -> None:
        self._function = function
        self._source = Path(function.__code__.co_filename)
        # All kernels of this package share a folder, so their names begin with the whole name of the module.
        ours = is_ours(self._source)
        self._home = PACKAGE if ours else self._source.parent
        module = function.__module__ if ours else self._source.stem
        self._name = f"{module}.{function.__qualname__}"

    @property
    def cache_path(self) -> str | None:
        """The folder that new kernels go to, or None."""
        written = _folders(self._home).written
        return None if written is None or self._digest is None else str(written)

    @lazy
    def _digest(self) -> str | None:
        """The digest of the files that the kernel's code depends on; None if that is unknown."""
        return digest_of(self._function)

    def knows(self, signature: Any) -> bool:
        """Whether files can stand for the kernel compiled for these types: all sources that decide it are known."""
        return self._digest is not None and None not in self._origins(signature)

    def _origins(self, signature: Any) -> tuple[str | None, ...]:
        """Texts of the values that it names and of its arguments' types, beside the digest of its own sources."""
        return (*values_of(self._function), *digests_of(tuple(signature)))

    def is_stored(self) -> bool:
        """Whether a file of these sources exists for any argument types, so that a later run need not compile.

        Also True if nothing can be written: then no process can help another.
        """
        folders = _folders(self._home)
        if folders.written is None or self._digest is None:
            return True
        begin = f"{self._prefix()}{_short(self._digest)}-"
        return any(
            name.startswith(begin) for folder in (*folders.read, *ahead_folders()) for name in self._names(folder)
        )

    def load_overload(self, signature: Any, context: Any) -> CompileResult | None:
        """The kernel compiled for the types in ``signature``, or None if it must be compiled."""
        if not self.knows(signature):
            return None
        for path, key in self._places(signature, context.codegen().magic_tuple()):
            with resting():
                payload = _read(path, key)
                if payload is not None:
                    with _tolerant(path):
                        return self._rebuilt(signature, context, payload)
        return None

    def _rebuilt(self, signature: Any, context: Any, payload: Any) -> CompileResult | None:
        return CompileResult._rebuild(context, *payload)

    @contextmanager
    def turn(self, signature: Any, context: Any) -> Iterator[CompileResult | None]:
        """A context in which no other process compiles the kernel for these types; yields the one that another process
        has written meanwhile, or None.
        """
        if not self.knows(signature):
            yield None
            return
        name = self._file(self._key(signature, context.codegen().magic_tuple()))
        with turn(_folders(self._home).written, name) as waited:
            found = self.load_overload(signature, context)
            if waited and found is None:
                # Who was waited for stands still, was killed or cannot write: the next will be no better.
                wait_no_more()
            yield found

    def save_overload(self, signature: Any, compiled: CompileResult) -> None:
        """Nothing: ``keep`` was called before."""

    def keep(self, signature: Any, compiled: CompileResult) -> None:
        """``write`` a kernel, or count it among the lost ones."""
        if not self.write(signature, compiled):
            _Count.lost += 1

    def write(self, signature: Any, compiled: CompileResult) -> bool:
        """Write a kernel for other processes, and remove those compiled from other sources; whether it could."""
        folder = _folders(self._home).written
        if folder is None or not self.knows(signature) or compiled.library.has_dynamic_globals:
            return False
        key = self._key(signature, compiled.library.codegen.magic_tuple())
        path = folder / self._file(key)
        try:
            _write(path, key, dumps(_needed(compiled._reduce())))
        except OSError as error:
            warn_once("unwritable", f"compiled kernels cannot be kept: {path}: {error.strerror}")
            return False
        prefix = self._prefix()
        current = f"{prefix}{_of_sources(key[1])}"
        for name in self._names(folder):
            if name.startswith(prefix) and not name.startswith(current):
                with suppress(OSError):
                    (folder / name).unlink()
        return True

    def _places(self, signature: Any, machine: tuple[str, ...]) -> Iterable[tuple[Path, tuple[str, ...]]]:
        yield from self._own_places(signature, machine)
        ahead = ahead_folders()
        for processor in ("", *runnable_levels()) if ahead else ():
            level = (machine[0], LEVELS[processor], "") if processor else machine
            key = self._key(signature, level)
            for folder in ahead:
                yield folder / self._file(key), key

    def _own_places(self, signature: Any, machine: tuple[str, ...]) -> Iterator[tuple[Path, tuple[str, ...]]]:
        own = self._key(signature, machine)
        for folder in _folders(self._home).read:
            yield folder / self._file(own), own

    def _names(self, folder: Path) -> list[str]:
        return _names(folder, self.suffix)

    def _key(self, signature: Any, machine: tuple[str, ...]) -> tuple[str, ...]:
        return (
            f"{self._name} {signature}",
            str(self._digest),
            _versions(),
            *machine,
            f"svml {config.USING_SVML}",
            f"bounds {config.BOUNDSCHECK}",
            *map(str, self._origins(signature)),
        )

    def _prefix(self) -> str:
        short = hashlib.sha256(_versions().encode()).hexdigest()[:8]
        return f"{self._name}-{short}-"

    def _file(self, key: tuple[str, ...]) -> str:
        return f"{self._prefix()}{_short(key[1])}-{hash_of(key)}{self.suffix}"


def keep_in(folder: Path) -> None:
    """From now on, write and read compiled kernels only in ``folder``."""
    _Chosen.folders = Folders(folder, (folder,))


def is_chosen() -> bool:
    """Whether ``keep_in`` has chosen the folder."""
    return _Chosen.folders is not None


def ahead_folders() -> tuple[Path, ...]:
    """The existing folders of kernels compiled ahead: those of the environment, then the package's own."""
    return () if _Chosen.folders else _named_folders()


def lost() -> int:
    """The number of kernels that this process compiled and could not write."""
    return _Count.lost


class _Count:
    """The number of kernels that could not be written."""

    lost = 0


class _Chosen:
    """The folders chosen by ``keep_in``, None for the usual ones."""

    folders: Folders | None = None


@cache
def _named_folders() -> tuple[Path, ...]:
    named = [Path(text) for text in os.environ.get(AHEAD_VARIABLE, "").split(os.pathsep) if text]
    empty = [str(folder) for folder in named if not stored_in(folder)]
    if empty:
        warn_once("ahead", f"no compiled kernels are in {', '.join(empty)}, which {AHEAD_VARIABLE} names")
    return tuple(folder for folder in (*named, _CARRIED) if _is_folder(folder))


@cache
def runnable_levels() -> tuple[str, ...]:
    """The levels whose kernels this machine can run, best first."""
    arm = llvm.get_process_triple().startswith(("aarch64", "arm64"))
    return tuple(name for name in LEVELS if (name == "aarch64") == arm and not lacking(name))


def stored_in(folder: Path) -> int:
    """The number of kernels in a folder."""
    return len(_names(folder, _SUFFIX))


@cache
def _versions() -> str:
    tag = sys.implementation.cache_tag or sys.implementation.name
    flags = getattr(sys, "abiflags", "")
    return f"{tag}{flags} numba {numba.__version__} llvmlite {llvmlite.__version__} {_FORM}"


def _of_sources(digest: str) -> str:
    """The part of a file's name that differs between sources."""
    return digest[:8]


def _short(digest: str) -> str:
    return _of_sources(digest) + digest[-8:]


def hash_of(key: tuple[str, ...]) -> str:
    return hashlib.sha256("\0".join(key).encode()).hexdigest()[:16]


def _folders(sources: Path) -> Folders:
    """The folders in which kernels of one source folder are written and read."""
    return _Chosen.folders or _usual_folders(sources)


@cache
def _usual_folders(sources: Path) -> Folders:
    """The folder in NUMBA_CACHE_DIR alone, if it can be written; else the sources' own and the user's."""
    own, places = f"{sources.name}_{hashlib.sha256(os.fsencode(sources)).hexdigest()[:16]}", []
    if config.CACHE_DIR:
        chosen = Path(config.CACHE_DIR).absolute() / own
        if _can_write(chosen):
            return Folders(chosen, (chosen,))
        places.append(chosen)
    places.append(sources / "__pycache__")
    with suppress(RuntimeError):  # no home
        places.append(_user_cache() / "octree-renderer" / own)
    written = next((place for place in places if _can_write(place)), None)
    return Folders(written, tuple(place for place in places if _is_folder(place)))


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _is_folder(path: Path) -> bool:
    """``path.is_dir()``, or False if this user has no access."""
    try:
        return path.is_dir()
    except OSError:
        return False


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _names(folder: Path, suffix: str) -> list[str]:
    try:
        return [name for name in os.listdir(folder) if name.endswith(suffix)]
    except OSError:
        return []


def _read(path: Path, key: tuple[str, ...]) -> Any:
    """The content of a file, or None if it is absent, damaged or of another key."""
    try:
        if not S_ISREG(path.stat().st_mode):  # reading a pipe would wait
            return None
        content = path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        warn_once("unreadable", f"a compiled kernel cannot be read and is compiled anew: {path}: {error.strerror}")
        return None
    head, body = content[: len(_HEADER)], content[len(_HEADER) + 32 :]
    with _tolerant(path):
        if head != _HEADER or hashlib.sha256(body).digest() != content[len(_HEADER) : len(_HEADER) + 32]:
            raise ValueError("its content is not what was written")
        stored, payload = pickle.loads(body)
        # Two keys may share a file's name, though hardly ever.
        return pickle.loads(payload) if stored == key else None
    return None


@contextmanager
def _tolerant(path: Path) -> Iterator[None]:
    """A context in which an error means that a stored kernel is unusable; it is logged once."""
    try:
        yield
    except Exception as error:
        warn_once("damaged", f"a compiled kernel is damaged and is compiled anew: {path}: {error}")


def _needed(reduced: tuple[Any, ...]) -> tuple[Any, ...]:
    """A kernel's parts without the empty environments of Numba's own functions: to read one, Numba imports its module,
    and some of these import SciPy.
    """
    *parts, environments = reduced
    return (*parts, tuple(e for e in environments if e.consts or not e.globals["__name__"].startswith("numba.")))


def _write(path: Path, key: tuple[str, ...], payload: bytes) -> None:
    body = pickle.dumps((key, payload))
    if path.exists() and not path.is_file():  # a pipe, say, which would be written to
        with suppress(OSError):
            path.unlink()
    write_atomically(path, lambda file: file.write(_HEADER + hashlib.sha256(body).digest() + body))
