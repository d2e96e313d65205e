"""Which tests touch which code: measured while the sound renderer passes them.

As a plugin of pytest (``-p validation.mutants.touched``) it notes, for each test file, the renderer's lines that Python
ran and the files of the kernels that it called, with the files that these import: compiled code has no lines to trace.
"""

import json
import os
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import coverage
import pytest

from renderer.kernels.compiler import Kernel
from renderer.kernels.digest import PACKAGE, imported_files
from validation.mutants.sites import Mutant

# Where the plugin writes, a file for each process of the run.
VARIABLE = "TOUCHED_FOLDER"
Touched = Mapping[str, Mapping[str, Any]]
# Tests that read the sources' text: any change of it fails them, whatever it does.
_READERS = ("tests/validation/defects/", "tests/validation/mutants/", "tests/front/test_documents.py")


class _Plugin:
    """Switches the context of coverage, and the set of called kernels, from test file to test file."""

    def __init__(self) -> None:
        self.coverage = coverage.Coverage(data_file=None, source=[str(PACKAGE)])
        self.kernels: dict[str, set[str]] = defaultdict(set)
        self.seconds: dict[str, float] = defaultdict(float)
        self.now = ""
        called = Kernel.__call__

        def noting(kernel: Kernel, *arguments: Any) -> Any:
            self.kernels[self.now].add(kernel.py_func.__code__.co_filename)
            return called(kernel, *arguments)

        setattr(Kernel, "__call__", noting)  # noqa: B010, mypy lets no method be assigned
        self.coverage.start()

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Around each test."""
        self.now = item.location[0]
        self.coverage.switch_context(self.now)
        began = time.perf_counter()
        yield
        self.seconds[self.now] += time.perf_counter() - began

    def pytest_unconfigure(self) -> None:
        """At the end of the process."""
        self.coverage.stop()
        data = self.coverage.get_data()
        lines: dict[str, dict[str, list[int]]] = defaultdict(dict)
        for file in data.measured_files():
            for line, contexts in data.contexts_by_lineno(file).items():
                for context in filter(None, contexts):
                    lines[context].setdefault(file, []).append(line)
        found = {
            test: {"lines": lines[test], "kernels": sorted(self.kernels[test]), "seconds": seconds}
            for test, seconds in self.seconds.items()
        }
        (Path(os.environ[VARIABLE]) / f"{os.getpid()}.json").write_text(json.dumps(found), encoding="utf-8")


def pytest_configure(config: pytest.Config) -> None:
    """Called by pytest, in each process."""
    # One that shares tests out runs none.
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        config.pluginmanager.register(_Plugin())


def read(folder: Path, root: Path) -> Touched:
    """What the processes wrote: test file to ``lines`` {file: lines}, ``kernels`` [files] and ``seconds``, by paths
    relative to ``root``.
    """
    merged: dict[str, dict[str, Any]] = {}
    for path in sorted(folder.glob("*.json")):
        for test, found in json.loads(path.read_text(encoding="utf-8")).items():
            one = merged.setdefault(test, {"lines": {}, "kernels": [], "seconds": 0.0})
            for file, lines in found["lines"].items():
                if not Path(file).is_relative_to(root):  # of an installed copy that a test looked into
                    continue
                name = Path(file).relative_to(root).as_posix()
                one["lines"][name] = sorted({*one["lines"].get(name, []), *lines})
            one["kernels"] = sorted({*one["kernels"], *_closure(found["kernels"], root)})
            one["seconds"] += found["seconds"]
    return merged


def touching(mutant: Mutant, touched: Touched) -> list[str]:
    """The test files that run a mutant's code: those in the folder of its module first, then the shortest."""
    room = Path("tests", *Path(mutant.file).parts[1:-1]).as_posix()

    def runs(found: Mapping[str, Any]) -> bool:
        lines = found["lines"].get(mutant.file, [])
        # What stands at a module's top runs once, in whichever test imports it first.
        return mutant.file in found["kernels"] or (bool(lines) if mutant.at_top else mutant.line in lines)

    return sorted(
        (test for test, found in touched.items() if runs(found) and not test.startswith(_READERS)),
        key=lambda test: (Path(test).parent.as_posix() != room, touched[test]["seconds"]),
    )


def _closure(files: Sequence[str], root: Path) -> set[str]:
    """Files of the package in ``root`` with all that they import, by paths relative to it."""
    seen: set[Path] = set()
    own = [Path(file).relative_to(root) for file in files if Path(file).is_relative_to(root / PACKAGE.name)]
    # What a file imports is told of this process's own package.
    pending = [PACKAGE.parent / file for file in own]
    while pending:
        file = pending.pop()
        if file not in seen:
            seen.add(file)
            pending += imported_files(file)
    return {file.relative_to(PACKAGE.parent).as_posix() for file in seen}
