"""The one seam through which a defect enters: a module of ``renderer`` is loaded from altered text.

The files stay as they are. A process that shall have a defect calls ``inject`` before anything imports the renderer;
from then on the named module is compiled from its text with one piece replaced. The digest by which compiled kernels
are found on disk sees that text too, so a defect gets kernels of its own, and those it does not reach are reused.
Run it with a ``NUMBA_CACHE_DIR`` of its own all the same: saving a kernel removes those of other texts.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

_PACKAGE = Path(__file__).resolve().parent.parent / "renderer"
_DIGEST = "renderer.source_digest"


@dataclass(frozen=True)
class Replacement:
    """In ``module``, a name such as "leaf" for ``renderer.leaf``, the text ``rule`` becomes ``broken``."""

    module: str
    rule: str
    broken: str

    @property
    def path(self) -> Path:
        """The file, which is only read."""
        return _PACKAGE / f"{self.module}.py"

    def text(self) -> str:
        """The module's altered text. Raises ``ValueError`` unless ``rule`` stands there exactly once."""
        original = self.path.read_text(encoding="utf-8")
        found = original.count(self.rule)
        if found != 1:
            raise ValueError(f"rule: expected once in {self.path.name}, got {found} times: {self.rule!r}")
        return original.replace(self.rule, self.broken)


def inject(replacement: Replacement) -> None:
    """Let this process load the module with its rule broken.

    Raises ``ValueError`` where the rule does not stand there exactly once, and ``RuntimeError`` where the renderer was
    imported already: what is loaded would stay sound.
    """
    # The package itself loads one module, which looks at the clock.
    loaded = sorted(name for name in sys.modules if name.startswith("renderer.") and name != "renderer.loaded")
    if loaded:
        raise RuntimeError(f"inject: expected a process without modules of renderer, got {loaded[0]}")
    sys.meta_path.insert(0, _Finder(replacement))


class _Finder(MetaPathFinder):
    """Finds the altered module, and the one that digests sources."""

    def __init__(self, replacement: Replacement) -> None:
        self._replacement, self._text = replacement, replacement.text()

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        altered = f"renderer.{self._replacement.module}"
        if fullname not in (altered, _DIGEST):
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None:
            source = str(spec.origin)
            text = self._text if fullname == altered else Path(source).read_text(encoding="utf-8")
            spec.loader = _Loader(fullname, source, text, {self._replacement.path: self._text.encode()})
        return spec


class _Loader(SourceFileLoader):
    """Compiles a module from a given text, and tells the module that digests sources which were altered."""

    def __init__(self, fullname: str, path: str, text: str, altered: dict[Path, bytes]) -> None:
        super().__init__(fullname, path)
        self._text, self._altered = text, altered

    def get_code(self, fullname: str) -> CodeType:
        # Not the base class's, which would take what __pycache__ holds of the sound text.
        return compile(self._text, self.path, "exec", dont_inherit=True)

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        if module.__name__ == _DIGEST:
            sound = vars(module)["_source"]
            vars(module)["_source"] = lambda path: self._altered.get(path.resolve()) or sound(path)
