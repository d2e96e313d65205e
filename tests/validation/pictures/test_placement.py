"""Objects of a scene against trimesh: what is read, moved or smoothed wrongly is seen, and what is open is said."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.scene.scene import Scene, load_scene
from validation.pictures import placement

SCENE = """
[camera]
eye = [0, 0, 9]
target = [0, 0, 0]
[materials.red]
diffuse = 0.5
[[objects]]
mesh = "ball.ply"
material = "red"
normals = "smooth"
scale = {scale}
rotate = [20, -30, 70]
translate = [1, 2, -0.5]
"""


def scene_of(folder: Path, scale: str = "[1, 0.5, 2]", faces: Any = None) -> Scene:
    ball = icosphere(1)
    save_ply(ball if faces is None else Mesh(ball.vertices, faces), folder / "ball.ply")
    (folder / "scene.toml").write_text(SCENE.format(scale=scale), encoding="utf-8")
    return load_scene(folder / "scene.toml")


def verdicts(scene: Scene) -> list[bool]:
    return [gate.passed for gate in placement.check("small", scene)[1]]


def test_a_sound_scene_passes(tmp_path: Path) -> None:
    record, gates = placement.check("small", scene_of(tmp_path))
    assert [gate.passed for gate in gates] == [True, True]
    assert record["objects"] == record["smooth"] == 1 and not record["left_out"]


@pytest.mark.judges("Scene.altered")
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_object_turned_otherwise_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, axis: int) -> None:
    sound = scene_of(tmp_path)
    rotate = list(sound.objects[0].rotate)
    rotate[axis] += 0.01
    other = sound.objects[0].model_copy(update={"rotate": tuple(rotate)})
    wrong = sound.model_copy(update={"objects": (other,)})  # and the meshes as they were placed
    assert verdicts(wrong) == [False, False]


def test_normals_weighted_by_area_are_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(tmp_path)
    instance = scene.instances[0]
    mesh, sums = instance.mesh, np.zeros_like(instance.mesh.vertices)
    a, b, c = (mesh.triangles[:, k] for k in range(3))
    for corner in range(3):
        np.add.at(sums, mesh.faces[:, corner], np.cross(b - a, c - a))
    by_area = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    monkeypatch.setattr(type(instance), "normals", by_area)
    assert verdicts(scene) == [True, False]


def test_quads_whose_triangles_trimesh_puts_elsewhere_are_judged_by_their_places(tmp_path: Path) -> None:
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 2)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + ["f 1 2 4 3", "f 1 2 6", "f 5 6 8 7", "f 3 4 8"]
    (tmp_path / "ball.ply").unlink(missing_ok=True)
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    text = SCENE.format(scale="[1, 0.5, 2]").replace("ball.ply", "box.obj").replace('normals = "smooth"\n', "")
    (tmp_path / "scene.toml").write_text(text)
    scene = load_scene(tmp_path / "scene.toml")
    assert verdicts(scene) == [True]
    # A face that names another corner is seen all the same.
    (tmp_path / "box.obj").write_text("\n".join([*lines[:-1], "f 3 4 7"]) + "\n")
    assert verdicts(scene) == [False]
