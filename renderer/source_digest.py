"""Digests of kernel sources, by which compiled kernels are found again: an edit below a kernel changes its digest."""

import hashlib
import re
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_IMPORT = re.compile(rf"^from ({_PACKAGE.name}(?:\.\w+)*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


@cache
def source_digest(path: Path) -> str:
    """Hex digest of a source file and of everything it imports from this package, directly or not, at any depth.

    For a file outside the package: of that file and of the whole package.
    """
    path = path.resolve()
    seen: set[Path] = set()
    pending = [path] if path.is_relative_to(_PACKAGE) else [path, *_PACKAGE.rglob("*.py")]
    while pending:
        found = pending.pop()
        if found not in seen and found.exists():
            seen.add(found)
            pending += _imports(found)
    digest = hashlib.sha256()
    for found in sorted(seen):
        name = found.relative_to(_PACKAGE).as_posix() if found.is_relative_to(_PACKAGE) else found.name
        digest.update(name.encode() + b"\0" + _source(found) + b"\0")
    return digest.hexdigest()


@cache
def _source(path: Path) -> bytes:
    return path.read_bytes()


@cache
def _imports(path: Path) -> list[Path]:
    """The files of the package that a source imports by ``from renderer.a.b import c``, c a module or a name in b."""
    found = []
    for module, names in _IMPORT.findall(_source(path).decode()):
        base = _PACKAGE.joinpath(*module.split(".")[1:])
        below = [base / f"{name}.py" for name in re.findall(r"\w+", names)]
        candidates = [base.with_suffix(".py"), base / "__init__.py", *below]
        found += [file for file in candidates if file != _PACKAGE.with_suffix(".py") and file.exists()]
    return found
