"""Start-up: what is imported when, what is said about compiling, and that compiling ahead leaves nothing to compile."""

import json
import logging
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from signatures import SIGNATURES

import renderer
from renderer.cli.main import main

pytestmark = pytest.mark.judges(
    "octree-render compile", "octree-render compile --all", "octree-render compile --level",
    "octree-render compile --output", "octree-render compile --pictures", "octree-render compile --queries",
    "octree-render render --quiet",
)  # fmt: skip


ROOT = Path(__file__).parents[2]
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


def heavy_after(script: str) -> set[str]:
    """The heavy packages that a fresh process has imported after ``script``."""
    tell = "import json, sys\nprint(json.dumps(sorted(sys.modules)))"
    return HEAVY & set(json.loads(output(f"{script}\n{tell}").splitlines()[-1]))


@pytest.mark.parametrize(
    ("script", "needs"),
    [
        ("import renderer", set()),
        ("from renderer.cli.main import main", set()),
        ("from renderer.cli.main import main\ntry: main(['render', '--help'])\nexcept SystemExit: pass", set()),
        ("from renderer import load_mesh, Mesh", {"numpy"}),
        ("from renderer import Octree", {"numpy", "numba"}),
        ("import renderer.studies", set()),
        ("from renderer.studies import tregenza", {"numpy"}),
        ("from renderer.studies import *", {"numpy", "numba"}),
        ("from renderer import *", {"numpy", "numba", "pydantic"}),
    ],
)
def test_an_import_brings_only_what_it_needs(script, needs):
    assert heavy_after(script) == needs


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
print(callable(render), *[f"{name}:{found.__module__}" for name, found in public.items()])"""
    is_callable, *names = output(f"{script}\n{tell}").split()
    assert is_callable == "True" and "render:renderer.picture.render" in names and "Mesh:renderer.mesh.mesh" in names


def test_the_public_names_are_listed_and_others_are_errors():
    assert dir(renderer) == sorted(renderer.__all__)
    with pytest.raises(AttributeError, match="module 'renderer' has no attribute 'Octre'"):
        _ = renderer.Octre
    with pytest.raises(ImportError, match="Octre"):
        from renderer import Octre  # noqa: F401


def test_compiling_ahead_leaves_nothing_to_compile():
    """A later kernel needs a compiler only for types of arguments that no kernel was compiled for."""
    script = """
import numpy as np
from renderer.precompile import compile_ahead
compile_ahead()
before = signatures()
from renderer import BruteForce, Octree, load_scene, needs_of, render
from renderer.diagnostics.face_phong import face_colors
from renderer.diagnostics.ray_path import ray_path
from renderer.picture.prepare import prepare_scene
from renderer.diagnostics.tree_boxes import visited
from renderer.mesh.shapes import box
for name in ("three_models", "stairs", "glass"):
    for options in ({}, {"accelerator": "brute", "max_depth": 1}, {"split": "sah", "samples": 4}):
        render(load_scene(f"scenes/{name}.toml"), resolution=(3, 2), **options)
    prepared = prepare_scene(load_scene(f"scenes/{name}.toml"), needs_of(load_scene(f"scenes/{name}.toml")), "octree")
    face_colors(prepared.arrays, [0, 1, 5])
    ray_path(prepared, [0, 1, 5], [0, 0, -1], 2)
    visited(prepared.octree, [0, 1, 5], [0, 0, -1])
