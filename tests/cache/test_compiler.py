"""How kernels are compiled: pieces and entries, what other kernels may do with them, and other versions of Numba."""

import gc
import operator
import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numba
import pytest
from numba.core import targetconfig
from numba.extending import intrinsic, overload

from renderer import Octree
from renderer.jit import compiler
from renderer.jit.notice import compile_seconds, compiling
from renderer.mesh.shapes import icosphere

ROOT = Path(__file__).parents[2]


def kernel(function, forceinline=False):
    """A kernel that is compiled in each process, whatever is on disk."""
    made = compiler.Kernel(function, forceinline)
    made.store.load_overload = made.store.keep = lambda *arguments: None
    return made


def inlined(function):
    return kernel(function, forceinline=True)


def attributes(made):
    """The LLVM attributes of a kernel's own function in its piece."""
    (compiled,) = made.piece.overloads.values()
    (function,) = [f for f in compiled.library._final_module.functions if not f.is_declaration]
    return set(function.attributes)


def test_only_what_is_decorated_so_is_inlined_by_force():
    """A kernel that an inlined one calls was inlined too, because Numba hands options on: rays 10 % slower."""

    @kernel
    def inner(x):
        return x * 3

    @inlined
    def middle(x):
        return inner(x) + 1

    @kernel
    def outer(x):
        return middle(x) * 2

    assert outer(2) == 14
    assert b"alwaysinline" in attributes(middle)
    assert b"alwaysinline" not in attributes(inner) | attributes(outer)


def test_constants_compile_a_kernel_once():
    @kernel
    def power(x, n):
        return x**n

    @kernel
    def sum_of_powers(x):
        return power(x, 1) + power(x, 2) + power(x, 3)

    assert sum_of_powers(2.0) == 14.0
    assert len(power.piece.overloads) == 1


def test_a_kernel_finds_what_was_declared_after_another_was_compiled():
    """Pieces remember how calls are typed, which must not hide that an operator means more by now."""

    @kernel
    def before(x):
        return abs(x) << 2

    @kernel
    def after(x):
        return abs(x) << 2

    @intrinsic
    def times(context, x, y):
        return x(x, x), lambda context, builder, signature, arguments: builder.fmul(*arguments)

    with pytest.raises(numba.TypingError):
        before(3.0)

    @overload(operator.lshift)
    def _shifted(x, y):
        return (lambda x, y: times(x, 2.0**y)) if x == numba.float64 else None

    assert after(-3.0) == 12.0


def test_an_overload_is_inlined_by_force_only_in_what_is_so():
    """Numba compiles it once for each, though the types of its call are remembered."""
    called = []

    def double(x):
        raise NotImplementedError

    @overload(double)
    def _double(x):
        called.append(targetconfig.ConfigStack.top_or_none().forceinline)
        return lambda x: 2 * x

    made = [kernel(lambda x: double(x)), inlined(lambda x: double(x) + 1), kernel(lambda x: double(x) + 2)]
    assert [one(3) for one in made] == [6, 7, 8]
    assert called == [False, True]


def test_a_call_with_keywords_is_typed_by_them():
    """The types of calls are remembered by their plain arguments, which are the same here."""

    def scaled(x, n):
        raise NotImplementedError

    @overload(scaled)
    def _scaled(x, n=1):
        return lambda x, n=1: x * n

    @kernel
    def both(x):
        return scaled(x, n=1) + scaled(x, n=2.5)

    assert both(2) == 7.0


def test_what_python_does_not_call_is_not_compiled_for_it():
    @kernel
    def below(x):
        return x + 1

    @kernel
    def above(x):
        return below(x) + 1

    assert above(1) == 3
    assert "entry" not in vars(below) and "piece" in vars(above)
    assert below(1) == 2 and below.__name__ == "below"


def test_a_kernel_that_cannot_be_compiled_says_so_each_time():
    @kernel
    def wrong(x):
        return x.no_such_attribute

    for _ in range(2):
        with pytest.raises(numba.core.errors.TypingError, match="no_such_attribute"):
            wrong(1.0)
    assert gc.isenabled()


def test_compiling_leaves_the_garbage_collector_as_it_was():
    @kernel
    def once(x):
        return x + 41

    gc.disable()
    try:
        assert once(1) == 42 and not gc.isenabled()
    finally:
        gc.enable()
    assert once(1.0) == 42.0 and gc.isenabled() and gc.get_freeze_count() == 0
    gc.freeze()
    try:
        assert once(1 + 0j) == 42 and gc.get_freeze_count() > 0
    finally:
        gc.unfreeze()


