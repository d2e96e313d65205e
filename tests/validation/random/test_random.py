"""What is drawn at random is the same for equal seeds, and what fails is kept whole and made small."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.mesh.load import load_mesh
from renderer.mesh.shapes import icosphere
from renderer.scene.scene import load_scene
from validation.gates import Gate
from validation.job import Job
from validation.random import section
from validation.random.meshes import draw_mesh
from validation.random.scenes import draw_scene
from validation.random.shrink import shrunk, smaller_meshes


def test_equal_seeds_draw_equal_scenes_and_others_do_not(tmp_path: Path) -> None:
    texts = []
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        path = draw_scene(np.random.default_rng([seed, 0, 0])).write(tmp_path / name)
        texts.append([(file.name, file.read_bytes()) for file in sorted(path.parent.iterdir())])
    assert texts[0] == texts[1] and texts[0] != texts[2]


def test_each_kind_is_drawn_and_can_be_read(tmp_path: Path) -> None:
    """Forty scenes have each material, light and camera, open glass, coinciding boxes, and mirrored objects."""
    seen: set[str] = set()
    for number in range(40):
        drawn = draw_scene(np.random.default_rng([1, number, 0]))
        scene = load_scene(drawn.write(tmp_path / str(number)))
        seen |= {type(m).__name__ for m in scene.materials.values()} | {type(scene.camera).__name__}
        seen |= {type(light).__name__ for light in scene.lights} | {thing.normals for thing in scene.objects}
        glass = [i.mesh for i in scene.instances if scene.materials[i.material].passes_light]
        seen |= {"open glass"} if any(len(mesh.open_edges) for mesh in glass) else set()
        seen |= {"mirrored"} if any(np.prod(thing.scale) < 0.0 for thing in scene.objects) else set()
        seen |= {"touching"} if "box.ply" in drawn.meshes else set()
        seen |= {"no floor"} if scene.floor is None else {"floor"}
    assert seen == {
        "Dielectric", "Mirror", "Phong", "PerspectiveCamera", "OrthographicCamera", "DirectionalLight", "PointLight",
        "flat", "smooth", "open glass", "mirrored", "touching", "no floor", "floor",
    }  # fmt: skip


def test_meshes_are_of_float32(tmp_path: Path) -> None:
    for number in range(20):
        mesh = draw_mesh(np.random.default_rng([2, number, 1]))
        assert len(mesh.faces) and np.array_equal(mesh.vertices.astype(np.float32), mesh.vertices)


def test_a_mesh_is_made_as_small_as_it_may_be() -> None:
    ball = icosphere(2)
    lowest = ball.vertices[ball.faces].min(axis=(0, 1))[2]
    small = shrunk(ball, smaller_meshes, lambda mesh: bool((mesh.triangles[:, :, 2] == lowest).any()))
    assert len(small.faces) == 1 and (small.triangles[:, :, 2] == lowest).any()


def test_a_scene_that_fails_is_kept_and_made_small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A gate that fails where an object is a mirror: all other objects and lights can go."""

    def mirrors_fail(name: str, shows: str, scene: Any, effort: Any, job: Job) -> Any:
        used = {type(scene.materials[thing.material]).__name__ for thing in scene.objects}
        gate = Gate("images", name, "mirrors", float("Mirror" in used), "at most", 0.0, "a test")
        return {"faces": 0, "rungs": [{"comparisons": []}]}, [gate]

    monkeypatch.setattr(section, "check_scene", mirrors_fail)
    rows = [section.judge_scene(5, number, tmp_path) for number in range(8)]
    failing = [row for row in rows if row["red"]]
    assert failing and len(failing) < len(rows) and {str(row["red"]) for row in failing} == {"['mirrors']"}
    assert all(("mirror" in row["subject"]) is bool(row["red"]) for row in rows)
    for row in failing:
        whole, small = (load_scene(tmp_path / row["kept"] / part / "scene.toml") for part in ("", "small"))
        assert len(small.objects) == 1 and not small.lights and small.floor is None and small.render.max_depth == 0
        assert type(small.materials[small.objects[0].material]).__name__ == "Mirror"
        assert len(small.instances[0].mesh.faces) == 1 <= len(whole.instances[0].mesh.faces)
    gate = section._gate(rows[0])
    assert gate.section == "random" and gate.subject == rows[0]["subject"]


def test_a_mesh_that_fails_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def large_fail(name: str, mesh: Any, effort: Any, job: Job) -> Any:
        return {"costs": {}}, [Gate("hits", name, "size", float(len(mesh.faces)), "at most", 9.0, "a test")]

    monkeypatch.setattr(section, "check_mesh", large_fail)
    row = section.judge_mesh(1, 0, tmp_path)
    assert row["red"] == ["size"]
    assert 10 <= len(load_mesh(tmp_path / row["kept"] / "small.ply").faces) < 20
