"""Digests of kernel sources, in the names of compiled kernels: an edit of an imported file changes the digest."""

import hashlib
import os
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from renderer.jit import loaded
from renderer.jit.notice import warn_once

PACKAGE = Path(__file__).resolve().parents[1]
_IMPORT = re.compile(rf"^from ({PACKAGE.name}(?:\.\w+)*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


@cache
def is_ours(path: Path) -> bool:
    """Whether a source file belongs to this package."""
    return path.resolve().is_relative_to(PACKAGE)


def source_digest(path: Path) -> str | None:
    """Hex digest of a source file and of all files of this package that it imports, at any depth.

    For a file outside the package: of that file and the whole package. None, logged once, if the file cannot be read,
    as in a zip, or if a file was written after this process loaded the package: the code that runs may then differ from
    it. The file itself may also be written, and its module loaded again, after its digest was first needed.
    """
    return None if _is_new(path) else _digest(path)


@cache
def _digest(path: Path) -> str | None:
    path = path.resolve()
    seen = reached([path] if is_ours(path) else [path, *PACKAGE.rglob("*.py")])
    if path not in seen:
        _refuse(f"{path} cannot be read")
        return None
    if any(_is_new(found) for found in sorted(seen)):
        return None
    digest = hashlib.sha256()
    for found in sorted(seen):
        name = found.relative_to(PACKAGE).as_posix() if found.is_relative_to(PACKAGE) else found.name
        digest.update(name.encode() + b"\0" + _source(found) + b"\0")
    return digest.hexdigest()


def _is_new(path: Path) -> bool:
    """Whether a file was written after this process loaded the package; logged once."""
    try:
        is_new = path.stat().st_mtime > loaded.AT
    except OSError:
        return False
    if is_new:
        _refuse(f"{path} was written after this process began")
    return is_new


def _refuse(why: str) -> None:
    warn_once("sources", f"renderer: compiled kernels are neither kept nor looked for: {why}")


def reached(files: Iterable[Path]) -> set[Path]:
    """The existing ones of some files, and all files of this package that they import, directly or not."""
    seen: set[Path] = set()
    pending = list(files)
    while pending:
        found = pending.pop()
        if found not in seen and found.exists():
            seen.add(found)
            pending += imported_files(found)
    return seen


@cache
def _source(path: Path) -> bytes:
    return path.read_bytes()


@cache
def imported_files(path: Path) -> list[Path]:
    """The files of the package that a source imports by ``from renderer.a.b import c``; c: a module or a name in b."""
    found, modules = [], _modules()
    for module, names in _IMPORT.findall(_source(path).decode(errors="replace")):
        for name in (module, *(f"{module}.{below}" for below in re.findall(r"\w+", names))):
            found += [Path(file) for file in modules.get(name, ())]
    return found


@cache
def _modules() -> dict[str, list[str]]:
    """The files of the package by the names of their modules; a module and a folder may have the same name."""
    modules: dict[str, list[str]] = {}
    for folder, below, files in os.walk(PACKAGE):
        # It has many files, and no source.
        below[:] = [name for name in below if name != "__pycache__"]
        parent = PACKAGE.name + folder[len(str(PACKAGE)) :].replace(os.sep, ".")
        for file in files:
            if file.endswith(".py"):
                name = parent if file == "__init__.py" else f"{parent}.{file[:-3]}"
                modules.setdefault(name, []).append(os.path.join(folder, file))
    return modules