vertices = np.random.default_rng(1).random((90, 3))
for points in (vertices, vertices.astype(np.float32)):
    for target in (Octree(points, np.arange(90).reshape(-1, 3)), BruteForce(points, np.arange(90).reshape(-1, 3))):
        constant = np.broadcast_to(points[0], (9, 3))
        for rays in (points, np.asfortranarray(points), points[::2], points.tolist(), constant):
            target.closest_hit(rays, rays, t_error=True)
            target.all_hits(rays, rays, t_error=True)
            target.any_hit(rays, rays, t_min=0.5, t_max=np.full(len(rays), 9.0))
            left = np.arange(9, dtype=np.int32)
            starts = target.mesh.triangles[:9].mean(axis=1)
            target.closest_hit(starts, rays[:9], leaving=left)
            target.any_hit(starts[0], rays[:9], leaving=0, side=-1)
            hits = target.closest_hit(rays, rays)
            target.any_hit(np.nan_to_num(hits.points), rays, leaving=hits)
            target.all_hits(np.nan_to_num(hits.points), rays, leaving=hits.through())
BruteForce.from_mesh(box()).contains(vertices.tolist())
Octree.from_mesh(box(), threads=2).contains(np.asfortranarray(vertices.astype(np.float32)))
print(len(before), *sorted(signatures() - before))
"""
    count, *new = output(SIGNATURES + script).splitlines()[-1].split(maxsplit=1)
    assert int(count) > 50 and not new


def test_kernels_of_queries_are_those_of_every_query_of_either_kind():
    script = """
import numpy as np
from renderer.precompile import compile_ahead
compile_ahead("queries")
before = signatures()
from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import icosphere
from renderer.queryable import Queries
from renderer.studies import ambient_occlusion, occlusion, scan, sky_view_factor, visible_faces
ball, rng = icosphere(3), np.random.default_rng(1)
# In float64 and in float32, of which the kernels of trees have two kinds.
meshes = [ball, Mesh(ball.vertices.astype(np.float32), ball.faces), Mesh(ball.vertices * 1e-60, ball.faces)]
trees = [kind.from_mesh(mesh) for mesh in meshes for kind in (Octree, BruteForce)]
asked = set()
for tree in trees:
    size = 1.0 / tree.tree.scale
    for count in (1, 9, 100):
        a, b = rng.normal(size=(2, count, 3)) * size
        faces = np.arange(count)
        on, corners = tree.mesh.triangles[:count].mean(axis=1), tree.mesh.triangles[:count, 0]
        hits, sides = tree.closest_hit(a, -a), np.where(faces % 2, 1, -1)
        met = np.nan_to_num(hits.points)
        for name in ("closest_hit", "any_hit", "all_hits", "count_hits", "count_steps"):
            asked.add(name)
            for more in ({}, {"t_min": 0.1, "t_max": np.full(count, 9.0)}):
                getattr(tree, name)(a, b, **more)
            for start in (on, corners):
                getattr(tree, name)(start, b, leaving=faces), getattr(tree, name)(start, b, leaving=faces, side=sides)
            getattr(tree, name)(on[0], b, leaving=0), getattr(tree, name)(on, b[0], leaving=faces, side=1)
            getattr(tree, name)(met, a, leaving=hits), getattr(tree, name)(met, -a, leaving=hits.through())
        tree.closest_hit(a, b, t_error=True), tree.all_hits(a, b, t_error=True, contacts=False, max_hits=2)
        tree.visible(a, b), tree.visible(on, corners, leaving=faces, reaching=faces), tree.visible(on, b)
        tree.contains(a), tree.contains(a, False, "even-odd"), tree.contains(a, winding=True)
        tree.winding_number(a), tree.closest_point(a, 0.5 * size), tree.signed_distance(a)
        for at, of in ((a, {}), (on, {}), (corners, {}), (on, {"leaving": faces})):
            occlusion(tree, at, b, b, **of), occlusion(tree, at, None, b, packed=True, **of)
            sky_view_factor(tree, at, up=[1, 2, 3], **of), ambient_occlusion(tree, at, b[::-1], samples=9, **of)
            scan(tree, at[0], b), scan(tree, at[0], b, normal=b[0])
        occlusion(tree, a.astype(np.float32), None, b, packed=True)
        visible_faces(tree, tree.mesh.vertices[0])  # in the planes of some faces
        asked |= {"visible", "contains", "winding_number", "closest_point", "signed_distance"}
    tree.refit(tree.mesh.vertices * 1.5)
