"""Digests of kernel sources, in the names of compiled kernels: an edit of an imported file changes the digest."""

import hashlib
import re
from collections.abc import Iterable
from functools import cache
from logging import getLogger
from pathlib import Path

from renderer.jit import loaded

PACKAGE = Path(__file__).resolve().parents[1]
_IMPORT = re.compile(rf"^from ({PACKAGE.name}(?:\.\w+)*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


def is_ours(path: Path) -> bool:
    """Whether a source file belongs to this package."""
    return path.resolve().is_relative_to(PACKAGE)


@cache
def source_digest(path: Path) -> str | None:
    """Hex digest of a source file and of all files of this package that it imports, at any depth.

    For a file outside the package: of that file and the whole package. None, logged once, if the file cannot be read,
    as in a zip, or if a file was written after this process loaded the package: the code that runs may then differ from
    it.
    """
    path = path.resolve()
    seen = reached([path] if is_ours(path) else [path, *PACKAGE.rglob("*.py")])
    newer = sorted(found for found in seen if found.stat().st_mtime > loaded.AT)
    if path not in seen or newer:
        why = f"{newer[0]} was written after this process began" if newer else f"{path} cannot be read"
        _say_once(f"renderer: compiled kernels are neither kept nor looked for: {why}")
        return None
    digest = hashlib.sha256()
    for found in sorted(seen):
        name = found.relative_to(PACKAGE).as_posix() if found.is_relative_to(PACKAGE) else found.name
        digest.update(name.encode() + b"\0" + _source(found) + b"\0")
    return digest.hexdigest()


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
def _say_once(message: str) -> None:
    getLogger("renderer.jit").warning(message)


@cache
def _source(path: Path) -> bytes:
    return path.read_bytes()


@cache
def imported_files(path: Path) -> list[Path]:
    """The files of the package that a source imports by ``from renderer.a.b import c``; c: a module or a name in b."""
    found = []
    for module, names in _IMPORT.findall(_source(path).decode(errors="replace")):
        base = PACKAGE.joinpath(*module.split(".")[1:])
        below = [base / f"{name}.py" for name in re.findall(r"\w+", names)]
        candidates = [base.with_suffix(".py"), base / "__init__.py", *below]
        found += [file for file in candidates if file != PACKAGE.with_suffix(".py") and file.exists()]
    return found
