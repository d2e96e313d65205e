"""Processes that the package starts: they import what their parent has, and nothing from the current folder."""

import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from time import perf_counter

import pytest

import renderer
from renderer import precompile
from renderer.shade.tile import render_tile
from renderer.system import child

ROOT = Path(__file__).parents[2]
# A command needs all of these; each writes its name where it is imported.
PLANTED = ("renderer", "numba", "numpy", "validation", "json", "tqdm", "llvmlite", "pydantic", "site")
# Kernels that a first picture compiles beside and in the command's own process; each takes seconds.
COMPILED_AGAIN = ("renderer.shade.tile.", "renderer.tree.subtree.")
TRAP = "import pathlib; pathlib.Path({folder!r}, 'executed').open('a').write('{name} ')\n"
TELL = """
import sys
def tell(*arguments):
    import renderer
    print(renderer.__file__, *arguments, *[repr(p) for p in sys.path if not p or not p.startswith("/")])
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with modules of the names that a process of ours imports."""
    trapped = tmp_path / "trapped"
    trapped.mkdir()
    for name in PLANTED:
        (trapped / f"{name}.py").write_text(TRAP.format(folder=str(tmp_path), name=name))
    return trapped


def executed(folder):
    path = folder.parent / "executed"
    return path.read_text(encoding="utf-8") if path.exists() else ""


def console(name):
    """A console script of this environment."""
    return str(Path(sys.executable).with_name(name))


def run(command, folder, **more):
    options = {"cwd": folder, "env": {**os.environ, **more}, "timeout": 300}
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


@pytest.mark.skipif(precompile.available_threads() < 2, reason="with one processor there is no second process")
def test_a_first_picture_executes_nothing_that_lies_in_the_current_folder(folder, tmp_path):
    """Without kernels of either process, so that a second one compiles beside; it imported renderer.py from here."""
    scene = str(ROOT / "scenes" / "stairs.toml")
    cache, warm = tmp_path / "cache", Path(render_tile.store.cache_path)
    asked = "from renderer.shade.tile import render_tile; print(render_tile.store.cache_path)"
    kernels = Path(run([sys.executable, "-P", "-c", asked], folder, NUMBA_CACHE_DIR=str(cache)).stdout.strip())
    found = {path.name for path in warm.glob("*.kernel") if not path.name.startswith(COMPILED_AGAIN)}
    for name in found:
        with suppress(FileNotFoundError):  # of older sources, removed by another test meanwhile
            shutil.copy(warm / name, kernels)
    command, began = [console("octree-render"), "render", scene, "-o", "out.png", "--resolution", "8x8"], perf_counter()
    done = run(command, folder, NUMBA_CACHE_DIR=str(cache))
    assert done.returncode == 0, done.stderr
    # 38 s of compiling were once reported as rendering. They are most of a command's time; 64 pixels take milliseconds.
    rendering, building = re.search(r"rays in ([\d.]+) s .* ready in ([\d.]+) s", done.stdout + done.stderr).groups()
    assert float(rendering) + float(building) < (perf_counter() - began) / 2
    assert "ended with exit code" not in done.stderr and executed(folder) == ""
    # Each kernel once, where this process looks for it.
    names = [path.name.split("-")[0] for path in kernels.glob("*.kernel") if path.name not in found]
    assert {name.rpartition(".")[2] for name in names} >= {"render_tile", "build_subtree"}
    assert len(names) == len(set(names))


def test_the_console_scripts_look_into_no_folder(folder):
    for name in ("octree-render", "octree-validate"):
        done = run([console(name), "--help"], folder)
        assert done.returncode == 0 and done.stdout.startswith(f"usage: {name}") and executed(folder) == ""


@pytest.mark.parametrize("path", [":", "relative", "{folder}/../trapped/.."])
def test_a_child_has_the_packages_of_its_parent_and_no_relative_path(folder, path):
    script = f"""
import subprocess, sys
sys.path.insert(0, {str(ROOT)!r})
from renderer.system import child
command = child.command("telling:tell", "a", "b c")
print(subprocess.run(command, env=child.environment(), capture_output=True, text=True))
"""
    telling = folder.parent / "modules"
    telling.mkdir()
    (telling / "telling.py").write_text(TELL)
    given = os.pathsep.join([str(telling), path.format(folder=folder)])
    done = run([sys.executable, "-P", "-c", script], folder, PYTHONPATH=given)
    assert done.returncode == 0 and "returncode=0" in done.stdout, done.stdout + done.stderr
    assert f"{renderer.__file__} a b c" in done.stdout and executed(folder) == ""
    assert f"{renderer.__file__} a b c\\n" in done.stdout  # nothing relative follows


def test_what_is_given_for_a_child_is_before_what_this_process_has(monkeypatch):
    monkeypatch.setenv("OCTREE_RENDERER_QUIET", "0")
    assert child.environment(OCTREE_RENDERER_QUIET="1")["OCTREE_RENDERER_QUIET"] == "1"


def test_a_child_that_fails_is_said_with_its_last_words(monkeypatch, caplog):
    monkeypatch.setattr(precompile, "is_on_disk", lambda kernel: False)
    monkeypatch.setattr(precompile, "available_threads", lambda: 2)
    monkeypatch.setattr(precompile, "_build", lambda: None)
    command = [sys.executable, "-P", "-c", "import sys; print('it began', file=sys.stderr); raise OSError('no room')"]
    monkeypatch.setattr(child, "command", lambda *arguments: command)
    precompile.compile_in_two()
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    told = "renderer: the process that compiles beside this one ended with exit code 1: OSError: no room"
    assert record.getMessage() == told
