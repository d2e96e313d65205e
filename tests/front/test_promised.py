"""Sentences of the public docstrings and of the commands' help that no other test asked: one test each."""

import sys
import time
import tracemalloc
import urllib.error
import urllib.request
import warnings
from dataclasses import fields
from pathlib import Path
from typing import Any

import igl
import numpy as np
import pytest
import trimesh

import renderer
from renderer import (
    BruteForce,
    CutWarning,
    Dielectric,
    Mesh,
    Mirror,
    Octree,
    Phong,
    PointLight,
    load_scene,
    needs_of,
    prepare,
    render,
)
from renderer.cli import main
from renderer.mesh.shapes import icosphere
from renderer.picture import prepare as preparing
from renderer.shade import records

SCENES = Path(__file__).parents[2] / "scenes"
GLASS, STAIRS, BLOCK = SCENES / "glass.toml", SCENES / "stairs.toml", SCENES / "models" / "block.ply"
SIZE = (24, 16)


def through(count: int) -> tuple[Any, Any]:
    """Rays downwards over the unit sphere."""
    x, y = np.random.default_rng(3).uniform(-0.5, 0.5, (2, count))
    return np.stack([x, y, np.full(count, 3.0)], 1), [0.0, 0.0, -1.0]


# Queries


def test_all_hits_have_integers_of_64_bits_and_a_face_each() -> None:
    found = Octree.from_mesh(icosphere(2)).all_hits(*through(50))
    assert found.face.dtype == found.offsets.dtype == found.ray.dtype == found.counts.dtype == np.int64
    assert len(found.face) == len(found.t) == found.offsets[-1] == 100 and found.t_error is None


def test_rays_of_several_dimensions_are_counted_in_c_order() -> None:
    origins = np.array([[[0.0, 0.0, 3.0], [9.0, 0.0, 3.0]], [[0.1, 0.0, 3.0], [0.2, 0.0, 3.0]]])
    found = Octree.from_mesh(icosphere(2)).all_hits(origins, [0.0, 0.0, -1.0], max_hits=1)
    assert found.ray.tolist() == [0, 2, 3] and found.counts.tolist() == [[1, 0], [1, 1]]


def test_memory_of_all_hits_grows_with_what_is_found() -> None:
    vertices = np.tile([[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]], (400, 1))
    vertices[:, 2] = np.repeat(np.arange(400.0), 3)
    octree = Octree(vertices, np.arange(1200).reshape(-1, 3))
    origins = np.concatenate([np.random.default_rng(1).uniform(-0.4, 0.4, (5000, 2)), np.full((5000, 1), 500.0)], 1)
    peaks = []
    for t_max in (110.0, 600.0):  # of 500 to 101: ten hits, and all 400
        octree.all_hits(origins[:9], [0.0, 0.0, -1.0], t_max=t_max)
        tracemalloc.start()
        found = octree.all_hits(origins, [0.0, 0.0, -1.0], t_max=t_max)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert len(found.t) == 2_000_000
    # A fortieth is found: a third leaves room for what depends on the rays alone.
    assert peaks[0] < peaks[1] / 3


def test_signs_of_distances_are_those_of_libigl_and_not_of_trimesh() -> None:
    mesh = icosphere(2)
    points = np.random.default_rng(2).uniform(-1.4, 1.4, (200, 3))
    ours = Octree.from_mesh(mesh).signed_distance(points)
    assert (ours > 0.01).any() and (ours < -0.01).any()
    assert np.allclose(ours, igl.signed_distance(points, mesh.vertices, mesh.faces)[0], atol=1e-12)
    theirs = trimesh.proximity.signed_distance(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), points)
    assert np.allclose(ours, -theirs, atol=1e-7)


def test_u_and_v_of_nearest_points_weigh_the_second_and_third_corner() -> None:
    mesh = Mesh([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 8.0, 0.0]], [[0, 1, 2]])
    found = Octree.from_mesh(mesh).closest_point([[1.0, 2.0, 5.0], [3.0, -1.0, 1.0]])
    assert found.u.tolist() == [0.25, 0.75] and found.v.tolist() == [0.25, 0.0]


def test_a_refit_keeps_what_belongs_to_vertices() -> None:
    mesh = icosphere(1)
    full = Mesh(mesh.vertices, mesh.faces, mesh.vertices, np.abs(mesh.vertices), mesh.vertices[:, :2])
    octree = Octree.from_mesh(full)
    octree.refit(mesh.vertices * 2.0)
    for name in ("normals", "colors", "texcoords"):
        assert np.array_equal(getattr(octree.mesh, name), getattr(full, name))


# Meshes


def test_meshes_compare_and_hash_by_identity() -> None:
    first, second = icosphere(0), icosphere(0)
    assert first != second and len({first, second, first}) == 2


def test_closed_is_told_by_index() -> None:
    mesh = icosphere(0)
    soup = Mesh(mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))
    assert mesh.is_closed() and not soup.is_closed()


# Scenes and pictures


def test_rows_for_kernels_have_their_columns() -> None:
    for material in (Dielectric(), Mirror(), Phong()):
        assert material.row().shape == (records.MATERIAL_COLUMNS,) and material.row().dtype == np.float64
    light = PointLight(position=(0.0, 1.0, 0.0), intensity=(1.0, 1.0, 1.0))
    assert light.row().shape == (records.LIGHT_COLUMNS,) and light.row().dtype == np.float64


