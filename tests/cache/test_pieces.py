"""Pieces on disk: what another process typed and lowered is read, unless something that decides it has changed."""

import pytest
from kernel_package import run, start, write_package

BELOW = """
from renderer.jit.decorators import kernel
from renderer.below.deep.bottom import STEP
@kernel
def cubed(x):
    return x ** 3 + STEP
@kernel
def doubled(x):
    return 2 * cubed(x)
"""
CALLERS = """
from renderer.jit.decorators import kernel
from renderer.under import cubed, doubled
@kernel
def fourth(x):
    return x ** 3 * x
@kernel
def first(x):
    return doubled(x) + 1
@kernel
def second(x):
    return fourth(x) + doubled(x)
"""
# Prints the answer, and for each function how often it was typed and lowered.
RUN = """
from renderer.callers import {name}
from renderer.under import cubed, doubled
print({name}(3), *(sum(one.piece.stats.cache_misses.values()) for one in (doubled, cubed)))
"""
FIRST, SECOND = RUN.format(name="first"), RUN.format(name="second")


@pytest.fixture
def package(tmp_path):
    return write_package(tmp_path, under=BELOW, callers=CALLERS)


def pieces(package):
    return sorted((package / "__pycache__").glob("*.piece"))


def test_another_kernel_that_contains_them_reads_them(package):
    """Others are compiled before them, and Numba's own function for a power again."""
    assert run(package, FIRST) == ["75", "1", "1"]
    assert run(package, SECOND) == ["155", "0", "0"]


def test_machine_code_of_what_was_read_is_that_of_what_was_made(package, tmp_path):
    """If it contains no function of Numba's own, of which each piece brings its copy."""
    for source in (package / "under.py", package / "callers.py"):
        source.write_text(source.read_text().replace("x ** 3", "x * x * x"))
    code = """
(compiled,) = second.entry.overloads.values()
print(compiled.library._get_compiled_object().hex())
"""
    assert run(package, FIRST) == ["75", "1", "1"]
    *answer, read = run(package, SECOND + code)
    *alone, made = run(package, SECOND + code, NUMBA_CACHE_DIR=str(tmp_path / "empty"))
    assert (answer, alone) == (["155", "0", "0"], ["155", "1", "1"])
    assert read == made


def test_one_fits_what_it_contains_also_if_that_is_made_anew(package):
    """As by two processes at once: its name is the same in each."""
    assert run(package, FIRST) == ["75", "1", "1"]
    for path in pieces(package):
        if "cubed" in path.name:
            path.unlink()
    assert run(package, SECOND) == ["155", "0", "1"]


def test_one_that_calls_itself_is_read_too(package):
    text = (package / "under.py").read_text()
    (package / "under.py").write_text(text.replace("return 2 * cubed(x)", "return x if x < 2 else doubled(x - 1) + 5"))
    assert run(package, FIRST) == ["12", "1", "0"]
    assert run(package, SECOND) == ["92", "0", "0"]


def test_an_edit_below_them_shows(package):
    assert run(package, FIRST) == ["75", "1", "1"]
    before = {path for path in pieces(package) if "under" in path.name}
    (package / "below" / "deep" / "bottom.py").write_text("STEP = 20\n")
    assert run(package, SECOND) == ["175", "1", "1"]
    after = {path for path in pieces(package) if "under" in path.name}
    assert len(after) == len(before) == 2 and not before & after


def test_a_damaged_one_is_said_once_and_made_anew(package):
    assert run(package, FIRST) == ["75", "1", "1"]
    for path in pieces(package):
        path.write_bytes(path.read_bytes()[:-1])
    done = start(package, SECOND)
    assert done.stdout.split() == ["155", "1", "1"]
    assert done.stderr.count("is damaged") == 1


def test_a_script_of_another_package_has_none_and_runs_once(package):
    """To read one that was kept when the script was imported imported it again, and ran it twice."""
    (package.parent / "script.py").write_text("""
from renderer.jit.decorators import kernel
@kernel
def inner(x): return x + 1
@kernel
def middle(x): return 2 * inner(x)
@kernel
def first(x): return middle(x)
@kernel
def second(x): return middle(x) + 1
print(second(3) if __name__ == "__main__" else first(3))
""")
    assert run(package, "import script") == ["8"]
    done = start(package, "import runpy; runpy.run_path('script.py', run_name='__main__')")
    assert done.stdout.split() == ["9"] and "is damaged" not in done.stderr
    assert not list(package.parent.glob("__pycache__/*.piece"))


