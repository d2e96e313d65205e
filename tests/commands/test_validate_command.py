"""``octree-validate``: finds the suite beside the renderer, whatever is called validation elsewhere, or says so."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TRAP = "raise SystemExit('the user's own package ran')"


def run(folder, *arguments, before="", package=ROOT):
    """The command in a folder, by the code of its console script, after some lines of Python."""
    code = ["import sys", f"sys.path.insert(0, {str(package)!r})", before, "from renderer.cli.validate import main"]
    command = [sys.executable, "-P", "-c", "\n".join([*code, "sys.exit(main())"]), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture
def project(tmp_path):
    """Another project, with a package of the suite's name."""
    (tmp_path / "validation").mkdir()
    (tmp_path / "validation" / "__init__.py").write_text(TRAP)
    (tmp_path / "validation" / "__main__.py").write_text(TRAP)
    return tmp_path


def test_a_folder_of_the_users_is_not_looked_into(project):
    for before in ("", f"import sys; sys.path.insert(0, {str(project)!r})"):
        done = run(project, "--help", before=before)
        assert done.returncode == 0 and "octree-validate" not in done.stderr and "--scene" in done.stdout
    script = Path(sys.executable).with_name("octree-validate")
    done = subprocess.run([script, "--help"], cwd=project, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0 and done.stdout.startswith("usage: octree-validate")


def test_a_package_of_that_name_imported_before_is_an_error_that_names_both(project):
    (project / "validation" / "__init__.py").write_text("")
    done = run(project, before=f"import sys; sys.path.insert(0, {str(project)!r}); import validation")
    assert done.returncode == 2 and done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert str(ROOT / "validation") in line and str(project / "validation") in line


@pytest.mark.parametrize("other", [True, False], ids=["another package", "none"])
def test_a_suite_that_is_not_there_is_an_error(tmp_path, other):
    shutil.copytree(ROOT / "renderer", tmp_path / "renderer", ignore=shutil.ignore_patterns("__pycache__"))
    if other:
        (tmp_path / "validation").mkdir()
        (tmp_path / "validation" / "__init__.py").touch()
    done = run(tmp_path, package=tmp_path)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"octree-validate: expected the validation suite in {tmp_path / 'validation'}, got ")
    assert line.endswith("pip install '.[validate]'; with a wheel: pip install 'FILE.whl[validate]'")


@pytest.mark.parametrize("module", ["validation", "validation.benchmark"])
def test_nothing_is_written_into_a_folder_that_is_no_checkout_unless_asked(tmp_path, module):
    script = f"import sys; sys.path.append({str(ROOT)!r}); from {module}.__main__ import main; sys.exit(main())"
    command = [sys.executable, "-P", "-c", script, "--quick"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2 and not list(tmp_path.iterdir())
    assert done.stderr.splitlines()[-1].endswith("--output: expected a folder, as this one is no checkout of "
                                                 "octree-renderer, got none")  # fmt: skip


def test_the_suites_own_scenes_are_asked_for_where_they_are_not_installed(tmp_path):
    for package in ("renderer", "validation"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    done = run(tmp_path, "--quick", "--output", "out", package=tmp_path)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("validation: expected --scene or --mesh, or the suite's own scenes in ")
