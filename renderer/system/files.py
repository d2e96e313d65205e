"""Atomic writing of files."""

import errno
import os
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from stat import S_IMODE, S_ISBLK, S_ISCHR, S_ISREG
from typing import BinaryIO
from uuid import uuid4

try:
    import fcntl
except ImportError:  # on Windows
    fcntl = None  # type: ignore[assignment]

# The last letters of a temporary file's name.
_RANDOM = 12
_END = re.compile(f"[0-9a-f]{{{_RANDOM}}}")


def as_path(argument: str, value: object) -> Path:
    """A path given as a string or path. ``ValueError`` names the argument for anything else, or for an impossible file
    name.
    """
    if not isinstance(value, str | os.PathLike) or isinstance(os.fspath(value), bytes):
        raise ValueError(f"{argument}: expected a string or path, got {type(value).__name__}")
    path = Path(value)
    try:
        os.fsencode(path)
    except UnicodeEncodeError as error:
        raise ValueError(
            f"{path}: {argument}: expected a path that the file system's {error.encoding} can spell"
        ) from None
    return path


def write_atomically(path: str | os.PathLike[str], write: Callable[[BinaryIO], object]) -> None:
    """Have ``write`` fill a temporary file beside ``path``, then rename it: never a half-written file.

    A symbolic link is followed, and a device or pipe is written to. An ``OSError`` names ``path``, whatever failed.
    Temporary files of the same target, left by killed processes, are removed.
    """
    with _temporary_beside(path) as (temporary, target):
        if is_special(target):
            with open(target, "wb") as file:
                write(file)
            return
        with _created(temporary) as file:
            # Before anything is in it, so that a private file stays private.
            with suppress(FileNotFoundError):
                temporary.chmod(S_IMODE(target.stat().st_mode))
            write(file)
            file.close()
            os.replace(temporary, target)
        _remove_left(target)


def read_whole(path: Path) -> bytes:
    """The bytes of a file. Raises ``OSError`` also for a device, which may have no end, and a name with a null byte."""
    if "\0" in str(path):  # else a ValueError, whose words differ between versions of Python
        raise OSError(errno.EINVAL, "embedded null byte", str(path))
    mode = path.stat().st_mode
    if S_ISCHR(mode) or S_ISBLK(mode):
        raise OSError(errno.EINVAL, "expected a file, got a device", str(path))
    return path.read_bytes()


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise the ``OSError`` of ``write_atomically``, as far as it is known before there is anything to write."""
    with _temporary_beside(path) as (temporary, target):
        with suppress(FileNotFoundError):
            target.lstat()  # a name too long, which some versions of Python take for no folder
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
        if not is_special(target):
            temporary.touch(exist_ok=False)
            temporary.unlink(missing_ok=True)  # who finds it left may have been faster


def are_apart(written: Iterable[str | os.PathLike[str]], read: Iterable[str | os.PathLike[str]] = ()) -> bool:
    """Whether the files behind ``written`` are all different and none is one of those behind ``read``, through any
    links.
    """
    # Not Path.resolve, which raises a RuntimeError for links in a circle.
    outputs = [os.path.realpath(path) for path in written]
    return len({*outputs}) == len(outputs) and {*outputs}.isdisjoint(map(os.path.realpath, read))


@contextmanager
def _created(temporary: Path) -> Iterator[BinaryIO]:
    """A new file, locked until the context ends, even if it is closed earlier, so that others see that its writer
    lives.

    A lock ends with its process, however that ends.
    """
    while True:
        with open(temporary, "xb") as file:
            if fcntl is None:
                yield file
                return
            lock = os.dup(file.fileno())
            try:
                with suppress(OSError):  # of a file system without locks, where none is found left either
                    fcntl.flock(lock, fcntl.LOCK_EX)
                if _is_at(temporary, lock):  # else it was found and removed before it was locked
                    yield file
                    return
            finally:
                os.close(lock)


def _is_at(path: Path, descriptor: int) -> bool:
    """Whether the path is that of an open file."""
    try:
        return os.path.samestat(os.lstat(path), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _remove_left(target: Path) -> None:
    """Remove the temporary files of ``target`` whose writers are gone: those without a lock."""
    if fcntl is None:
        return
    beginning = _beginning(target)
    with suppress(OSError):
        for found in os.listdir(target.parent):
            if found.startswith(beginning) and _END.fullmatch(found, len(beginning)):
                with suppress(OSError):
                    _remove_unlocked(target.with_name(found))


def _remove_unlocked(path: Path) -> None:
    """Remove a file. Raises ``OSError`` if it is locked, or on a file system without locks."""
    if S_ISREG(path.lstat().st_mode):
        descriptor = os.open(path, os.O_RDWR)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_at(path, descriptor):  # its writer may have renamed it meanwhile
                path.unlink()
        finally:
            os.close(descriptor)


def _beginning(target: Path) -> str:
    """The start of temporary files' names: a name has at most 255 bytes, a character up to four."""
    return f".{target.name[:60]}."


def is_special(path: Path) -> bool:
    """Whether it is a pipe, which may have no writer, or a device, which may be endless."""
    return path.exists() and not (path.is_file() or path.is_dir())


@contextmanager
def _temporary_beside(path: str | os.PathLike[str]) -> Iterator[tuple[Path, Path]]:
    """A new name in the folder of the file behind ``path``, and that file; nothing of that name is left on errors."""
    try:
        target = Path(os.path.realpath(path))
    except ValueError as error:  # a null byte
        raise ValueError(f"path: expected a name of a file, got {os.fspath(path)!r}: {error}") from None
    except OSError as error:  # the current folder was removed
        raise OSError(error.errno, error.strerror, f"the folder of {path}") from None
    if target.is_symlink():  # after all were followed
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    if target.is_file() and not os.access(target, os.W_OK):  # renaming would not ask
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    # Created by open(), so that it gets the permissions that any new file would.
    temporary = target.with_name(f"{_beginning(target)}{uuid4().hex[:_RANDOM]}")
    try:
        yield temporary, target
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError) and error.errno is not None:
            raise OSError(error.errno, error.strerror, str(path)) from error
        if isinstance(error, OSError):  # of NumPy or OpenEXR, in their own words
            raise type(error)(f"{path}: {error}; is there no space left?") from error
        raise
