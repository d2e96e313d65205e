"""Whose kernel a kept kernel is: never that of other sources, another function of its name, or other values."""

import os
import shutil
import zipapp
import zipfile

import pytest
from kernel_package import COMPILED, LOADED, RUN, bottom_of, run, start, write_package

# A package's own loggers say what is not kept.
UNKNOWN = "compiled kernels are neither kept nor looked for"


@pytest.fixture
def package(tmp_path):
    return write_package(tmp_path)


def mine(package, text, arguments=""):
    """What a script with kernels of its own prints, run from its own file."""
    path = package.parent / "mine.py"
    path.write_text(f"import sys\nfrom renderer.jit.decorators import kernel\n{text}")
    return run(
        package, f"import runpy, sys; sys.argv = ['mine.py', *'{arguments}'.split()]; runpy.run_path({str(path)!r})"
    )


def test_sources_edited_after_they_were_loaded_are_not_taken_for_those_that_run(package):
    """An editor saves, or git pulls, between the import and the first call."""
    edit = (
        "import renderer.upper, time; time.sleep(0.1)\n"
        + f"open({str(bottom_of(package))!r}, 'w').write('STEP = 20')\n"
    )
    done = start(package, edit + RUN)
    assert done.stdout.split() == COMPILED
    assert "bottom.py was written after this process began" in done.stderr
    assert done.stderr.count(UNKNOWN) == 1
    # Of the edited sources no other process finds the old code.
    assert run(package) == ["27", "0", "1"]


def test_a_file_from_the_future_stops_nothing(package):
    os.utime(bottom_of(package), (2e9, 2e9))
    for _ in range(2):
        assert run(package) == COMPILED


def zipped(package, target):
    zipapp.create_archive(
        package.parent, target, main="renderer.upper:answer", filter=lambda p: p.parts[0] == "renderer"
    )
    with zipfile.ZipFile(target) as archive:
        assert "renderer/upper.py" in archive.namelist()


def test_code_without_readable_sources_is_never_kept(package, tmp_path):
    """In a zip no source can be read, so two versions cannot be told apart."""
    aside = tmp_path / "aside"
    for step, answer in ((10, "17"), (20, "27")):
        bottom_of(package).write_text(f"STEP = {step}\n")
        zipped(package, tmp_path / "renderer.zip")
        package.rename(aside)
        done = start(package, RUN, PYTHONPATH=str(tmp_path / "renderer.zip"), XDG_CACHE_HOME=str(tmp_path / "cache"))
        assert done.stdout.split() == [answer, "0", "1"]
        assert done.stderr.count(UNKNOWN) == 1
        aside.rename(package)
    assert not list(tmp_path.rglob("*.kernel"))


def test_kernels_of_a_factory_are_told_apart_and_not_kept(package):
    text = """
def make(factor):
    @kernel
    def scaled(x):
        return factor * x
    return scaled
print(make(2)(10), make(3)(10), make(2)(10))
"""
    for _ in range(2):
        assert mine(package, text) == ["20", "30", "20"]
    assert not list(package.parent.glob("__pycache__/mine.*.kernel"))


def test_kernels_of_no_file_are_not_kept(package):
    """Every ``python -c`` is called <string>."""
    for step in (1, 200):
        script = "from renderer.jit.decorators import _decorated as d\n"
        script += f"exec('def f(x): return x + {step}')\nprint(d(f, False)(1))"
        assert run(package, script) == [str(1 + step)]
    assert not list(package.parent.rglob("*.kernel"))


@pytest.mark.parametrize("folder", ["locked/cache", "n" * 300])
@pytest.mark.parametrize("variable", ["HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR", "OCTREE_RENDERER_KERNELS"])
def test_a_folder_that_may_not_be_looked_at_counts_as_absent(package, tmp_path, variable, folder):
    """A service that inherits the home of root; root itself may look everywhere, so its refusal is faked."""
    refuse = """
import pathlib
sound = pathlib.Path.stat
def stat(path, **options):
    if "locked" in path.parts: raise PermissionError(13, "Permission denied", str(path))
    return sound(path, **options)
pathlib.Path.stat = stat
"""
    chosen = {"XDG_CACHE_HOME": "", variable: str(tmp_path / folder)}
    assert run(package, refuse + RUN, **chosen) == COMPILED


def test_a_relative_cache_folder_stays_where_it_was_when_the_process_moves(package, tmp_path):
    (tmp_path / "other").mkdir()
    script = f"import os, renderer.middle as m\nassert m.doubled(3) == 16\nos.chdir({str(tmp_path / 'other')!r})\n"
    assert run(package, script + RUN, NUMBA_CACHE_DIR="kept") == COMPILED
    assert run(package, script + RUN, NUMBA_CACHE_DIR="kept") == LOADED
    assert not list((tmp_path / "other").iterdir())


