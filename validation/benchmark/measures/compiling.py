"""``python -m validation.benchmark.measures.compiling``: where the time of compiling goes, by stage and by kernel.

Compiles what ``octree-render compile --queries`` or ``--pictures`` does, into an empty folder, with clocks around
Numba's passes and LLVM. Times are wall seconds of one thread, those of callees not included.
"""

import argparse
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any


class _Clocks:
    """Seconds by name, without those of nested calls."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._within: list[float] = []

    def around(self, name: Callable[..., str], call: Callable[..., Any]) -> Callable[..., Any]:
        """``call`` with a clock, whose name is a function of the arguments."""

        def timed(*arguments: Any, **keywords: Any) -> Any:
            self._within.append(0.0)
            began = time.perf_counter()
            try:
                return call(*arguments, **keywords)
            finally:
                took = time.perf_counter() - began
                self.seconds[name(*arguments)] += took - self._within.pop()
                if self._within:
                    self._within[-1] += took

        return timed


def profile(what: str) -> tuple[dict[str, float], dict[str, float], float]:
    """Seconds by stage, by kernel and in total of compiling ``what``; for a process that has compiled nothing."""
    from numba.core import compiler_machinery, lowering

    from renderer.jit import libraries
    from renderer.precompile import compile_ahead, compile_into

    stages, kernels = _Clocks(), _Clocks()
    manager: Any = compiler_machinery.PassManager
    by_kernel = kernels.around(lambda self, index, one, state: state.func_id.func_qualname, manager._runPass)
    manager._runPass = stages.around(lambda self, index, one, state: _stage(one.name()), by_kernel)
    clocked: tuple[tuple[Any, str, str], ...] = (
        (libraries.EntryLibrary, "finalize", "LLVM: link and optimise"),
        (libraries.EntryLibrary, "_finalize_final_module", "LLVM: machine code"),
        (lowering.BaseLower, "lower_normal_function", "write LLVM's instructions"),
        (libraries.PieceLibrary, "add_ir_module", "print and parse them"),
    )
    for owner, method, stage in clocked:
        setattr(owner, method, stages.around(lambda *a, stage=stage: stage, getattr(owner, method)))
    with tempfile.TemporaryDirectory() as folder:
        compile_into(Path(folder))
        began = time.perf_counter()
        compile_ahead(what)
        return stages.seconds, kernels.seconds, time.perf_counter() - began


def _stage(name: str) -> str:
    """The stage of a Numba pass."""
    known = {
        "translate_bytecode": "read bytecode",
        "nopython_type_inference": "infer types",
        "renderer_lower_piece": "write LLVM's instructions",
        "renderer_link_entry": "wrap for Python, load",
    }
    return known.get(name, "Numba's other passes")


def _dearest(seconds: dict[str, float]) -> list[tuple[str, float]]:
    return sorted(seconds.items(), key=lambda item: -item[1])


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.measures.compiling", description=__doc__)
    parser.add_argument("what", nargs="?", choices=("queries", "pictures"), default="queries")
    parser.add_argument("--kernels", type=int, default=15, metavar="N", help="how many of the dearest kernels")
    options = parser.parse_args()
    stages, kernels, whole = profile(options.what)
    print(f"{whole:7.2f} s in all, imports left out; {len(kernels)} functions")
    for name, seconds in _dearest(stages):
        print(f"{seconds:7.2f} s  {name}")
    for name, seconds in _dearest(kernels)[: options.kernels]:
        print(f"{seconds:7.2f} s  {name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
