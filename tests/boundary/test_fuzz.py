"""A short run of tests/fuzz, and proof that its checks find what they are there to find."""

import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from fuzz import faults, files, run, scenes
from numpy.random import default_rng

from renderer import (
    BruteForce,
    Dielectric,
    Octree,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneObject,
    load_scene,
    octree,
    render,
)
from renderer.errors import MeshError
from renderer.mesh import load as mesh_io
from renderer.mesh import ply
from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.scene.scene import write_scene

INPUTS = 200
# Inputs of the other kinds, and two of the outcomes that must be among them.
SHORT = {
    "camera": (200, {"refused", "hit"}),
    "light": (100, {"refused", "hit"}),
    "transform": (150, {"refused", "hit"}),
    "settings": (100, {"refused", "hit"}),
    "query": (400, {"refused", "hit"}),
    "output": (150, {"refused", "written"}),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    run.prepare(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", files.SEEDS)
def test_mutated_files_are_refused_or_right(folder: Path, name: str) -> None:
    outcomes = [files.check(folder / name, files.mutated(name, 0, index), index) for index in range(INPUTS)]
    # Both ways were gone: mutations that all fail, or that all load, would test one of them only. Bad materials are
    # left out, and refuse no mesh.
    assert 0 < outcomes.count("refused") < INPUTS or (name == "a.mtl" and set(outcomes) == {"counted"})


@pytest.mark.parametrize("name", files.SEEDS)
def test_the_seed_files_load(folder: Path, name: str) -> None:
    counted = Path(name).suffix in (*files.COUNTERS, ".mtl")
    assert files.check(folder / name, files.SEEDS[name], 0) == ("counted" if counted else "loaded")


def test_finds_an_exception_that_is_let_through(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def careless(content: bytes, repairs: Any = None) -> Mesh:
        raise KeyError("x")

    monkeypatch.setitem(mesh_io._PARSERS, ".ply", careless)
    with pytest.raises(KeyError):
        files.check(folder / "ascii.ply", files.SEEDS["ascii.ply"], 0)


@pytest.mark.parametrize("name", ["little.ply"])
def test_finds_a_face_that_is_dropped_silently(folder: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    cut = ply._polygons
    monkeypatch.setattr(ply, "_polygons", lambda *given: cut(*given)[:-6])
    with pytest.raises(AssertionError, match="a silent drop"):
        files.check(folder / name, files.SEEDS[name], 0)


def test_finds_a_repair_without_its_warning(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = folder / "plain.obj"
    content = files.SEEDS["plain.obj"] + b"f 1 2 99\n"
    assert files.check(path, content, 0) == "repaired"
    monkeypatch.setattr(mesh_io.warnings, "warn", lambda *_, **__: None)
    with pytest.raises(AssertionError, match="without its warning"):
        files.check(path, content, 0)


def test_finds_a_reader_that_does_not_end(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def endless(content: bytes, repairs: Any = None) -> Mesh:
        while True:
            pass

    monkeypatch.setitem(mesh_io._PARSERS, ".ply", endless)
    monkeypatch.setattr(files, "SECONDS", 0.05)
    with pytest.raises(TimeoutError):
        files.check(folder / "ascii.ply", files.SEEDS["ascii.ply"], 0)


def test_finds_a_wrong_hit(monkeypatch: pytest.MonkeyPatch) -> None:
    right = octree.BruteForce.closest_hit

    def wrong(self: octree.BruteForce, *rays: Any) -> Any:
        hits = right(self, *rays)
        hits.t[hits.hit] = np.nextafter(hits.t[hits.hit], 0.0)
        return hits

    assert files.check_mesh(box(), default_rng(0))
    monkeypatch.setattr(octree.BruteForce, "closest_hit", wrong)
    with pytest.raises(AssertionError):
        files.check_mesh(box(), default_rng(0))


# --- scenes, rays and faults -----------------------------------------------------------------------------------


def judged(folder: Path, name: str, inputs: int) -> Counter[str]:
    kind = run.KINDS[name]
    return Counter(kind.judge(folder, kind.make(0, index), index) for index in range(inputs))


def complaints(folder: Path, name: str, inputs: int) -> str:
    """What the checks of a kind say, all in one text."""
    kind, told = run.KINDS[name], []
    for index in range(inputs):
        try:
            kind.judge(folder, kind.make(0, index), index)
        except AssertionError as error:
            told.append(str(error))
    return "\n".join(told)


@pytest.mark.parametrize("name", SHORT)
def test_extreme_inputs_are_refused_or_right(folder: Path, name: str) -> None:
    inputs, among = SHORT[name]
    assert among <= set(judged(folder, name, inputs))


@cases("name", SHORT)
def test_extreme_inputs_are_the_same_again(name: str) -> None:
    make = run.KINDS[name].make
    inputs = [repr(make(3, index)) for index in range(40)]
    assert inputs == [repr(make(3, index)) for index in range(40)]
    assert len(set(inputs)) > 20 and inputs != [repr(make(4, index)) for index in range(40)]


def test_the_folder_runs_as_a_command() -> None:
    """Modules such as ``files`` stand beside ``__main__.py``; those of the package are found all the same."""
    command = [sys.executable, str(Path(run.__file__).parent), "--inputs", "1", "--first", "4711", "--kinds", "camera"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and "\n1 inputs in" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("plane", ["depth", "nan"])
@pytest.mark.parametrize("name", ["camera", "settings"])
def test_finds_another_picture(folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, plane: str) -> None:
    """Every second picture has one pixel that is another by one bit, or all have one of no light."""
    right, calls = scenes.render, [0]

    def wrong(*arguments: Any, **options: Any) -> Any:
        image = right(*arguments, **options)
        calls[0] += 1
        if plane == "nan":
            radiance = image.radiance.copy()
            radiance[-1, -1] = np.nan
            return replace(image, radiance=radiance)
        if calls[0] % 2:
            return image
        changed = getattr(image, plane).copy()
        changed.view(np.uint8).reshape(-1)[0] ^= 1
        return replace(image, **{plane: changed})

    monkeypatch.setattr(scenes, "render", wrong)
    assert ("no light" if plane == "nan" else f"another {plane}") in complaints(folder, name, 20)


@pytest.mark.parametrize("name", ["camera", "query"])
def test_finds_an_error_that_is_not_clear(folder: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    def unclear(*_: Any, **__: Any) -> None:
        raise ValueError("1 validation error\nhttps://errors.pydantic.dev")

    monkeypatch.setattr(scenes, "render", unclear)
    monkeypatch.setattr(Octree, "closest_hit", unclear)
    assert "says not what is wrong" in complaints(folder, name, 20)


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("t", -0.0, "t below 0 or -0.0"),
        ("t", 0.123456, "another t"),
        ("u", 0.25, "another u"),
        ("face", 0, "another face"),
    ],
)
def test_finds_another_hit(folder: Path, monkeypatch: pytest.MonkeyPatch, field: str, value: float, said: str) -> None:
    right = Octree.closest_hit

    def wrong(self: Octree, *arguments: Any, **options: Any) -> Any:
        hits = right(self, *arguments, **options)
        getattr(hits, field)[hits.hit] = value
        return hits

    monkeypatch.setattr(Octree, "closest_hit", wrong)
    assert said in complaints(folder, "query", 60)


def test_finds_that_any_hit_differs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    right = BruteForce.any_hit
    monkeypatch.setattr(BruteForce, "any_hit", lambda self, **rays: ~right(self, **rays))
    assert "any_hit is not hit" in complaints(folder, "query", 60)


def test_finds_a_file_that_is_left_or_cut_off(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Written in place, not beside and renamed; and an error that names nothing."""

    def careless(path: Any, write: Any) -> None:
        try:
            with faults.files.open(path, "wb") as file:
                write(file)
        except OSError as error:
            raise OSError("no") from error

    monkeypatch.setattr(faults.files, "open", open, raising=False)
    for module in ("renderer.picture.image", "renderer.scene.scene", "renderer.mesh.load"):
        monkeypatch.setattr(f"{module}.write_atomically", careless)
    said = complaints(folder, "output", 100)
    assert all(text in said for text in ("left by a failure", "the path is not named", "a failure that is not told"))


# --- what the long run found -----------------------------------------------------------------------------------


def a_scene(**placed: Any) -> Scene:
    ball = SceneObject(mesh=box(), material="grey", **placed)
    return Scene(camera=PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0)), materials={"grey": Phong()}, objects=[ball])


TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]


def known(reason: str) -> Any:
    return pytest.mark.xfail(strict=True, reason=reason)


def test_an_object_beyond_float32_is_placed_without_a_warning() -> None:
    assert a_scene(translate=(1e39, 0, 0)).instances


def test_an_object_of_no_size_is_placed_without_a_warning() -> None:
    assert a_scene(scale=5e-324, rotate=(60, -20, -80)).instances


def test_huge_glass_is_refused_without_a_warning() -> None:
    scene = a_scene(scale=1e200, translate=(-5e199, -5e199, -5e199)).altered(materials={"grey": Dielectric()})
    with pytest.raises(ValueError, match="largest coordinate"):
        render(scene, resolution=(2, 2))


def test_a_far_origin_at_a_tiny_mesh_is_refused_without_a_warning() -> None:
    octree = Octree(np.array(TRIANGLE[0]) * 1e-300, TRIANGLE[1])
    with pytest.raises(ValueError, match=r"^origins: "):
        octree.closest_hit([[1e300, 0, 0]], [[0, 0, 1]])


@pytest.mark.parametrize("kind", [complex, str])
def test_no_rays_of_a_wrong_type_are_refused(kind: type) -> None:
    with pytest.raises(ValueError, match=r"^origins: expected real numbers"):
        Octree(*TRIANGLE).closest_hit(np.empty((0, 3), kind), np.empty((0, 3)))


def test_no_hit_comes_before_t_min() -> None:
    octree = Octree(np.array(TRIANGLE[0]) * 2.0**1000, TRIANGLE[1])
    assert not octree.any_hit([[2.0**998, 2.0**998, 1e-300]], [[0, 0, -1]], 1e-299).any()


@known("t is kept times the tree's scale, where it may be denormal")
def test_t_keeps_its_digits_at_a_huge_mesh() -> None:
    octree = Octree(np.array(TRIANGLE[0]) * 2.0**1000, TRIANGLE[1])
    hits = octree.closest_hit([[2.0**998, 2.0**998, 2.0**600 * 1e-10]], [[0, 0, -(2.0**600)]])
    assert hits.t[0] == pytest.approx(1e-10, rel=2.0**-50, abs=0.0)


def test_barycentrics_have_no_sign_at_zero() -> None:
    hits = Octree(*TRIANGLE).closest_hit([[0, 0, 1]], [[0, 0, -1]])
    assert not np.signbit(hits.u).any() and not np.signbit(hits.v).any()


def test_an_unused_far_vertex_is_refused_without_a_warning() -> None:
    with pytest.raises(MeshError, match="within 2"):
        Octree([*(np.array(TRIANGLE[0]) * 1e-300).tolist(), [1e300, 0, 0]], TRIANGLE[1])


def test_a_face_with_sides_beyond_float64_has_a_normal() -> None:
    octree = Octree([[-1.7e308, 0, 0], [1.7e308, 0, 0], [0, 1.7e308, 0]], [[0, 1, 2]])
    assert octree.closest_hit([[0, 1e307, 1e300]], [[0, 0, -1e200]]).normals.tolist() == [[0, 0, 1]]


def test_a_scene_is_not_written_to_a_loop(tmp_path: Path) -> None:
    save_ply(box(), tmp_path / "box.ply")
    (tmp_path / "a.toml").symlink_to("a.toml")
    with pytest.raises(OSError, match=r"a\.toml"):
        write_scene(tmp_path / "box.ply", tmp_path / "a.toml")


def test_a_scene_written_through_a_link_finds_its_mesh(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    save_ply(box(), tmp_path / "box.ply")
    (tmp_path / "a.toml").symlink_to("sub/there.toml")
    write_scene(tmp_path / "box.ply", tmp_path / "a.toml")
    assert load_scene(tmp_path / "a.toml").instances


def test_a_null_byte_in_a_path_is_told_with_the_path(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"a.*b\.ply"):
        save_ply(box(), tmp_path / "a\0b.ply")