def test_a_source_that_is_no_utf_8_is_read_all_the_same(package):
    path = package.parent / "latin.py"
    path.write_bytes(
        b"# -*- coding: latin-1 -*-\n# \xe9t\xe9\n"
        b"from renderer.jit.decorators import kernel\n@kernel\ndef one(): return 1\n"
    )
    assert run(package, "import latin; print(latin.one())") == ["1"]


def test_a_path_that_is_no_text_is_a_path_like_any_other(tmp_path):
    odd = tmp_path / os.fsdecode(b"b\xff")
    odd.mkdir()
    package = write_package(odd)
    assert run(package) == COMPILED
    assert run(package) == LOADED
    shutil.rmtree(odd)


def test_numba_without_its_compiler_is_said_in_one_line(package):
    script = "try:\n    import renderer.upper\nexcept ImportError as error:\n    print(error)"
    said = " ".join(run(package, script, NUMBA_DISABLE_JIT="1"))
    assert said == "renderer: NUMBA_DISABLE_JIT is set, but kernels run only compiled: unset it"


def test_a_module_that_is_edited_and_loaded_again_runs_as_it_is_now(package):
    """Its file's digest was that of the first text for the rest of the process."""
    text = "from renderer.jit.decorators import kernel\n@kernel\ndef top(x): return x + 5\n"
    (package.parent / "own.py").write_text(text)
    script = f"""
import importlib, own
print(own.top(3))
open(own.__file__, "w").write({text.replace("+ 5", "+ 500")!r})
print(importlib.reload(own).top(3))
"""
    assert run(package, script) == ["8", "503"]


# Callers in a file of their own, what they import or get, and edits of that, which leave each text as long as it was.
TOP = "from renderer.jit.decorators import kernel\n"
CALLER = f"{TOP}from theirs import STEP, Pair, deep\n"
THEIRS = f"""{TOP}
import enum
import os
import theirs as itself
from numba.extending import register_jitable
from typing import NamedTuple
import numpy as np
class Pair(NamedTuple):
    first: int
    second: int
STEP, TABLE = int(os.environ.get("STEP") or 5), np.array([5.0, 6.0])
STEPS = STEP, 6
@kernel
def deep(x): return x + 5
@kernel
def deeper(x): return x + STEP
def make(step):
    @kernel
    def made(x): return x + step
    return made
made = make(STEP)
class Turned(NamedTuple):
    second: int
    first: int
ONE = Pair(5, 6)
call = min if STEP == 5 else max
@register_jitable
def plain(x): return x + 5
class Step(enum.IntEnum):
    ONE = STEP
@kernel
def usual(x, more=STEP): return x + more
nested = ((1, 2), 3) if STEP == 5 else ((1, 2, 3),)
"""
BRANCH = f"""{TOP}
import os
if os.environ.get("STEP"):
    @kernel
    def top(x): return x + int(7)
else:
    @kernel
    def top(x): return x + int(5)
"""
EDIT, TURN = ("5", "7"), ("first: int\n    second", "second: int\n    first")


@pytest.mark.parametrize(
    ("caller", "call", "answers", "edit", "step"),
    [
        (f"{CALLER}@kernel\ndef top(x): return deep(x)", "top(3)", ("8", "10"), EDIT, ""),
        (f"{CALLER}@kernel\ndef top(x): return x + STEP", "top(3)", ("8", "10"), None, "7"),
        (f"{TOP}import theirs\n@kernel\ndef top(x): return x + theirs.itself.STEP", "top(3)", ("8", "10"), None, "7"),
        (f"{TOP}from theirs import TABLE\n@kernel\ndef top(x): return x + TABLE[0]", "top(3)", ("8.0", "10.0"),
         EDIT, ""),
        (f"{CALLER}@kernel\ndef top(x): return Pair(x, 2 * x).first", "top(3)", ("3", "6"), TURN, ""),
        (f"{CALLER}@kernel\ndef top(f, x): return f(x)", "top(theirs.deep, 3)", ("8", "10"), EDIT, ""),
        (f"{CALLER}@kernel\ndef top(f, x): return f(x)", "top(theirs.deeper, 3)", ("8", "10"), None, "7"),
        (f"{TOP}from theirs import STEPS\n@kernel\ndef top(x): return x + STEPS[0]", "top(3)", ("8", "10"), None, "7"),
        (f"{TOP}from theirs import made\n@kernel\ndef top(x): return made(x)", "top(3)", ("8", "10"), None, "7"),
        (f"{CALLER}@kernel\ndef top(p, q): return p.first - q.first",
         "top(Pair(1, 2), theirs.Turned(3, 4))", ("-3", "-2"), TURN, ""),
        (f"{TOP}from theirs import ONE\n@kernel\ndef top(x): return x + ONE.first", "top(3)", ("8", "9"), TURN, ""),
        (f"{TOP}from theirs import call\n@kernel\ndef top(x): return call(x, 9)", "top(3)", ("3", "9"), None, "7"),
        (f"{TOP}from theirs import plain\n@kernel\ndef top(x): return plain(x)", "top(3)", ("8", "10"), EDIT, ""),
        (f"{TOP}from theirs import Step\n@kernel\ndef top(x): return x + Step.ONE", "top(3)", ("8", "10"), None, "7"),
        (f"{TOP}from theirs import usual\n@kernel\ndef top(x): return usual(x)", "top(3)", ("8", "10"), None, "7"),
        (f"{TOP}from theirs import nested\n@kernel\ndef top(x): return x + len(nested)",
         "top(3)", ("5", "4"), None, "7"),
        (BRANCH, "top(3)", ("8", "10"), None, "7"),
        (f"{BRANCH}@kernel\ndef outer(x): return top(x)", "outer(3)", ("8", "10"), None, "7"),
    ],
    ids=["callee", "constant", "module", "array", "class", "argument", "argument's constant", "tuple", "factory",
         "two classes", "value of a class", "builtin", "function", "enumeration", "default", "lengths", "branch",
         "branch below"],
)  # fmt: skip
def test_a_kernel_of_another_package_follows_what_it_names(package, caller, call, answers, edit, step):
    """Its own file is the same in both runs; a third run reads what the second wrote."""
    (package.parent / "theirs.py").write_text(THEIRS)
    (package.parent / "own.py").write_text(caller)
    entry = call[: call.index("(")]
    script = f"import theirs\nfrom own import *\nprint({call}, sum({entry}.entry.stats.cache_hits.values()))"
    assert run(package, script) == [answers[0], "0"]
    if edit is not None:
        (package.parent / "theirs.py").write_text(THEIRS.replace(*edit))
    assert run(package, script, STEP=step) == [answers[1], "0"]
    assert run(package, script, STEP=step) == [answers[1], "1"]


