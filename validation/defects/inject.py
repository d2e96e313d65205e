"""Loads one module of ``renderer`` with one rule broken: the only way in which a seeded defect takes effect.

The files stay unchanged. A process that is to have a defect calls ``inject`` before it imports the renderer; from then
on the module is compiled from altered text. The digest that identifies compiled kernels on disk reads that text too, so
a defect gets its own kernels, and unaffected ones are reused. Such a process still needs its own ``NUMBA_CACHE_DIR``:
saving a kernel removes those of other texts.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

from validation.defects.syntax import Place, find_place, replaced

_PACKAGE = Path(__file__).resolve().parents[2] / "renderer"
_DIGEST = "renderer.jit.digest"
_LOADED = "renderer.jit.loaded"


@dataclass(frozen=True)
class Replacement:
    """Replace the code ``rule`` in ``place`` by ``broken``.

    place   the end of the dotted name of one function, method or module-level constant: "Mesh.normals", "DOUBT";
            with its module where the name alone is not unique: "spawn._leave"
    rule    one expression, or one or more statements, that occur there once. They are compared as syntax: layout and
            comments do not count, and local variables may have other names
    broken  the code that replaces them, with the rule's own names for local variables
    """

    place: str
    rule: str
    broken: str

    @cached_property
    def _found(self) -> Place:
        return find_place(_PACKAGE, self.place)

    @property
    def path(self) -> Path:
        """The file, which is only read."""
        return self._found.path

    @property
    def module(self) -> str:
        """The module's full name."""
        return ".".join(self.path.relative_to(_PACKAGE.parent).with_suffix("").parts)

    def text(self) -> str:
        """The module's altered text. Raises ``ValueError`` unless there is one place, with the rule in it once."""
        return replaced(self._found, self.rule, self.broken)


def inject(replacement: Replacement) -> None:
    """Make this process load the module with its rule broken.

    Raises ``ValueError`` unless the rule occurs there exactly once, and ``RuntimeError`` where the renderer was
    imported already: loaded modules would stay sound.
    """
    loaded = sorted(_sound_modules())
    if loaded:
        raise RuntimeError(f"inject: expected a process without modules of renderer, got {loaded[0]}")
    sys.meta_path.insert(0, _Finder(replacement))


def _sound_modules() -> Iterator[str]:
    """The renderer's modules in this process, except the package's own import clock and its parents."""
    for name in sys.modules:
        if name.startswith("renderer.") and not _LOADED.startswith(name):
            yield name


class _Finder(MetaPathFinder):
    """Finds the altered module, and the module that digests sources."""

    def __init__(self, replacement: Replacement) -> None:
        self._replacement, self._text = replacement, replacement.text()

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        altered = self._replacement.module
        if fullname not in (altered, _DIGEST):
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None:
            source = str(spec.origin)
            text = self._text if fullname == altered else Path(source).read_text(encoding="utf-8")
            spec.loader = _Loader(fullname, source, text, {self._replacement.path: self._text.encode()})
        return spec


class _Loader(SourceFileLoader):
    """Compiles a module from a given text, and passes the altered text to the module that digests sources."""

    def __init__(self, fullname: str, path: str, text: str, altered: dict[Path, bytes]) -> None:
        super().__init__(fullname, path)
        self._text, self._altered = text, altered

    def get_code(self, fullname: str) -> CodeType:
        # Not the base class's method, which would use the sound text's bytecode from __pycache__.
        return compile(self._text, self.path, "exec", dont_inherit=True)

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        if module.__name__ == _DIGEST:
            sound = vars(module)["_source"]
            vars(module)["_source"] = lambda path: self._altered.get(path.resolve()) or sound(path)