def test_the_time_of_a_kernel_compiled_within_another_counts_once():
    """A first picture once took -90 seconds, by ``Image.render_seconds``."""
    with suppress(ValueError), compiling("failed", None):
        raise ValueError
    began, before = time.perf_counter(), compile_seconds()
    with compiling("outer", None), compiling("inner", None):
        time.sleep(0.01)
    assert 0.01 <= compile_seconds() - before <= time.perf_counter() - began


def test_the_probe_finds_a_numba_that_fits_and_one_that_does_not(monkeypatch):
    before = compile_seconds()
    compiler.probe()
    assert compile_seconds() == before  # it is none of the user's kernels
    monkeypatch.setattr(compiler, "_PIECE_PASSES", compiler._PIECE_PASSES[1:])
    # Without the first pass the next one finds no bytecode.
    with pytest.raises(AttributeError, match="has no attribute 'arg_count'"):
        compiler.probe()


# What another version of Numba may have changed, before anything of ours is imported.
PRETEND = "import numba\nnumba.__version__ = '0.99.0'\n"
CHANGES = {
    "a name is gone": "import numba.core.environment as e\ndel e.lookup_environment\n",
    "stored kernels are made otherwise": "from numba.core.compiler import CompileResult\n"
    "CompileResult._rebuild = lambda *a: None\n",
}
ASK = """
from renderer.materials.dielectric import fresnel
print(fresnel(1.0, 1.0, 1.0, 1.5), fresnel(1.0, 1.0, 1.0, 1.5) == fresnel.py_func(1.0, 1.0, 1.0, 1.5))
"""


def ask(script: str, cache: Path) -> "subprocess.CompletedProcess[str]":
    environment = {"NUMBA_CACHE_DIR": str(cache), "PATH": "", "HOME": str(cache)}
    command = [sys.executable, "-c", script + ASK]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.parametrize("change", CHANGES)
def test_kernels_work_without_our_compiler_where_numba_has_changed(tmp_path, change):
    done = ask(PRETEND + CHANGES[change], tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[1] == "True" and abs(float(done.stdout.split()[0]) - 0.04) < 1e-15
    (line,) = done.stderr.splitlines()
    assert line.startswith("renderer: Numba 0.99.0 is not one of those that this version was made for (0.68.*): ")
    assert not list(tmp_path.rglob("*.kernel"))


def test_another_numba_that_fits_is_used_without_a_word_and_keeps_its_kernels(tmp_path):
    for told in (1, 0):
        done = ask(PRETEND, tmp_path)
        assert done.returncode == 0, done.stderr
        assert done.stderr.count("compiling kernels") == told == len(done.stderr.splitlines())
        assert done.stdout.split()[1] == "True"
    assert len(list(tmp_path.rglob("*.kernel"))) == 1


PLAIN_AFTER_OURS = """
import sys
import numpy as np
from numba import njit
from renderer import Octree
from renderer.trace.trees import tree_pointers
from renderer.trace.batch import check_rays
from renderer.trace.rays import HIT_ROWS, hit_pointers, batch_pointers
from renderer.trace.traverse import new_scratch, scratch_pointers, trace

@njit(error_model="numpy")
def mine(descriptor, rays, out, memory):
    tree = tree_pointers(descriptor)
    source, found = batch_pointers(rays, tree.scale), hit_pointers(out, len(rays[1]))
    trace(tree, source, found, 0, len(rays[1]), scratch_pointers(memory, source.starts), None)

octree, rays = Octree.load(sys.argv[1]), np.random.default_rng(0).normal(size=(50, 3)) * 3
expected = octree.closest_hit(rays, -rays)
octree.any_hit(rays, -rays)
out = np.zeros((HIT_ROWS, 50))
mine(octree.tree.descriptor, check_rays(rays, -rays, np.zeros(50), np.inf)[0], out, new_scratch(octree.tree.depth, 50))
print((out[0] == expected.t).all())
"""


def test_a_plain_kernel_calls_its_own_piece_and_not_one_that_was_optimised_within_another(tmp_path):
    """Compiled in one process both have one name; with arguments left out, as LLVM does inside, a call crashed."""
    environment, saved = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}, tmp_path / "sphere.octree"
    # Built here, so that only the kernels that trace are compiled there.
    Octree.from_mesh(icosphere(3)).save(saved)
    command = [sys.executable, "-P", "-c", PLAIN_AFTER_OURS, str(saved)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert done.stdout == "True\n", done.stderr
