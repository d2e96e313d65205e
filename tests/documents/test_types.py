"""A user's script passes mypy --strict without any plugin: every example of the pages and docstrings."""

import subprocess
import sys

import pytest
from documented import scripts

# Packages without types, or that may be absent.
CONFIGURATION = """
[mypy]
strict = true
[mypy-open3d.*,pyvista.*,trimesh.*]
ignore_missing_imports = true
[mypy-dask.*,distributed.*]
follow_imports = skip
"""
SCENE = "from renderer import *\nscene = load_scene('s.toml')\n"
# Slips that a type checker finds, and part of the line that it says.
WRONG = {
    "resolutoin": (f"{SCENE}render(scene, resolutoin=(3, 3))", 'Unexpected keyword argument "resolutoin" for "render"'),
    "samples": (f"{SCENE}render(scene, samples='4')", 'Argument "samples" to "render" has incompatible type "str"'),
    "difuse": ("from renderer import Phong\nPhong(difuse=0.5)", 'Unexpected keyword argument "difuse" for "Phong"'),
    "positional": (
        "from renderer import PerspectiveCamera\nPerspectiveCamera((0, 0, 5), (0, 0, 0))",
        'Too many positional arguments for "PerspectiveCamera"',
    ),
    "objects": (f"{SCENE}Scene(camera=scene.camera, materials={{}}, objects=[1])", "List item 0 has incompatible type"),
    "backgrund": (f"{SCENE}scene.altered(backgrund=1)", 'Unexpected keyword argument "backgrund" for "altered"'),
    "up": (
        "from renderer import load_scene\nload_scene('a.ply', up='w')",
        'Argument "up" to "load_scene" has incompat',
    ),
}


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The lines of mypy about all scripts, the right and the wrong ones."""
    folder = tmp_path_factory.mktemp("typed")
    (folder / "mypy.ini").write_text(CONFIGURATION)
    for name, text in scripts().items():
        (folder / f"right_{name}.py").write_text(text)
    for name, (text, _) in WRONG.items():
        (folder / f"wrong_{name}.py").write_text(text)
    files = sorted(path.name for path in folder.glob("*.py"))
    assert len(files) > 100
    command = [sys.executable, "-m", "mypy", "--config-file", "mypy.ini", "--scripts-are-modules", *files]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 1 and not done.stderr, done.stderr
    return done.stdout.splitlines()


def test_all_examples_pass(said: list[str]) -> None:
    assert [line for line in said if line.startswith("right_")] == []


@pytest.mark.parametrize("name", WRONG)
def test_a_slip_is_a_type_error(said: list[str], name: str) -> None:
    lines = [line for line in said if line.startswith(f"wrong_{name}.py")]
    assert any(WRONG[name][1] in line for line in lines), lines