def test_a_kernel_that_names_a_value_of_unknown_kind_is_not_kept(package):
    theirs = "import numba\n@numba.vectorize\ndef plain(x): return x + 5\n"
    (package.parent / "own.py").write_text(f"{TOP}from theirs import plain\n@kernel\ndef top(x): return plain(x)")
    for text, answer in ((theirs, "8"), (theirs.replace(*EDIT), "10")):
        (package.parent / "theirs.py").write_text(text)
        assert run(package, "from own import top\nprint(top(3))") == [answer]
    assert not list(package.parent.rglob("own.*.kernel"))


def test_classes_that_are_exchanged_are_told_apart(package):
    text = """
from collections import namedtuple
one, two = namedtuple("P", "x y"), namedtuple("P", "y x")
@kernel
def top(p, q): return 10 * p.x + q.x
print(top(one(1, 2), two(3, 4)), top(two(1, 2), one(3, 4)))
"""
    assert mine(package, text) == ["14", "23"]


def test_a_constant_that_changes_in_a_process_spoils_no_later_one(package):
    """The first value is that of what was compiled with it."""
    text = "STEP = 1\n@kernel\ndef low(x): return x * STEP\n@kernel\ndef one(x): return low(x)\n@kernel\n"
    text += "def two(x): return low(x)\nif sys.argv[1:]: one(3)\nSTEP = 2\nprint(two(3))"
    mine(package, text, "early")
    assert mine(package, text) == ["6"]


def test_kernels_of_one_name_in_one_file_are_told_apart(package):
    text = """
small, large = kernel(lambda x: x + 1), kernel(lambda x: x + 100)
@kernel
def top(x): return x + 1
first = top
@kernel
def top(x): return x + 100
print(small(1), large(1), first(1), top(1))
"""
    for _ in range(2):
        assert mine(package, text) == ["2", "101", "2", "101"]


def test_a_file_in_the_place_of_another_kernel_s_is_not_taken_for_it(package):
    text = f"{TOP}@kernel\ndef up(x): return x + 1\n@kernel\ndef down(x): return x - 1\n"
    (package / "both.py").write_text(text)
    script = "from renderer.both import *; print(up(5), down(5))"
    assert run(package, script) == ["6", "4"]
    up, down = (next(package.glob(f"__pycache__/renderer.both.{name}-*.kernel")) for name in ("up", "down"))
    shutil.copy(up, down)
    assert run(package, script) == ["6", "4"]


@pytest.mark.parametrize(
    "text",
    [
        "@kernel\ndef even(n): return True if n == 0 else odd(n - 1)\n"
        "@kernel\ndef odd(n): return False if n == 0 else even(n - 1)\ncall = lambda: even(4)",
        "@kernel\ndef down(n, x): return x * 1.0 if n == 0 else down(n - 1, x * 0.5)\ncall = lambda: down(4, 3)",
    ],
    ids=["in turn", "other types"],
)
def test_recursion_that_cannot_be_linked_is_refused(package, text):
    """It ended the process, or the next one."""
    text += "\ntry:\n    print(call())\nexcept Exception as error:\n    print('expected calls of itself' in str(error))"
    for _ in range(2):
        assert mine(package, text) == ["True"]
