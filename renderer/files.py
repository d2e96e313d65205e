"""Files written whole or not at all."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO
from uuid import uuid4


def write_atomically(path: str | os.PathLike[str], write: Callable[[BinaryIO], object]) -> None:
    """Let ``write`` fill a temporary file beside ``path``, then rename it: never a half-written file.

    A symbolic link is followed. An ``OSError`` names ``path``, whatever failed.
    """
    with _temporary_beside(path) as (temporary, target):
        with open(temporary, "xb") as file:
            write(file)
        os.replace(temporary, target)


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise the ``OSError`` of ``write_atomically``, as far as can be told before there is anything to write."""
    with _temporary_beside(path) as (temporary, _):
        temporary.touch(exist_ok=False)
        temporary.unlink()


@contextmanager
def _temporary_beside(path: str | os.PathLike[str]) -> Iterator[tuple[Path, Path]]:
    """A new name in the folder of the file behind ``path``, and that file; nothing of that name is left on errors."""
    target = Path(os.path.realpath(path))
    # Created by open(), so that it gets the permissions that any new file would.
    temporary = target.with_name(f".{target.name[:100]}.{uuid4().hex[:12]}")
    try:
        yield temporary, target
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError) and error.errno is not None:
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise
