"""Digests of kernels' sources: whatever a kernel can see shows, however many folders down; nothing else does."""

import ast
import shutil

import pytest
from cases import cases
from kernel_package import PACKAGE, run, write_package

from renderer.jit.digest import imported_files

TELL = """
from pathlib import Path
from renderer.jit.digest import source_digest
for m in {modules!r}: print(source_digest(Path('renderer').resolve() / m))
"""


def digests(folder):
    modules = [path.relative_to(folder).as_posix() for path in folder.rglob("*.py")]
    return dict(zip(modules, run(folder, TELL.format(modules=modules)), strict=True))


def changed_by(folder, *edited):
    """The modules whose digest changes with a line at the end of the edited ones."""
    before = digests(folder)
    for name in edited:
        with (folder / name).open("a") as source:
            source.write("\n# edited\n")
    after = digests(folder)
    return {module for module in before if before[module] != after[module]}


@pytest.fixture
def whole(tmp_path):
    """A copy of the package."""
    folder = tmp_path / "renderer"
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def test_an_edit_of_the_layout_changes_the_kernels_over_it_alone(whole):
    changed = changed_by(whole, "trace/layout.py")
    kernels = {"trace/intersect.py", "trace/traverse.py", "trace/single.py", "tree/build.py", "shade/whitted.py"}
    assert {"trace/layout.py", *kernels} <= changed
    assert not changed & {"numerics/simd.py", "jit/decorators.py", "errors.py", "mesh/mesh.py", "system/threads.py"}


@pytest.mark.parametrize("edited", ["viewer/session.py", "scene/material.py"])
def test_an_edit_beside_the_kernels_changes_none_of_them(whole, edited):
    kernels = {
        "trace/single.py", "tree/build.py", "tree/subtree.py", "tree/refit.py", "tree/blocks.py",
        "shade/whitted.py", "shade/tile.py", "diagnostics/face_phong.py",
    }  # fmt: skip

    assert not changed_by(whole, edited) & kernels


def test_an_edit_two_folders_down_shows_and_one_beside_it_does_not(tmp_path):
    folder = write_package(tmp_path)
    assert changed_by(folder, "below/deep/bottom.py") == {"below/deep/bottom.py", "middle.py", "upper.py"}
    assert changed_by(folder, "below/deep/aside.py") == {"below/deep/aside.py"}


@pytest.mark.parametrize("line", ["from renderer.below.deep import bottom", "from renderer.below import (\n  deep,\n)"])
def test_a_module_imported_by_name_counts(tmp_path, line):
    folder = write_package(tmp_path)
    (folder / "below" / "deep.py").write_text("STEP = 1\n")
    (folder / "middle.py").write_text(line + "\n")
    edited = "below/deep.py" if "deep," in line else "below/deep/bottom.py"
    assert {"middle.py", "upper.py"} <= changed_by(folder, edited)


def package_imports(path, package=PACKAGE):
    """The files of the package that a source imports, by Python's own parser; refuses what the digest cannot see."""
    found, tree = set(), ast.parse(path.read_text(encoding="utf-8"))
    within = {node for outer in ast.walk(tree) if isinstance(outer, ast.FunctionDef) for node in ast.walk(outer)}
    # What is imported inside a function, a kernel cannot use.
    for node in (node for node in ast.walk(tree) if node not in within):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}:{node.lineno}: a relative import"
            module, *below = (node.module or "").split(".")
            if module == "renderer" and node.col_offset == 0:
                base = package.joinpath(*below)
                names = [base / f"{alias.name}.py" for alias in node.names]
                found |= {file for file in (base.with_suffix(".py"), base / "__init__.py", *names) if file.exists()}
        elif isinstance(node, ast.Import):
            for alias in node.names:
                assert alias.name.partition(".")[0] != "renderer", f"{path.name}:{node.lineno}: import {alias.name}"
    return found


@cases("path", sorted(PACKAGE.rglob("*.py")))
def test_every_import_in_the_package_has_the_form_that_the_digest_follows(path):
    assert set(imported_files(path)) == package_imports(path)


def seen_by(path):
    """The files of the package that a source imports, directly or not."""
    seen, pending = set(), [path]
    while pending:
        found = pending.pop()
        if found not in seen:
            seen.add(found)
            pending += imported_files(found)
    return seen


def test_kernels_see_no_model_of_a_scene():
    """An edit of a scene's class or of a picture's file format compiles nothing anew."""
    kernels = [path for path in PACKAGE.rglob("*.py") if "\n@kernel\n" in path.read_text(encoding="utf-8")]
    assert len(kernels) > 20
    for path in kernels:
        rooms = {found.relative_to(PACKAGE).parts[0] for found in seen_by(path)}
        assert not rooms & {"scene", "picture", "viewer", "cli.py"}, path
