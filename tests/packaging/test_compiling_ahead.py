"""Compiling ahead: it leaves nothing to compile, and kernels for a level of processors have the bits of native ones."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from signatures import SIGNATURES

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.judges(
    "octree-render compile", "octree-render compile --all", "octree-render compile --level",
    "octree-render compile --output", "octree-render compile --pictures", "octree-render compile --queries",
)  # fmt: skip


def output(script):
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


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
    for options in ({}, {"accelerator": "brute", "max_depth": 1}, {"split": "midpoint", "samples": 4}):
        render(load_scene(f"scenes/{name}.toml"), resolution=(3, 2), **options)
    prepared = prepare_scene(load_scene(f"scenes/{name}.toml"), needs_of(load_scene(f"scenes/{name}.toml")), "octree")
    face_colors(prepared.arrays, [0, 1, 5])
    ray_path(prepared, [0, 1, 5], [0, 0, -1], 2)
    visited(prepared.octree, [0, 1, 5], [0, 0, -1])
from renderer import PerspectiveCamera, Phong, Scene, SceneObject
from renderer.mesh.shapes import icosphere
ball = icosphere(4)
balls = [SceneObject(mesh=ball, material="grey", translate=(k, 0, 0)) for k in range(6)]
copies = Scene(camera=PerspectiveCamera(eye=(0, 1, 9), target=(0, 0, 0)), materials={"grey": Phong()}, objects=balls)
assert prepare_scene(copies, needs_of(copies)).arrays.placed.size
for options in ({}, {"split": "midpoint", "samples": 4}):
    render(copies, resolution=(3, 2), **options)
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
import warnings
from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import icosphere
from renderer.queryable import Queries
from renderer.studies import ambient_occlusion, occlusion, scan, sky_view_factor, visible_faces
from renderer.studies import view_factors, view_factors_from
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
    few, groups = {"max_rays": 512}, np.arange(len(tree.mesh.faces)) // 9
    for sides, shares in (("front", None), ("both", None), ("both", groups % 2 / 2)):
        with warnings.catch_warnings(action="ignore"):
            view_factors(tree, groups, sides=sides, transmittance=shares, **few)
            view_factors(tree, groups, sides=sides, transmittance=shares, form="rays", max_rays=8)
            view_factors_from(tree, corners[:9], -corners[:9], groups, sides=sides, transmittance=shares, **few)
public = {name for name, value in vars(Queries).items() if callable(value) and not name.startswith("_")}
assert public == asked, public ^ asked
print(len(before), *sorted(signatures() - before))
"""
    count, *new = output(SIGNATURES + script).splitlines()[-1].split(maxsplit=1)
    assert int(count) > 20 and not new


def test_kernels_of_queries_are_those_of_every_query_of_a_scene():
    script = """
import numpy as np
from renderer.precompile import compile_ahead
compile_ahead("queries")
before = signatures()
from renderer import Mesh, RayScene
from renderer.mesh.shapes import icosphere
from renderer.studies import occlusion, scan, visible_faces
ball, rng = icosphere(3), np.random.default_rng(1)
places = np.stack([np.eye(3, 4), np.eye(3, 4) * 2.0])
for one in (ball, Mesh(ball.vertices.astype(np.float32), ball.faces)):
    scene, size = RayScene(), float(one.vertices.max())
    scene.add(one, places)
    for count in (1, 9, 100):
        a, b = rng.normal(size=(2, count, 3)) * size
        hits = scene.closest_hit(a, -a)
        met = np.nan_to_num(hits.points)
        for query in (scene.closest_hit, scene.any_hit, scene.all_hits, scene.count_hits):
            query(a, b), query(a, -a, mask=np.arange(count), faces="front"), query(a, -a, ignore=hits)
            query(met, a, leaving=hits), query(met, -a, leaving=hits.through())
        scene.closest_hit(a, b, t_error=True), scene.count_steps(a, b)
        scene.contains(a), scene.contains(a, winding=True), scene.closest_point(a), scene.signed_distance(a)
        for at in (a[0], scene.merged.triangles[0].mean(axis=0)):
            occlusion(scene, at, None, b), scan(scene, at, b), visible_faces(scene, at)
    scene.move(0, places + 1.0), scene.refit(0, one.vertices * 1.5), scene.closest_hit(a, b)
print(len(before), *sorted(signatures() - before))
"""
    count, *new = output(SIGNATURES + script).splitlines()[-1].split(maxsplit=1)
    assert int(count) > 20 and not new


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
    from renderer import precompile
    from renderer.precompile import PARTS
    precompile.available_threads = lambda: 1  # another process would compile all
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
from renderer.precompile import PARTS
print("brute force" in shown, f"/{len(PARTS['queries'])} " in shown)
"""
    assert output(script).split()[-2:] == ["True", "True"]
