"""What pages say of installing: environments, extras, a wheel for one platform, and a gate installed from git."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

from renderer.jit.levels import AHEAD_VARIABLE
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box
from renderer.trace.traverse import trace_chunk

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
GUIDE = ROOT / "docs" / "guides" / "validation-in-your-ci.md"
PIP = re.compile(r"pip install ((?:-e )?(?:'[^']+'|\"[^\"]+\"|\.)(?=[`\s]))")
# Nothing is fetched: dependencies are this environment's own, by a .pth file.
OFFLINE = ["--no-deps", "--no-index", "--no-build-isolation", "--disable-pip-version-check"]


def run(command, folder, **variables):
    """The output of a command, of which nothing else is found than what is installed."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        list(map(str, command)),
        cwd=folder,
        env={**kept, **variables},
        capture_output=True,
        text=True,
        timeout=600,  # may compile kernels, as an installed copy has none
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """A copy of this tree, without what git ignores, with a .venv that has our dependencies and not us."""
    copy = tmp_path_factory.mktemp("tree") / "checkout"
    left_out = shutil.ignore_patterns(
        ".venv", ".git", "__pycache__", ".*_cache", ".hypothesis", "dist", "build", "compiled", "examples"
    )
    shutil.copytree(ROOT, copy, ignore=left_out)
    run([sys.executable, "-m", "venv", ".venv"], copy)
    asked = "import sysconfig; print(sysconfig.get_path('purelib'))"
    purelib = Path(run([programs(copy) / "python", "-c", asked], copy).strip())
    (purelib / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return copy


def programs(checkout):
    return checkout / ".venv" / ("Scripts" if sys.platform == "win32" else "bin")


def pip(checkout, *words, **variables):
    return run([programs(checkout) / "python", "-m", "pip", "install", *OFFLINE, *words], checkout, **variables)


def asked_of_pip():
    """The arguments of each `pip install` of the pages, each once."""
    return sorted({words for page in PAGES for words in PIP.findall(page.read_text(encoding="utf-8"))})


def test_what_pages_give_to_pip_is_known():
    """Of this checkout, with extras that there are; a wheel; or an address of git."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert {name for words in asked_of_pip() for name in re.findall(r"\[(\w+)\]", words)} <= set(extras)
    assert "-e '.[viewer]'" in asked_of_pip() and len(asked_of_pip()) > 6
    for words in asked_of_pip():
        assert re.fullmatch(r"(-e )?(\.|'\.\[\w+\]')|\"octree.renderer.*\[\w+\].*\"", words), words


def test_each_pip_install_of_a_checkout_works(checkout):
    """One after the other, as it stands."""
    for words in asked_of_pip():
        if "octree" not in words:
            pip(checkout, *shlex.split(words))
            assert run([programs(checkout) / "octree-render", "--version"], checkout).strip()
    run([programs(checkout) / "python", "-m", "pip", "uninstall", "--yes", "--quiet", "octree-renderer"], checkout)


def test_a_wheel_for_one_platform_is_made_as_the_page_says(checkout):
    """With a file in the place of kernels, which tests/packaging/test_compiling_ahead.py compiles for a level."""
    page = (ROOT / "docs" / "first-answers.md").read_text(encoding="utf-8")
    build, tag = "python -m build --wheel", "python -m wheel tags --remove"
    (line,) = re.findall(rf"^    {build} && (.*)$", page, re.MULTILINE)
    assert line == "rm -r renderer/compiled"
    compiled = checkout / "renderer" / "compiled"
    compiled.mkdir()
    (compiled / "kernel.nbi").write_bytes(b"machine code")
    run([sys.executable, *shlex.split(build)[1:], "--no-isolation"], checkout)
    shutil.rmtree(compiled)
    (wheel,) = (checkout / "dist").glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        assert "renderer/compiled/kernel.nbi" in archive.namelist()
    (line,) = re.findall(rf"^    ({tag} .*)$", page, re.MULTILINE)
    words = shlex.split(line)
    assert words[-1] == "dist/*.whl"
    if find_spec("wheel") is None:
        pytest.skip("built, but not tagged: the package wheel is not installed")
    run([sys.executable, *words[1:-1], wheel], checkout)
    (tagged,) = (checkout / "dist").glob("*.whl")
    assert tagged.name.endswith("-cp311-cp311-manylinux_2_28_x86_64.whl")


@pytest.fixture(scope="module")
def project(checkout, tmp_path_factory):
    """Another project, with the files that the guide's workflow names."""
    folder = tmp_path_factory.mktemp("project")
    (folder / "scenes").symlink_to(ROOT / "scenes")
    save_ply(box((0.0, 0.0, 0.0), (4.0, 3.0, 2.0)), folder / "my.ply")
    scene = (ROOT / "docs" / "guides" / "scenes-and-materials.md").read_text(encoding="utf-8")
    (folder / "my.toml").write_text(re.findall(r"```toml\n(.*?)```", scene, re.DOTALL)[0])
    guide = GUIDE.read_text(encoding="utf-8")
    (folder / "thresholds.toml").write_text(re.findall(r"```toml\n(.*?)```", guide, re.DOTALL)[0])
    return folder


def test_the_workflow_of_the_guide_installs_from_git_and_judges(checkout, project):
    """Its two commands: from a repository that has the working tree, and with fewer rays."""
    own = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "core.hooksPath=/dev/null"]
    run(["git", "init", "--quiet"], checkout)
    run(["git", "add", "--all", "--", "renderer", "validation", "pyproject.toml", "README.md", "LICENSE"], checkout)
    run(["git", *own, "commit", "--quiet", "-m", "all"], checkout)
    commit = run(["git", "rev-parse", "HEAD"], checkout).strip()
    workflow = yaml.safe_load(re.findall(r"```yaml\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)[0])
    (job,) = workflow["jobs"].values()
    install, judge = (step["run"] for step in job["steps"] if "run" in step)
    address = workflow["env"]["OCTREE_RENDERER"].replace(
        "https://ADDRESS@COMMIT", f"file://localhost{checkout}@{commit}"
    )
    command = install.removeprefix("pip install ").replace("$OCTREE_RENDERER", address)
    pip(checkout, *shlex.split(command))
    program, *arguments = shlex.split(judge)
    # The sources are those of this checkout, and so are its kernels: to compile them again takes two minutes.
    ahead = {AHEAD_VARIABLE: trace_chunk.store.cache_path or ""}
    said = run([programs(checkout) / program, *arguments, "--quick"], project, **ahead)
    assert "validation: PASS" in said
    assert {"index.html", "metrics.json", "junit.xml"} <= {path.name for path in (project / "build/report").iterdir()}


def test_the_exit_codes_of_the_guide(project):
    """Of a gate that fails, as the guide lets it, and of a bad file."""
    asked = [sys.executable, "-P", "-c", "import sys; from renderer.cli.validate import main; sys.exit(main())"]

    def code(*arguments):
        done = subprocess.run(
            [*asked, *arguments], cwd=project, capture_output=True, text=True, timeout=300, check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        return done.returncode, done.stdout, done.stderr

    strict = "[pictures.own]\nssim = 1.0\nmean_error = 0.0\n"
    assert "`ssim = 1.0` with `mean_error = 0.0`" in GUIDE.read_text(encoding="utf-8")
    (project / "strict.toml").write_text(strict)
    found, out, _ = code("--quick", "--scene", "my.toml", "--gate", "strict.toml", "--output", "strict")
    assert found == 1 and "FAILED images: " in out and "validation: FAIL" in out
    assert list((project / "strict" / "pictures" / "failed").glob("*.exr"))
    (project / "wrong.toml").write_text("[pictures]\nssim = 1.0\n")
    for bad in (["--scene", "absent.toml"], ["--mesh", "my.ply", "--gate", "wrong.toml"], ["--only", "nothing"]):
        found, _, err = code(*bad, "--output", "bad")
        assert found == 2 and err and not (project / "bad").exists()
