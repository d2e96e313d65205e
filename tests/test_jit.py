"""The kernel cache: an edit of any source below a kernel shows, an edit beside it costs nothing."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from renderer.jit import _imports, source_digest

PACKAGE = Path(__file__).parents[1] / "renderer"

# One small kernel two imports away from the constant it uses, so that each run compiles in a second.
UPPER = '''
from renderer.jit import kernel
from renderer.middle import (
    doubled,
)
@kernel
def answer(x):
    return doubled(x) + 1
'''
MIDDLE = '''
from renderer.jit import kernel
from renderer.bottom import STEP
@kernel
def doubled(x):
    return 2 * x + STEP
'''
RUN = """
from renderer.upper import answer
print(answer(3), sum(answer.stats.cache_hits.values()), sum(answer.stats.cache_misses.values()))
"""
TELL = """
import logging, sys
logging.basicConfig(level=logging.INFO, stream=sys.stdout, format="%(message)s")
"""
TOLD = ["compiling", "answer"]


@pytest.fixture
def package(tmp_path):
    """The package's own jit.py with three modules above it, alone in a folder."""
    folder = tmp_path / "renderer"
    folder.mkdir()
    shutil.copy(PACKAGE / "jit.py", folder)
    (folder / "__init__.py").touch()
    (folder / "upper.py").write_text(UPPER)
    (folder / "middle.py").write_text(MIDDLE)
    (folder / "bottom.py").write_text("STEP = 10\n")
    (folder / "aside.py").write_text("STEP = 10\n")
    return folder


def run(folder, script, **environment):
    command, own = [sys.executable, "-B", "-c", script], {**os.environ, **environment}
    done = subprocess.run(command, cwd=folder.parent, env=own, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_an_edit_below_a_kernel_shows_and_an_edit_beside_it_keeps_the_cache(package):
    assert run(package, RUN) == ["17", "0", "1"]
    assert run(package, RUN) == ["17", "1", "0"]
    (package / "aside.py").write_text("STEP = 11\n")
    assert run(package, RUN) == ["17", "1", "0"]
    (package / "bottom.py").write_text("STEP = 20\n")
    assert run(package, RUN) == ["27", "0", "1"]
    (package / "bottom.py").write_text("STEP = 10\n")
    assert run(package, RUN)[0] == "17"
    (package / "middle.py").write_text(MIDDLE.replace("2 * x", "5 * x"))
    assert run(package, RUN) == ["26", "0", "1"]
    (package / "upper.py").write_text(UPPER.replace("+ 1", "+ 2"))
    assert run(package, RUN) == ["27", "0", "1"]


def test_an_edit_of_the_real_triangle_test_shows(tmp_path):
    # The whole package, where the kernel that runs is two modules above the one edited.
    folder = tmp_path / "renderer"
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    script = """
from renderer.octree import BruteForce
brute = BruteForce([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], threads=1)
print(brute.any_hit([[0.25, 0.25, 1]], [[0, 0, -1]])[0])
"""
    assert run(folder, script) == ["True"]
    source = (folder / "intersect.py").read_text()
    edited = source.replace("determinant != zero", "determinant != determinant")
    assert edited != source
    (folder / "intersect.py").write_text(edited)
    assert run(folder, script) == ["False"]


def digests(folder):
    modules = [path.stem for path in folder.glob("*.py")]
    tell = f"for m in {modules!r}: print(source_digest(Path('renderer').resolve() / (m + '.py')))"
    out = run(folder, f"from pathlib import Path\nfrom renderer.jit import _imports, source_digest\n{tell}")
    return dict(zip(modules, out, strict=True))


def test_a_digest_covers_exactly_the_modules_that_are_imported(tmp_path):
    folder = tmp_path / "renderer"
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "__init__.py").write_text("")
    before = digests(folder)
    for edited in ("layout", "cli"):
        with (folder / f"{edited}.py").open("a") as source:
            source.write("\n# edited\n")
    after = digests(folder)
    changed = {module for module in before if before[module] != after[module]}
    assert {"layout", "intersect", "traverse", "batch", "build", "whitted", "cli"} <= changed
    assert not changed & {"simd", "jit", "errors", "mesh", "vec3", "parallel"}


def package_imports(path):
    """The modules of the package that a source imports, by Python's own parser; refuses what the digest cannot see."""
    found, tree = set(), ast.parse(path.read_text())
    within = {node for outer in ast.walk(tree) if isinstance(outer, ast.FunctionDef) for node in ast.walk(outer)}
    # What is imported inside a function, a kernel cannot use.
    for node in (node for node in ast.walk(tree) if node not in within):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}:{node.lineno}: a relative import"
            names = [node.module]
        else:
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        for name in names:
            if name.partition(".")[0] == "renderer":
                assert isinstance(node, ast.ImportFrom), f"{path.name}:{node.lineno}: import {name}"
                assert name.count(".") == 1, f"{path.name}:{node.lineno}: from {name}"
                found |= {name.split(".")[1]} if node.col_offset == 0 else set()
    return found


