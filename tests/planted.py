"""A folder with modules of the names that a process of ours imports, and commands that run in it."""

import os
import subprocess
import sys
from pathlib import Path

# A command needs all of these; each writes its name where it is imported.
_NAMES = ("renderer", "numba", "numpy", "validation", "json", "tqdm", "llvmlite", "pydantic", "site")
_TRAP = "import pathlib; pathlib.Path({folder!r}, 'executed').open('a').write('{name} ')\n"


def planted(parent: Path) -> Path:
    folder = parent / "trapped"
    folder.mkdir()
    for name in _NAMES:
        (folder / f"{name}.py").write_text(_TRAP.format(folder=str(parent), name=name))
    return folder


def executed(folder: Path) -> str:
    path = folder.parent / "executed"
    return path.read_text(encoding="utf-8") if path.exists() else ""


def console(name: str) -> str:
    """A console script of this environment."""
    return str(Path(sys.executable).with_name(name))


def run(command: list[str], folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=folder, env={**os.environ, **more}, timeout=300, capture_output=True, text=True, check=False
    )
