"""Processes that the package starts: they import what their parent has, and nothing from the current folder."""

import os
import sys
from functools import partial
from importlib import import_module
from pathlib import Path

import pytest
from planted import console, executed, planted, run

import renderer
from renderer import precompile
from renderer.system import child

ROOT = Path(__file__).parents[2]
TELL = """
import sys
def tell(*arguments):
    import renderer
    print(renderer.__file__, *arguments, *[repr(p) for p in sys.path if not p or not p.startswith("/")])
"""


@pytest.fixture
def folder(tmp_path):
    return planted(tmp_path)


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


@pytest.mark.parametrize(
    "ending, said",
    [
        ("raise OSError('no room')", "exit code 1: OSError: no room"),
        ("os.kill(os.getpid(), 9)", "exit code -9: it began"),
    ],
)
def test_a_child_that_fails_is_said_with_its_last_words(monkeypatch, caplog, ending, said):
    monkeypatch.setattr(precompile, "is_on_disk", lambda kernel: False)
    monkeypatch.setattr(precompile, "available_threads", lambda: 2)
    monkeypatch.setattr(precompile, "_build", lambda: None)
    script = f"import os, sys; print('it began', file=sys.stderr, flush=True); {ending}"
    command = [sys.executable, "-P", "-c", script]
    monkeypatch.setattr(child, "command", lambda *arguments: command)
    precompile.compile_in_two()
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    assert record.getMessage() == f"renderer: the process that compiles beside this one ended with {said}"


@pytest.mark.parametrize("folder", [None, "kernels"])
def test_the_process_beside_compiles_the_same_parts_from_the_last_on(monkeypatch, tmp_path, folder):
    """Told what and where to by its command."""
    called, chosen, began = [], [], []
    parts = tuple(precompile.Part(name, partial(called.append, name)) for name in "abc")
    for what in ("queries", "all"):
        monkeypatch.setitem(precompile.PARTS, what, parts)
    monkeypatch.setattr(precompile, "available_threads", lambda: 2)
    monkeypatch.setattr(precompile, "compile_into", chosen.append)
    monkeypatch.setattr(precompile, "_end_with_input", lambda: None)

    def called_here(target, *arguments):
        module, _, function = target.partition(":")
        getattr(import_module(module), function)(*arguments)
        return [sys.executable, "-c", ""]

    monkeypatch.setattr(child, "command", called_here)
    precompile.compile_ahead_in_two("queries", folder and tmp_path / folder, began.append)
    assert called == ["c", "b", "a", "a", "b", "c"] and began == ["a", "b", "c"]
    assert chosen == ([tmp_path / folder] if folder else [])
