"""Breaks one rule of ``renderer`` in this process: the only way in which a seeded defect takes effect.

The files stay unchanged. A process that is to have a defect calls ``inject`` before it imports the renderer. A changed
source is compiled from altered text; the digest that identifies compiled kernels on disk reads that text too, so a
defect in kernels gets its own, and unaffected ones are reused. Such a process needs its own ``NUMBA_CACHE_DIR``: saving
a kernel removes those of other texts.
"""

import functools
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

from validation.defects.changes import Altered, Change, Wrapped
from validation.defects.places import find_name

PACKAGE = Path(__file__).resolve().parents[2] / "renderer"
_DIGEST = "renderer.jit.digest"
# What the package itself imports.
_FIRST = ("renderer.collector", "renderer.jit.loaded", "renderer.lazy_names")


def inject(change: Change) -> None:
    """Make this process load the renderer with one change.

    Raises ``ValueError`` unless what it names is there once, and ``RuntimeError`` where the renderer was imported
    already: loaded modules would stay sound.
    """
    loaded = sorted(_sound_modules())
    if loaded:
        raise RuntimeError(f"inject: expected a process without modules of renderer, got {loaded[0]}")
    if isinstance(change, Wrapped):
        module, name = find_name(PACKAGE, change.name)
        _on_load(module, functools.partial(_wrap, name=name, wrapper=change.wrapper))
        return
    altered = change.altered(PACKAGE)
    _on_load(altered.module, text=altered.text)
    if altered.compiled:
        _on_load(_DIGEST, functools.partial(_digest_altered, altered=altered))


def _sound_modules() -> Iterator[str]:
    """The renderer's modules in this process, except those that the package itself imports, and their parents."""
    for name in sys.modules:
        if name.startswith("renderer.") and not any(first.startswith(name) for first in _FIRST):
            yield name


def _wrap(module: ModuleType, name: str, wrapper: Callable[..., object]) -> None:
    """Replace a function of a module, or a method such as "Mesh.normals", by a wrapper of it."""
    path, _, last = name.rpartition(".")
    owner = functools.reduce(getattr, path.split(".") if path else [], module)
    sound = vars(owner)[last]
    assert callable(sound), f"{name}: expected a function or method, got {sound!r}"

    @functools.wraps(sound, updated=())
    def broken(*arguments: object, **options: object) -> object:
        return wrapper(sound, *arguments, **options)

    setattr(owner, last, broken)


def _digest_altered(digest: ModuleType, altered: Altered) -> None:
    """Have the module that digests sources read the altered text."""
    sound = vars(digest)["_source"]
    vars(digest)["_source"] = lambda path: altered.text.encode() if path.resolve() == altered.path else sound(path)


def _on_load(module: str, then: Callable[[ModuleType], None] = lambda _: None, text: str | None = None) -> None:
    """When ``module`` is imported, from ``text`` if one is given, call ``then`` with it."""
    sys.meta_path.insert(0, _Finder(module, then, text))


class _Finder(MetaPathFinder):
    """Finds one module as its path does, and has it loaded by ``_Loader``."""

    def __init__(self, module: str, then: Callable[[ModuleType], None], text: str | None) -> None:
        self._module, self._then, self._text = module, then, text

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = PathFinder.find_spec(fullname, path, target) if fullname == self._module else None
        if spec is not None:
            spec.loader = _Loader(fullname, str(spec.origin), self._then, self._text)
        return spec


class _Loader(SourceFileLoader):
    """Loads a module, from another text where one is given, and then calls a function with it."""

    def __init__(self, fullname: str, path: str, then: Callable[[ModuleType], None], text: str | None) -> None:
        super().__init__(fullname, path)
        self._then, self._text = then, text

    def get_code(self, fullname: str) -> CodeType | None:
        # Not the base class's method, which would use the sound text's bytecode from __pycache__.
        if self._text is None:
            return super().get_code(fullname)
        return compile(self._text, self.path, "exec", dont_inherit=True)

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        self._then(module)