def test_the_kind_of_phong_follows_its_colours() -> None:
    black, grey = (0.0, 0.0, 0.0), (0.5, 0.5, 0.5)
    kinds = [Phong(diffuse=d, specular=s).kind for d in (black, grey) for s in (black, grey)]
    assert kinds == [records.UNLIT, records.PHONG, records.LAMBERT, records.PHONG]


def test_cut_counts_the_pixels_that_miss_rays_and_the_warning_says_it() -> None:
    scene = load_scene(GLASS)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        image = render(scene, resolution=SIZE, max_rays=3)
    whole = render(scene, resolution=SIZE)
    assert image.cut == np.count_nonzero(image.rays < whole.rays) > 0
    assert [str(one.message) for one in said if one.category is CutWarning] == [image.cut_message(3)]
    assert f"{image.cut:,} of {SIZE[0] * SIZE[1]:,} pixels" in image.cut_message(3)


def test_a_prepared_scene_holds_what_it_says() -> None:
    scene = load_scene(GLASS)
    render(scene, resolution=SIZE)  # what is compiled counts for nothing
    began = time.perf_counter()
    prepared, brute = prepare(scene), prepare(scene, accelerator="brute")
    image = render(prepared, resolution=SIZE)
    elapsed = time.perf_counter() - began
    assert prepared.scene is scene
    triangles = np.concatenate([instance.mesh.triangles for instance in scene.instances])
    assert np.array_equal(prepared.mesh.triangles, triangles)
    assert type(prepared.octree) is Octree and type(brute.octree) is BruteForce
    assert prepared.octree.mesh is prepared.mesh
    for feature in fields(prepared.needs):
        assert getattr(prepared.needs, feature.name) >= getattr(needs_of(scene), feature.name), feature.name
    assert image.build_seconds == prepared.build_seconds > 0.0 < image.render_seconds
    assert prepared.build_seconds + brute.build_seconds + image.render_seconds <= elapsed


@pytest.mark.parametrize("split", ["midpoint", "sah"])
def test_split_is_that_of_the_tree(split: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are the same either way, so the tree is watched."""
    built = []
    from_mesh = Octree.from_mesh

    def watched(mesh: Mesh, **options: Any) -> Octree:
        built.append(options["split"])
        return from_mesh(mesh, **options)

    monkeypatch.setattr(preparing.Octree, "from_mesh", watched)
    render(load_scene(GLASS), resolution=SIZE, split=split)
    assert main(["render", str(GLASS), "--resolution", "9x9", "--split", split, "-o", str(tmp_path / "a.npy")]) == 0
    assert built == [split, split]


# Commands


def test_max_rays_of_the_command_is_that_of_the_library(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    assert main(["render", str(GLASS), "--resolution", "24x16", "--max-rays", "3", "-o", str(path), "--quiet"]) == 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CutWarning)
        cut = render(load_scene(GLASS), resolution=SIZE, max_rays=3).radiance
    assert np.array_equal(np.load(path), cut)
    assert not np.array_equal(cut, render(load_scene(GLASS), resolution=SIZE).radiance)


def asked(url: str) -> int:
    """The status with which a server answers."""
    try:
        with urllib.request.urlopen(url, timeout=30.0) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_a_view_that_other_machines_reach_wants_the_token() -> None:
    pytest.importorskip("uvicorn", reason="the extra viewer is not installed")
    with renderer.view(STAIRS, host="0.0.0.0", browser=False) as viewing:
        plain, _, token = viewing.url.partition("?token=")
        assert len(token) >= 32 and asked(viewing.url) == 200 and asked(plain) == 403


def test_the_command_view_takes_host_and_writes_the_scene_of_a_mesh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("uvicorn", reason="the extra viewer is not installed")
    from renderer.viewer.server import ViewerServer

    monkeypatch.setattr(ViewerServer, "wait", lambda self: None)
    monkeypatch.setattr(ViewerServer, "close", lambda self: None)
    written = tmp_path / "a.toml"
    given = ["view", str(BLOCK), "--write-scene", str(written), "--host", "0.0.0.0", "--no-browser"]
    assert main(given) == 0
    assert "?token=" in capsys.readouterr().out
    assert len(load_scene(written).instances) == len(load_scene(BLOCK).instances)


@pytest.mark.parametrize("what", ["queries", "pictures", "all"])
def test_compile_compiles_what_it_is_told(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from renderer import precompile

    asked_for: list[str] = []
    monkeypatch.setattr(precompile, "compile_ahead", lambda what, began: asked_for.append(what))
    assert main(["compile", f"--{what}", "--quiet"]) == 0
    assert asked_for == [what]
    parts = [set(map(str, precompile.PARTS[one])) for one in ("queries", "pictures", "all")]
    assert parts[0] < parts[1] < parts[2]


def test_compile_is_quiet_on_a_terminal(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    from renderer import cli, precompile

    monkeypatch.setattr(precompile, "compile_ahead", lambda what, began: [began(str(part)) for part in "ab"])
    monkeypatch.setattr(cli, "on_terminal", lambda: True)
    assert main(["compile", "--quiet"]) == 0
    assert capfd.readouterr() == ("", "")
    assert main(["compile"]) == 0
    loud = capfd.readouterr()
    assert "compiled in" in loud.out and ("part" in loud.err or sys.platform == "win32")
