"""Files that a user drops on the page: received into a private folder, which ends with the server.

Who sends a file may read what this page shows, and no other file of this machine: what a dropped file names has to come
with it.
"""

import gzip
import os
import shutil
import zlib
from collections.abc import AsyncIterator, Collection, Iterable
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path, PureWindowsPath
from tempfile import TemporaryDirectory, mkdtemp
from typing import Annotated, NamedTuple

from pydantic import Field, TypeAdapter, ValidationError
from starlette.concurrency import run_in_threadpool

from renderer.errors import expect
from renderer.mesh.load import MESH_SUFFIXES, buffer_files, mesh_suffix
from renderer.scene.scene import mesh_files

_MIB = 1 << 20
# The most bytes of one drop, as they come and unpacked, and of all that are kept: they take the system's temporary
# folder, which may be memory.
MOST_BYTES, MOST_KEPT = 512 * _MIB, 4096 * _MIB
MOST_FILES = 64
# Of scenes, of meshes, and of the buffers of glTF. The longer of two that fit comes first.
SUFFIXES = (*(f"{suffix}.gz" for suffix in MESH_SUFFIXES), ".toml", *MESH_SUFFIXES, ".bin")

_LISTED: TypeAdapter[list[tuple[str, int]]] = TypeAdapter(
    Annotated[list[tuple[str, Annotated[int, Field(ge=0)]]], Field(min_length=1, max_length=MOST_FILES)]
)


class Arrived(NamedTuple):
    """The files of one drop, by their names in a folder of their own."""

    folder: Path
    names: list[str]


class Drops:
    """Files dropped on the pages of a server. ``paths`` are the scene and mesh files to choose from, by name."""

    def __init__(self) -> None:
        self.paths: dict[str, Path] = {}
        self._folder: TemporaryDirectory[str] | None = None
        self._bytes = 0

    @asynccontextmanager
    async def received(self, listed: str, content: AsyncIterator[bytes]) -> AsyncIterator[Arrived]:
        """The files whose names and sizes are ``listed`` as JSON and whose bytes follow each other in ``content``.

        They are removed again where the context ends by an error. Raises ``ValueError`` for that, with their names.
        """
        files = _named(listed)
        size = sum(files.values())
        told = ", ".join(files)
        expect(size <= MOST_BYTES, told, f"at most {MOST_BYTES // _MIB} MiB", f"{-(-size // _MIB)} MiB")
        kept = f"at most {MOST_KEPT // _MIB} MiB of all that was dropped until the server ends"
        expect(self._bytes + size <= MOST_KEPT, told, kept, f"{-(-(self._bytes + size) // _MIB)} MiB")
        self._folder = self._folder or TemporaryDirectory(prefix="octree-render-", ignore_cleanup_errors=True)
        folder = Path(mkdtemp(dir=self._folder.name))
        self._bytes += size
        with ExitStack() as undoing:
            undoing.callback(self._remove, folder, size)
            try:
                await _write({folder / name: number for name, number in files.items()}, content)
                yield Arrived(folder, [*files])
            except Exception as error:  # which names the files as they are here
                told = str(error).replace(f"{folder}{os.sep}", "").replace(str(folder), "its folder")
                raise ValueError(told) from error
            undoing.pop_all()

    def _remove(self, folder: Path, size: int) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        self._bytes -= size

    def close(self) -> None:
        """Remove all files."""
        if self._folder is not None:
            self._folder.cleanup()


def _named(listed: str) -> dict[str, int]:
    """The size of each file by its name, which is that of no folder. Raises ``ValueError``."""
    try:
        given = _LISTED.validate_json(listed, strict=True)
    except ValidationError:
        raise ValueError(f"files: expected 1 to {MOST_FILES} pairs of a name and a size, got {listed[:40]!r}") from None
    files = {PureWindowsPath(name).name: size for name, size in given}  # after the last slash of any kind
    for name in files:
        expect(name.isprintable() and _suffix(name) is not None, "files", f"names in {' '.join(SUFFIXES)}", repr(name))
    expect(len(files) == len(given), ", ".join(files), "names that differ", f"{len(given)} files")
    return files


def _suffix(name: str) -> str | None:
    """The suffix of a file that is read, as ``SUFFIXES`` spells it."""
    return next((suffix for suffix in SUFFIXES if name.lower().endswith(suffix)), None)


async def _write(sizes: dict[Path, int], content: AsyncIterator[bytes]) -> None:
    """Cut the bytes that come into files of these sizes."""
    piece = b""
    for path, size in sizes.items():
        with path.open("xb") as file:
            while size > 0:
                piece = piece or await anext(content, b"")
                expect(piece != b"", path.name, f"{size} more bytes", "none")
                await run_in_threadpool(file.write, piece[:size])
                piece, size = piece[size:], size - len(piece)
    expect(not (piece or await anext(content, b"")), "files", "as many bytes as stated", "more")


def arrange(arrived: Arrived, taken: Collection[str]) -> Path:
    """Put the files where the scene among them looks for them; returns its path, or that of a mesh that came alone.

    Its name is none of those that are ``taken``. Raises ``ValueError`` where there is no one file to show, and where it
    names one that did not come.
    """
    folder, names = arrived
    _expect_not_larger(folder / name for name in names)
    path = folder / _chief(names)
    for mesh in mesh_files(path):
        _put(mesh, path, folder)
        for buffer in buffer_files(mesh):
            _put(buffer, mesh, folder)
    return path.rename(folder / _other_than(taken, path.name))


def _expect_not_larger(paths: Iterable[Path]) -> None:
    """Raise ``ValueError`` where the files that are packed would become larger than is allowed."""
    left = MOST_BYTES
    for path in paths:
        if path.suffix.lower() == ".gz":
            try:
                with gzip.open(path) as file:
                    while piece := file.read(_MIB):
                        left -= len(piece)
                        expect(left >= 0, path.name, f"at most {MOST_BYTES // _MIB} MiB unpacked", "more")
            except (OSError, EOFError, zlib.error):
                pass  # reading it says what is wrong


def _chief(names: list[str]) -> str:
    """The file to show: the only scene, or without one the only mesh."""
    scenes = [name for name in names if _suffix(name) == ".toml"]
    shown = scenes or [name for name in names if mesh_suffix(Path(name))]
    expected = "one scene (.toml), or one mesh, with the files that it names"
    expect(len(shown) == 1, ", ".join(names), expected, f"{len(shown)} {'scenes' if scenes else 'meshes'}")
    return shown[0]


def _put(path: Path, by: Path, folder: Path) -> None:
    """Move what came under that name to ``path``, where the file ``by`` says that it is. Raises ``ValueError`` for a
    path out of the folder, and for a file that did not come.
    """
    inside = Path(os.path.normpath(path)).is_relative_to(folder)
    expect(inside, by.name, "names of files beside it or in folders there", str(path))
    if not path.exists():
        came = folder / path.name
        expect(came.is_file(), by.name, "the files that it names to come with it", f"no {path.relative_to(folder)}")
        path.parent.mkdir(parents=True, exist_ok=True)
        came.rename(path)


def _other_than(taken: Collection[str], name: str) -> str:
    """``name``, or with the next number that makes it another than those."""
    end = len(name) - len(_suffix(name) or "")
    number = 1
    found = name
    while found in taken:
        number += 1
        found = f"{name[:end]} ({number}){name[end:]}"
    return found
