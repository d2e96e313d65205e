"""Kernels whose machine code is apart: one file for all that call them, and for each process."""

import os
import sys
from contextlib import nullcontext

import pytest
from kernel_package import run, start, write_package
from numba.core.registry import cpu_target

from renderer.jit import cache, turns
from renderer.jit.cache import KernelStore
from renderer.numerics.vec3 import add

APART = """
from renderer.jit.decorators import apart, inlined
from renderer.below.deep.bottom import STEP
@inlined
def one(x):
    return x + STEP
@apart
def deepest(x, change):
    return change(x)
@apart
def deep(x, change):
    return 2 * deepest(x, change)
"""
CALLERS = """
from renderer.jit.decorators import kernel
from renderer.far import deep, deepest, one
@kernel
def first(x):
    return deep(x, one) + 1
@kernel
def second(x):
    return deep(x, one) + deepest(x, one) + 2
"""
# Prints the answers, and for each kernel how often it was compiled.
RUN = """
from renderer.callers import first, second
from renderer.far import deep, deepest
kernels = deepest.apart, deep.apart, first.entry, second.entry
print(first(3), second(3), *(sum(kernel.stats.cache_misses.values()) for kernel in kernels))
"""
COMPILED, LOADED = ["27", "41", "1", "1", "1", "1"], ["27", "41", "0", "0", "0", "0"]


@pytest.fixture
def package(tmp_path):
    return write_package(tmp_path, far=APART, callers=CALLERS)


def test_each_is_compiled_once_and_read_with_its_callers(package):
    assert run(package, RUN) == COMPILED
    assert run(package, RUN) == LOADED
    (package / "far.py").write_text(APART.replace("2 * deepest", "3 * deepest"))
    assert run(package, RUN) == ["40", "54", "1", "1", "1", "1"]


@pytest.mark.parametrize("how", ["apart", "kernel"])
def test_it_follows_the_sources_of_kernels_and_classes_that_it_gets(package, how):
    """Which its own file does not import: their sources decide what it does all the same."""
    far = f"""
from renderer.jit.decorators import {how}
@{how}
def deep(x, step, place):
    return step(x) + place.x
"""
    (package / "far.py").write_text(far)
    place = "from typing import Any, NamedTuple\nclass Place(NamedTuple):\n    x: Any\n    y: Any\n"
    step = "from renderer.jit.decorators import inlined\n@inlined\ndef step(x): return 10 * x\n"
    (package / "place.py").write_text(place)
    (package / "step.py").write_text(step)
    (package / "callers.py").write_text("""
from renderer.jit.decorators import kernel
from renderer.far import deep
from renderer.place import Place
from renderer.step import step
@kernel
def first(x):
    return deep(x, step, Place(x=1, y=2))
""")
    program = "from renderer.callers import first; print(first(3))"
    assert run(package, program) == ["31"]
    (package / "place.py").write_text(place.replace("    x: Any\n    y: Any\n", "    y: Any\n    x: Any\n"))
    assert run(package, program) == ["31"]
    (package / "step.py").write_text(step.replace("10 * x", "20 * x"))
    assert run(package, program) == ["61"]


def test_a_caller_of_one_that_is_not_kept_is_not_kept(package):
    """Its symbol is that of one process; the next one aborted."""
    known_before = "import os; from renderer.callers import first; first.store.cache_path; os.utime('renderer/far.py')"
    assert run(package, known_before + RUN) == COMPILED
    done = start(package, RUN)
    assert done.stdout.split() == COMPILED and "damaged" not in done.stderr


def test_a_caller_in_another_package_does_not_call_what_was_edited(package):
    """Its file stays, as it follows only its own source and ours; the symbol in it is gone."""
    far = "from renderer.jit.decorators import apart\n@apart\ndef deep(x):\n    return x + 5\n"
    (package.parent / "theirs.py").write_text(far)
    mine = (
        "from renderer.jit.decorators import kernel\nfrom theirs import deep\n@kernel\ndef first(x): return deep(x)\n"
    )
    (package.parent / "mine.py").write_text(mine)
    program = "from mine import first; print(first(3))"
    assert run(package, program) == ["8"]
    (package.parent / "theirs.py").write_text(far.replace("+ 5", "+ 50"))
    assert run(package, program) == ["53"]


