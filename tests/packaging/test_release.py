"""What is released: the files of wheel and sdist, types as a user's checker sees them, and what else names versions."""

import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
import yaml
from cases import cases
from packaging.requirements import Requirement

import renderer

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# What a user writes; each reveal is compared, so that a name whose type is lost (Any) is found.
SCRIPT = """
import numpy as np
from renderer import Hits, Image, Octree, load_mesh, load_scene, prepare, render
from renderer.studies import face_points, scan, sky_view_factor

def depths(path: str) -> list[float]:
    octree = Octree.from_mesh(load_mesh(path))
    hits: Hits = octree.closest_hit([0.0, 1.0, 9.0], np.array([[0.0, 0.0, -1.0]]))
    if octree.contains(hits.points).any():
        octree.refit(octree.mesh.vertices * 2.0)
    return [float(t) for t in hits.t]

points, normals, faces = face_points(load_mesh("model.ply"))
sky = sky_view_factor(Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), points, normals, leaving=faces)
seen = scan(Octree.load("kept.octree"), (0.0, 0.0, 9.0), 1000)
image: Image = render(prepare(load_scene("scene.toml")), resolution=(64, 48))
image.save("picture.png")
reveal_type(Octree)
reveal_type(sky)
reveal_type(seen.distances)
reveal_type(image.radiance)
reveal_type(depths("model.ply"))
"""
# Patterns: mypy names a type of NumPy now by itself, now by its bits.
REVEALED = [
    r"-> renderer\.octree\.Octree\)?$",
    "float64|_64Bit",
    "float64|_64Bit",
    "float32|_32Bit",
    r"^list\[float\]$",
]


def tracked():
    """What is in git, or a skip where this is no checkout."""
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("no git checkout")
    return {name for name in done.stdout.split("\0") if name and (ROOT / name).is_file()}


@pytest.fixture(scope="module")
def dist(tmp_path_factory):
    """A folder with the wheel and the sdist of a copy of this tree, without what git ignores."""
    copy = tmp_path_factory.mktemp("tree") / "copy"
    left_out = shutil.ignore_patterns(
        ".venv", ".git", "__pycache__", ".*_cache", ".hypothesis", "dist", "build", "compiled"
    )
    shutil.copytree(ROOT, copy, ignore=left_out)
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--wheel", "--sdist", "--outdir", folder, copy]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return folder


def test_the_sdist_has_all_that_is_in_git(dist):
    (path,) = dist.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    assert tracked() <= held


def test_the_wheel_has_both_packages_typed_with_their_licence(dist):
    (path,) = dist.glob("*.whl")
    assert path.name == f"octree_renderer-{renderer.__version__}-py3-none-any.whl"
    with zipfile.ZipFile(path) as archive:
        held = set(archive.namelist())
        (metadata,) = (name for name in held if name.endswith("METADATA"))
        text = archive.read(metadata).decode()
    assert {"renderer/py.typed", "validation/py.typed"} <= held
    assert all(name.startswith(("renderer/", "validation/", "octree_renderer-")) for name in held)
    assert any(name.endswith("licenses/LICENSE") for name in held) and "License-Expression: MIT\n" in text
    wanted = {name for name in tracked() if name.startswith(("renderer/", "validation/"))}
    assert wanted <= held


def test_a_users_script_is_typed_strictly_against_the_wheel(dist, tmp_path):
    """In an environment of its own: the wheel, and our dependencies by a .pth file."""
    (wheel,) = dist.glob("*.whl")
    venv.create(tmp_path / "venv", with_pip=False)
    programs = "Scripts" if sys.platform == "win32" else "bin"
    python = tmp_path / "venv" / programs / "python"
    asked = "import sysconfig; print(sysconfig.get_path('purelib'))"
    purelib = Path(subprocess.run([python, "-c", asked], check=True, capture_output=True, text=True).stdout.strip())
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(purelib)
    (purelib / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    (tmp_path / "script.py").write_text(SCRIPT)
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--python-executable",
        python,
        "--cache-dir",
        tmp_path / "cache",
    ]
    done = subprocess.run(
        [*command, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    revealed = re.findall(r'Revealed type is "(.*)"', done.stdout)
    assert len(revealed) == len(REVEALED)
    for found, wanted in zip(revealed, REVEALED, strict=True):
        assert re.search(wanted, found.replace("builtins.", "")), found


def test_versions_are_the_packages_own():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    recipe = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8"))
    assert str(citation["version"]) == recipe["context"]["version"] == renderer.__version__
    assert citation["license"] == recipe["about"]["license"] == PROJECT["license"]
    headings = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert headings[0] == "Unreleased" or headings[0].startswith(renderer.__version__)


def test_the_recipe_asks_for_what_the_package_asks_for():
    recipe = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8"))
    _python, *asked = recipe["requirements"]["run"]
    wanted = [Requirement(line) for line in PROJECT["dependencies"]]
    assert asked == [f"{one.name} {one.specifier}" for one in wanted]
    assert f">={recipe['context']['python_min']}" == PROJECT["requires-python"]
    assert recipe["build"]["python"]["entry_points"] == [f"{k} = {v}" for k, v in PROJECT["scripts"].items()]


@cases("path", sorted((ROOT / ".github").rglob("*.yml")))
def test_workflows_and_forms_are_yaml_and_actions_are_pinned_by_commit(path):
    text = path.read_text(encoding="utf-8")
    assert isinstance(yaml.safe_load(text), dict)
    for line in re.findall(r"^.*\buses:.*$", text, re.MULTILINE):
        assert re.search(r"uses: [\w/-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+$", line), line


def test_what_a_workflow_runs_is_there():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))["jobs"]
    lines = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    paths = {path for line in lines for path in re.findall(r"(?:tests|\.ci)/[\w./]+", line)}
    assert len(paths) > 3 and not {path for path in paths if not (ROOT / path).exists()}
    targets = " ".join(jobs["prove"]["strategy"]["matrix"]["targets"]).split()
    known = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert {"lint", "test", "test-slow", "docs", "validate"} == set(targets) <= set(known)


def test_each_classifier_of_a_version_is_one_that_is_tried():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))["jobs"]
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    assert named == jobs["prove"]["strategy"]["matrix"]["python"]