public = {name for name, value in vars(Queries).items() if callable(value) and not name.startswith("_")}
assert public == asked, public ^ asked
print(len(before), *sorted(signatures() - before))
"""
    count, *new = output(SIGNATURES + script).splitlines()[-1].split(maxsplit=1)
    assert int(count) > 20 and not new


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
@pytest.mark.parametrize("seconds", [0.0, 0.5, 1.3])
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


def test_kernels_for_a_level_have_the_bits_of_native_ones_and_leave_nothing_to_compile(tmp_path):
    """Compiled in one process for any machine of the level, found by another one that may not write anywhere near."""
    from renderer.jit.cache import runnable_levels

    folder, level = tmp_path / "kernels", runnable_levels()[-1]
    # Of all queries, which take half a minute, only those that are asked below.
    program = """
import sys
from renderer.cli import main as cli
choose = cli.choose_processor
def choose_and_ask_less(*options):
    choose(*options)  # before Numba is imported
    from renderer.precompile import PARTS
    PARTS["queries"] = [p for p in PARTS["queries"] if p.name in ("build", "refit", "a few rays", "many rays")]
cli.choose_processor = choose_and_ask_less
sys.exit(cli.main(sys.argv[1:]))
"""
    command = [sys.executable, "-P", "-c", program, "compile", "--queries", "--level", level, "-o", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    assert re.fullmatch(rf"compiled in \d+\.\d s; \d+ kernels in {re.escape(str(folder))}\n", done.stdout)
    script = """
import hashlib
import numpy as np
from renderer import Octree
from renderer.jit.notice import compile_seconds
from renderer.mesh.shapes import icosphere
octree, rng = Octree.from_mesh(icosphere(5)), np.random.default_rng(1)
origins, digest = 3.0 * rng.normal(size=(5000, 3)), hashlib.sha256()
for count in (5, 5000):
    for bent in (0.0, 1.0):
        hits = octree.closest_hit(origins[:count], bent * rng.normal(size=(count, 3)) - origins[:count])
        digest.update(np.concatenate([hits.t, hits.face, hits.u, hits.v]).tobytes())
octree.refit(octree.mesh.vertices * [1.0, 2.0, 0.5])
digest.update(octree.closest_hit(origins, -origins).t.tobytes())
print(digest.hexdigest(), compile_seconds())
"""
    said = []
    for more in ({}, {"OCTREE_RENDERER_KERNELS": str(folder), "NUMBA_CACHE_DIR": str(tmp_path / "empty")}):
        options = {"cwd": ROOT, "env": {**os.environ, **more}, "timeout": 300}
        out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, **options)
        said.append(out.stdout.split())
    assert said[0][0] == said[1][0] and float(said[1][1]) == 0.0
    assert not list((tmp_path / "empty").rglob("*.kernel"))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--level", "x86-64-v3"], "--output: expected a folder, as kernels for a level are not this machine's"),
        (["--level", "x86-64-v9", "-o", "x"], "invalid choice: 'x86-64-v9'"),
        (["--queries", "--pictures"], "not allowed with argument"),
        (["--pictures", "--all"], "not allowed with argument"),
        (["--all", "--queries"], "not allowed with argument"),
    ],
)
def test_what_compile_does_not_take_is_one_line(arguments, told):
    command = [sys.executable, "-P", "-m", "renderer", "compile", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2 and told in done.stderr.splitlines()[-1]


def test_compile_shows_on_a_terminal_how_far_it_is():
    script = """
import io, sys
class Terminal(io.StringIO):
    def isatty(self): return True
from renderer.cli.main import main
sys.stderr = Terminal()
assert main(["compile", "--queries"]) == 0
shown = sys.stderr.getvalue()
sys.stderr = sys.__stderr__
print("brute force" in shown, "/14 " in shown)
"""
    assert output(script).split()[-2:] == ["True", "True"]