@pytest.mark.parametrize("path", [p for p in PACKAGE.glob("*.py") if p.stem != "__init__"], ids=lambda p: p.stem)
def test_every_import_in_the_package_has_the_form_that_the_digest_follows(path):
    assert {p.stem for p in _imports(path)} == package_imports(path)


@pytest.mark.parametrize(
    "line",
    ["from . import jit", "from .jit import kernel", "import renderer.jit as j", "from renderer import jit",
     "import numpy, renderer.jit", "if True:\n    from renderer.viewer.page import x"],
)  # fmt: skip
def test_forms_that_the_digest_does_not_follow_are_found(tmp_path, line):
    (tmp_path / "a.py").write_text(line)
    with pytest.raises(AssertionError, match=r"a\.py:"):
        package_imports(tmp_path / "a.py")


def test_an_unknown_module_has_the_digest_of_nothing():
    assert source_digest(PACKAGE / "no_such_module.py") != source_digest(PACKAGE / "jit.py")


def test_a_renamed_module_below_a_kernel_shows(package):
    assert run(package, RUN) == ["17", "0", "1"]
    (package / "bottom.py").rename(package / "floor.py")
    (package / "middle.py").write_text(MIDDLE.replace("renderer.bottom", "renderer.floor"))
    assert run(package, RUN) == ["17", "0", "1"]
    (package / "floor.py").write_text("STEP = 20\n")
    assert run(package, RUN) == ["27", "0", "1"]


def test_another_compiler_version_shows(package):
    pretend = "import llvmlite\nllvmlite.__version__ = '99.0'\n"
    assert run(package, RUN) == ["17", "0", "1"]
    assert run(package, pretend + RUN) == ["17", "0", "1"]
    assert run(package, pretend + RUN) == ["17", "1", "0"]


def test_a_kernel_of_another_package_follows_ours(package):
    # By an import that the digest need not follow: it covers all of ours.
    ours = "from renderer.middle import (\n    doubled,\n)"
    mine = UPPER.replace(ours, "import renderer.middle as m\ndoubled = m.doubled")
    assert mine != UPPER
    (package.parent / "mine.py").write_text(mine)
    script = RUN.replace("renderer.upper", "mine")
    assert run(package, script) == ["17", "0", "1"]
    assert run(package, script) == ["17", "1", "0"]
    (package / "bottom.py").write_text("STEP = 20\n")
    assert run(package, script) == ["27", "0", "1"]


def test_code_never_outlives_its_sources(package):
    """A process of older sources, or one killed between the index and the code, leaves an index that names old code."""
    assert run(package, RUN) == ["17", "0", "1"]
    cached = package / "__pycache__"
    old = {path.name: path.read_bytes() for path in cached.glob("*.nbc")}
    (package / "bottom.py").write_text("STEP = 20\n")
    assert run(package, RUN) == ["27", "0", "1"]
    new = [path for path in cached.glob("upper.answer*.nbc")]
    assert len(new) == 1 and not old.keys() & {path.name for path in cached.glob("*.nbc")}
    for name, code in old.items():
        (cached / name).write_bytes(code)
    new[0].unlink()
    assert run(package, RUN) == ["27", "0", "1"]


def test_a_folder_that_cannot_be_written_falls_back_to_the_users_own(package, tmp_path):
    (package / "__pycache__").write_text("a file in the way, because root may write anywhere")
    users = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "NUMBA_CACHE_DIR": ""}
    assert run(package, RUN, **users) == ["17", "0", "1"]
    assert run(package, RUN, **users) == ["17", "1", "0"]
    assert list((tmp_path / "cache" / "numba").rglob("upper.answer*.nbc"))
    (package / "bottom.py").write_text("STEP = 20\n")
    assert run(package, RUN, **users) == ["27", "0", "1"]
    (tmp_path / "blocked").touch()
    nowhere = {**users, "XDG_CACHE_HOME": str(tmp_path / "blocked")}
    for _ in range(2):
        told = " ".join(run(package, TELL + RUN, **nowhere))
        assert told == "compiling answer (for this process only: no cache folder can be written) 27 0 1"


def test_what_is_compiled_is_logged_and_what_is_loaded_is_not(package):
    kept = f"(once, kept in {package / '__pycache__'})"
    assert run(package, TELL + RUN) == [*TOLD, *kept.split(), "17", "0", "1"]
    assert run(package, TELL + RUN) == ["17", "1", "0"]


def test_two_processes_that_compile_at_the_same_time_agree(package):
    command = [sys.executable, "-B", "-c", RUN]
    both = [subprocess.Popen(command, cwd=package.parent, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    for process in both:
        out, _ = process.communicate(timeout=100)
        assert process.returncode == 0 and out.split()[0] == "17"
    assert run(package, RUN) == ["17", "1", "0"]
