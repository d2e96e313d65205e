"""A contender of the benchmark by its name; a test that asks for one that this machine cannot have is skipped."""

import pytest

from validation.benchmark.peers import systems
from validation.benchmark.peers.contender import System


def system(name: str) -> System:
    if name == "open3d":
        pytest.importorskip("open3d", reason="pip install open3d")
    found, missing = systems.available()
    if name == "mitsuba_llvm" and name in missing:
        pytest.skip(missing[name])
    return {one.name: one for one in found}[name]