def test_one_in_another_package_does_not_contain_what_was_edited(package):
    mine = "from renderer.jit.decorators import kernel\nfrom theirs import deep\n"
    theirs = "from renderer.jit.decorators import kernel\n@kernel\ndef deep(x): return x + 5\n"
    (package.parent / "theirs.py").write_text(theirs)
    (package.parent / "mine.py").write_text(mine + "@kernel\ndef middle(x): return 2 * deep(x)\n")
    for name in ("one", "two"):
        caller = mine.replace("theirs", "mine").replace("deep", "middle")
        (package.parent / f"{name}.py").write_text(f"{caller}@kernel\ndef top(x): return middle(x)\n")
    assert run(package, "from one import top; print(top(3))") == ["16"]
    (package.parent / "theirs.py").write_text(theirs.replace("+ 5", "+ 50"))
    done = start(package, "from two import top; print(top(3))")
    assert done.stdout.split() == ["106"] and "is damaged" not in done.stderr


def test_one_whose_callee_no_digest_follows_is_made_anew_after_an_edit(package):
    """What it calls has another name then."""
    unseen = BELOW.replace("from renderer.below.deep.bottom import STEP", "STEP = 10")
    (package / "unseen.py").write_text(unseen)
    (package / "under.py").write_text(
        "import importlib\nfrom renderer.jit.decorators import kernel\n"
        "cubed = importlib.import_module('renderer.unseen').cubed\n@kernel\ndef doubled(x): return 2 * cubed(x)\n"
    )
    assert run(package, FIRST) == ["75", "1", "1"]
    (package / "unseen.py").write_text(unseen.replace("10", "20"))
    done = start(package, SECOND)
    assert done.stdout.split() == ["175", "1", "1"] and "is damaged" not in done.stderr


@pytest.mark.parametrize(
    ("text", "call"),
    [("S = 1\n", "kind, x"), ("import enum\nclass E(enum.Enum):\n    S = 1\n", "kind.E, x")],
    ids=["module", "enumeration"],
)
def test_values_that_an_argument_brings_are_those_of_its_sources(package, text, call):
    member = "m.S" if "class" not in text else "m.S.value"
    (package / "kind.py").write_text(text)
    (package / "under.py").write_text(
        f"from renderer.jit.decorators import kernel\n@kernel\ndef deep(m, x): return x + {member}\n"
    )
    (package / "callers.py").write_text(
        "from renderer.jit.decorators import kernel\nfrom renderer import kind\nfrom renderer.under import deep\n"
        f"@kernel\ndef top(x): return deep({call})\n"
    )
    program = "from renderer.callers import top; print(top(10))"
    assert run(package, program) == ["11"]
    (package / "kind.py").write_text(text.replace("S = 1", "S = 5"))
    assert run(package, program) == ["15"]


def test_classes_of_one_name_in_one_module_are_two_types(package):
    (package / "under.py").write_text("""
from collections import namedtuple
from renderer.jit.decorators import kernel
A, B = namedtuple("P", "u v"), namedtuple("P", "v u")
@kernel
def cubed(p): return p.u - p.v
@kernel
def doubled(x): return cubed(A(x, 1)) + 100 * cubed(B(x, 1))
""")
    assert run(package, FIRST) == ["-197", "1", "2"]


def test_code_that_checks_bounds_is_kept_apart(package):
    (package / "under.py").write_text("""
from renderer.jit.decorators import kernel
@kernel
def cubed(a): return a[3]
@kernel
def doubled(a): return cubed(a)
""")
    for name in ("first", "second"):
        (package / f"{name}.py").write_text(
            "from renderer.jit.decorators import kernel\nfrom renderer.under import doubled\n"
            "@kernel\ndef top(a): return doubled(a)\n"
        )
    program = """
import numpy as np
from renderer.{name} import top
try: print(top(np.arange(4)[:3]))
except IndexError: print("refused")
"""
    assert run(package, program.format(name="first")) == ["3"]
    for name in ("first", "second"):
        assert run(package, program.format(name=name), NUMBA_BOUNDSCHECK="1") == ["refused"]


def test_one_that_contains_a_nested_kernel_is_not_kept(package):
    """Two nested kernels may have one name, so no other process could know which it is."""
    (package / "under.py").write_text("""
from renderer.jit.decorators import kernel
def made(step):
    @kernel
    def nested(x):
        return x + step
    return nested
nested = made(4)
@kernel
def cubed(x):
    return nested(x)
@kernel
def doubled(x):
    return 2 * cubed(x)
""")
    assert run(package, FIRST) == ["15", "1", "1"]
    assert [path.name.split("-")[0] for path in pieces(package)] == []
    assert run(package, SECOND) == ["95", "1", "1"]


def test_a_folder_that_is_carried_away_gets_none(package, tmp_path):
    folder = tmp_path / "carried"
    folder.mkdir()
    chosen = f"from pathlib import Path\nfrom renderer.jit.cache import keep_in\nkeep_in(Path({str(folder)!r}))\n"
    assert run(package, chosen + FIRST) == ["75", "1", "1"]
    assert len(list(folder.iterdir())) == 1 + (folder / "compiling.lock").exists()
