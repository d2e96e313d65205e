"""The command that runs trimesh's own tests with the drop-in: its counts, exit codes, and words for a wrong path.

The checkout here is made up; a real one is not at hand in CI.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from validation.conformance import FILES, KNOWN

ROOT = Path(__file__).parents[2]
PASSES = """
import generic as g
def test_the_drop_in_is_installed():
    assert g.trimesh.creation.box().ray.__class__.__module__ == "renderer.trimesh_ray.intersector"
    assert g.trimesh.proximity.closest_point.__module__ == "renderer.trimesh_ray.distances"
"""


def run(folder: Path, **files: str) -> "subprocess.CompletedProcess[str]":
    tests = folder / "tests"
    tests.mkdir()
    (tests / "generic.py").write_text("import trimesh\n")
    for name in FILES:
        (tests / name).write_text(files.get(name.removesuffix(".py"), ""))
    return subprocess.run(
        [sys.executable, "-m", "validation.conformance", str(folder)],
        cwd=ROOT, capture_output=True, text=True, timeout=200, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip


def test_all_that_pass_are_counted(tmp_path: Path) -> None:
    skipped = "import pytest\ndef test_other(): pytest.skip('no model')\n"
    done = run(tmp_path, test_ray=PASSES, test_voxel=skipped)
    assert done.returncode == 0, done.stdout
    assert done.stdout.splitlines()[-1] == "1 passed, 0 failed, 1 skipped; 0 failures known"


@pytest.mark.parametrize("broken", ["def test_it(): assert False\n", "import no_such_module\n"])
def test_failures_are_named_and_end_with_1(tmp_path: Path, broken: str) -> None:
    done = run(tmp_path, test_ray=PASSES, test_sample=broken)
    assert done.returncode == 1
    assert "failed: tests/test_sample.py" in done.stdout
    assert done.stdout.splitlines()[-1] == "1 passed, 1 failed, 0 skipped; 0 failures known"


def test_a_known_difference_is_told_with_its_reason(tmp_path: Path) -> None:
    ((name, reason),) = KNOWN.items()
    done = run(tmp_path, test_ray=PASSES, test_proximity=f"class TestIt:\n    def {name}(self): assert False\n")
    assert done.returncode == 0
    assert f"(known: {reason})" in done.stdout
    assert done.stdout.splitlines()[-1] == "1 passed, 1 failed, 0 skipped; 1 failures known"