@pytest.mark.parametrize("called", ["deepest", "first"])
def test_a_function_of_numba_s_own_calls_it_and_is_kept_by_numba(package, called):
    """Read from Numba's cache it called a symbol that nobody knew."""
    own = f"""
import numba
from renderer.callers import first
from renderer.far import deepest, one
@numba.njit(cache=True)
def own(x):
    return {called}(x{", one" if called == "deepest" else ""})
print(own(3), sum(own.stats.cache_misses.values()))
"""
    (package.parent / "own.py").write_text(own)
    answer = "13" if called == "deepest" else "27"
    assert [run(package, "import own") for _ in range(2)] == [[answer, "1"], [answer, "0"]]


def test_two_of_one_name_are_told_apart(package):
    (package / "far.py").write_text("""
from renderer.jit.decorators import apart, kernel
def made(step):
    @apart
    def deep(x):
        return x + step
    return deep
one, other = made(100), made(300)
@kernel
def both(x):
    return one(x) + other(x)
""")
    assert run(package, "from renderer.far import both; print(both(1))") == ["402"]


def test_two_kernels_of_one_name_that_it_gets_are_told_apart(package):
    (package / "callers.py").write_text("""
from renderer.jit.decorators import inlined, kernel
from renderer.far import deep
def made(step):
    @inlined
    def add(x):
        return x + step
    return add
one, other = made(100), made(300)
@kernel
def both(x):
    return deep(x, one) + deep(x, other)
""")
    done = start(package, "from renderer.callers import both; print(both(1))")
    assert done.stdout.split() == ["804"] and "damaged" not in done.stderr


def test_one_whose_file_is_gone_is_made_anew_alone(package):
    assert run(package, RUN) == COMPILED
    (lost,) = (package / "__pycache__").glob("*deepest.apart-*.kernel")
    lost.unlink()
    assert run(package, RUN) == ["27", "41", "1", "0", "0", "0"]
    assert run(package, RUN) == LOADED


@pytest.mark.skipif(sys.platform == "win32", reason="there nobody waits")
def test_who_compiles_one_still_holds_its_caller(package):
    """The system frees all that a process locked in a file when it closes the file once."""
    inside = """
import subprocess, sys
from pathlib import Path
from renderer.jit import turns
def held(name):
    with turns.turn(Path(), name) as waited:
        return waited
turns._LONGEST = 0.1
if len(sys.argv) > 1:
    print(held("outer"), held("inner"))
else:
    with turns.turn(Path(), "outer"):
        held("inner")
        subprocess.run([sys.executable, "-B", "-P", __file__, "again"], check=True)
    print(held("outer"))
"""
    script = package.parent / "inside.py"
    script.write_text(inside)
    program = f"import subprocess, sys; subprocess.run([sys.executable, '-B', '-P', {os.fspath(script)!r}], check=True)"
    assert run(package, program) == ["True", "False", "False"]


@pytest.mark.parametrize("found", [None, "a kernel"])
def test_who_waited_in_vain_waits_no_more(monkeypatch, found):
    """Where nothing can be written, each of four processes waited for each kernel, and then compiled it."""
    store = KernelStore(add.py_func)
    monkeypatch.setattr(turns._Patience, "left", True)
    monkeypatch.setattr(cache, "turn", lambda folder, name: nullcontext(True))
    monkeypatch.setattr(store, "load_overload", lambda signature, context: found)
    with store.turn((), cpu_target.target_context) as got:
        assert got is found
    assert turns._Patience.left == (found is not None)


def test_a_vector_is_refused(package):
    """Code for another level of processor passes it in other registers."""
    (package / "far.py").write_text("""
from renderer.jit.decorators import apart
from renderer.numerics.simd import extract
@apart
def deep(x):
    return extract(x, 0)
""")
    (package / "callers.py").write_text("""
from renderer.jit.decorators import kernel
from renderer.far import deep
from renderer.numerics.simd import splat4
@kernel
def first(x):
    return deep(splat4(x))
""")
    program = "from renderer.callers import first\ntry: first(3.0)\nexcept Exception as error: print(error)"
    assert "got a vector" in " ".join(run(package, program))
