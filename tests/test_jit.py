"""The kernel cache: an edit of any source below a kernel shows, an edit beside it costs nothing."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from renderer.jit import source_digest

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


def run(folder, script):
    done = subprocess.run(
        [sys.executable, "-B", "-c", script], cwd=folder.parent, capture_output=True, text=True, timeout=100
    )
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
    out = run(folder, f"from renderer.jit import source_digest\nfor m in {modules!r}: print(source_digest(m))")
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


def test_every_import_in_the_package_has_the_form_that_the_digest_follows():
    for path in PACKAGE.glob("*.py"):
        for line in path.read_text().splitlines():
            if re.match(r"\s*(from|import)\b.*\brenderer\b", line) and path.stem != "__init__":
                assert re.match(r"from renderer\.\w+ import ", line.lstrip()), f"{path.name}: {line}"


def test_an_unknown_module_has_the_digest_of_nothing():
    assert source_digest("no_such_module") != source_digest("jit")
