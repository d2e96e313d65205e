"""A plugin of pytest (``-p validation.mutants.plugin``) that notes what each test file touches.

These are the lines of the renderer and the validation suite that Python ran, and the files of the kernels that it
called: compiled code has no lines to trace. It needs the extra dev, so only the processes that measure import it.
"""

import json
import os
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import coverage
import pytest

from renderer.jit.compiler import Kernel
from renderer.jit.digest import PACKAGE
from validation.mutants.workshop import TOUCHED


class _Plugin:
    """Switches the context of coverage, and the set of called kernels, from test file to test file."""

    def __init__(self) -> None:
        self.coverage = coverage.Coverage(data_file=None, source=[str(PACKAGE), str(PACKAGE.parent / "validation")])
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
        (Path(os.environ[TOUCHED]) / f"{os.getpid()}.json").write_text(json.dumps(found), encoding="utf-8")


def pytest_configure(config: pytest.Config) -> None:
    """Called by pytest, in each process."""
    # One that shares tests out runs none.
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        config.pluginmanager.register(_Plugin())
