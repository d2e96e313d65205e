"""Start-up: what is imported when, and what is said about compiling."""

import json
import logging
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import renderer
from renderer.cli.main import main

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.judges("octree-render render --quiet")
HEAVY = {
    "numba",
    "numpy",
    "pydantic",
    "trimesh",
    "PIL",
    "tqdm",
    "scipy.linalg",
    "matplotlib",
    "mitsuba",
    "embreex",
    "starlette",
    "uvicorn",
    "websockets",
}


def output(script: str) -> str:
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


STEPS = [
    ("import renderer", set()),
    ("from renderer.cli.main import main", set()),
    ("try: main(['render', '--help'])\nexcept SystemExit: pass", set()),
    ("import renderer.studies", set()),
    ("from renderer import load_mesh, Mesh", {"numpy"}),
    ("from renderer.studies import tregenza", {"numpy"}),
    ("from renderer import Octree", {"numpy", "numba"}),
    ("from renderer.studies import *", {"numpy", "numba"}),
    ("from renderer import *", {"numpy", "numba", "pydantic"}),
]


def test_an_import_brings_only_what_it_needs():
    """One after the other in a fresh process; each needs all that those before it do."""
    tell = f"print('loaded', json.dumps(sorted({HEAVY!r} & set(sys.modules))))"
    script = "import json, sys\n" + "\n".join(f"{step}\n{tell}" for step, _ in STEPS)
    loaded = [json.loads(line[7:]) for line in output(script).splitlines() if line.startswith("loaded ")]
    assert loaded == [sorted(needs) for _, needs in STEPS]


def test_a_render_of_the_command_line_loads_no_scipy_and_leaves_it_importable(tmp_path):
    """Where memory is scarce its OpenBLAS would wait for memory without end."""
    script = f"""
import sys
from renderer.cli.main import main
sys.argv = ["octree-render", "render", "scenes/stairs.toml", "-o", {str(tmp_path / "a.png")!r}, "--resolution", "8x8"]
assert main() == 0
assert not any(name.startswith("scipy") for name in sys.modules) and "numba" in sys.modules
import scipy.linalg
"""
    output(script)


def test_the_collector_rests_during_an_import():
    script = """
import gc, renderer
collections = []
gc.callbacks.append(lambda phase, info: collections.append(info))
renderer.Octree
print(len(collections), gc.isenabled())
"""
    assert output(script) == "0 True\n"


@pytest.mark.parametrize("arguments", ["", "['info', 'missing.ply']"])
def test_only_a_command_of_its_own_process_ends_without_a_last_collection(arguments):
    """It would take a fifth of the time of a small picture; in a user's process it may close files."""
    script = f"""
import atexit, gc, sys
from renderer.cli.main import main
atexit.register(lambda: print(gc.get_freeze_count() > 0))
sys.argv = ["octree-render", "info", "missing.ply"]
assert main({arguments}) == 2
"""
    assert output(script) == f"{not arguments}\n"


def test_the_kernel_is_loaded_before_a_picture_takes_its_memory():
    """Where there is none left to load it, LLVM ends the process."""
    script = """
import renderer.picture.prepare as prepare
from renderer import load_scene, render
make, loaded = prepare._film, []
def make_film(width, height, planes, first=0):
    loaded.append((height, bool(vars(prepare.render_tile).get("entry") and prepare.render_tile.entry.signatures)))
    return make(width, height, planes, first)
prepare._film = make_film
render(load_scene("scenes/stairs.toml"), resolution=(8, 8))
assert loaded[-1] == (8, True), loaded
"""
    output(script)


def test_the_public_names_are_there_whatever_was_imported_first():
    script = (
        "import renderer, renderer.scene.scene\nfrom renderer.picture.render import prepare\nfrom renderer import *"
    )
    tell = """\
public = {name: getattr(renderer, name) for name in renderer.__all__ if name != "__version__"}
print(callable(render), *[f"{name}:{getattr(found, '__module__', None)}" for name, found in public.items()])"""
    is_callable, *names = output(f"{script}\n{tell}").split()
    assert is_callable == "True" and "render:renderer.picture.render" in names and "Mesh:renderer.mesh.mesh" in names


def test_the_public_names_are_listed_and_others_are_errors():
    assert dir(renderer) == sorted(renderer.__all__)
    with pytest.raises(AttributeError, match="module 'renderer' has no attribute 'Octre'"):
        _ = renderer.Octre
    with pytest.raises(ImportError, match="Octre"):
        from renderer import Octre  # noqa: F401


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
@pytest.mark.parametrize("seconds", [0.0, 1.3])
def test_control_c_while_compiling_ends_with_130_and_no_traceback(tmp_path, seconds):
    picture = tmp_path / "a.png"
    command = [sys.executable, "-m", "renderer.cli.main", "render", "scenes/three_models.toml", "-o", str(picture)]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    running = subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)
    try:
        assert "octree-render: compiling " in running.stderr.readline()
        time.sleep(seconds)
        running.send_signal(signal.SIGINT)
        _, err = running.communicate(timeout=60)
    finally:
        running.kill()
    assert running.returncode == 130 and "Traceback" not in err and "ignored" not in err
    assert err.endswith("octree-render: interrupted\n") and not picture.exists()


@pytest.mark.parametrize("quiet", [False, True])
def test_the_command_line_shows_what_is_compiled_unless_quiet(capsys, monkeypatch, quiet):
    log = logging.getLogger("renderer.jit")
    monkeypatch.setattr(log, "level", logging.CRITICAL)
    before = logging.CRITICAL, list(log.handlers)
    monkeypatch.setattr("renderer.cli.render._render", lambda _options: log.warning("renderer: compiling %s", "it"))
    assert main(["render", "any.toml", *(["--quiet"] if quiet else [])]) == 0
    assert capsys.readouterr() == ("", "" if quiet else "octree-render: compiling it\n")
    assert (log.level, log.handlers) == before


def test_a_notice_stands_on_a_line_of_its_own_beside_a_progress_bar():
    script = """
import io, logging, sys
from tqdm import tqdm
from renderer.cli.main import compile_notices
sys.stderr = io.StringIO()
with compile_notices(silent=False), tqdm(total=3, file=sys.stderr, ncols=40):
    logging.getLogger("renderer.jit").warning("renderer: compiling it")
print("\\roctree-render: compiling it\\n" in sys.stderr.getvalue().replace(" " * 2, ""))
print(repr(sys.stderr.getvalue()))
"""
    assert output(script).splitlines()[0] == "True"
