"""Files of lit scenes: a scene file shows the same bits, and other programs get colours."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow

from renderer import (
    Mesh,
    Mirror,
    OpenCVCamera,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneObject,
    Sky,
    Texture,
    load_mesh,
    load_scene,
    render,
    shapes,
    srgb,
)
from renderer.radiosity import save_lit

pytestmark = pytest.mark.judges("radiosity.save_lit")

EYE = PerspectiveCamera(eye=(0.5, 0.6, 4), target=(0.5, 0.5, 0), fov=30)
COLORS = np.linspace(0, 1, 24).reshape(8, 3).astype(np.float32)


def lit(**more: Any) -> Scene:
    """A scene as ``lit_scene`` makes them."""
    cube = shapes.box()
    cube = Mesh(cube.vertices, cube.faces, colors=COLORS)
    ball = Mesh(shapes.icosphere(2).vertices / 3, shapes.icosphere(2).faces, normals=shapes.icosphere(2).vertices)
    shining = Phong(diffuse=0, emission=(2.5, 0.25, 1 / 3), vertex_colors="linear")
    objects = [SceneObject(mesh=cube, material='a "b"'), SceneObject(mesh=ball, material="mirror", normals="smooth")]
    materials = {'a "b"': shining, "mirror": Mirror(reflectance=(0.1, 0.2, 1 / 3))}
    return Scene(**{"camera": EYE, "materials": materials, "objects": objects, "background": (0.1, 0.2, 0.3), **more})


@cases(
    "more",
    [
        {},
        {"background": 0, "sky": Sky(zenith=0.1, ground=0.7, lights=0)},
        {"up": "z", "render": {"resolution": (20, 16), "samples": 4}},
        {
            "camera": OpenCVCamera(
                eye=(0, 0, 4), target=(0, 0, 0), width=20, height=16, fx=20, fy=20, cx=10, cy=8, k1=0.1
            )
        },
    ],
)
def test_a_scene_file_shows_the_same_bits(tmp_path: Path, more: dict[str, Any]) -> None:
    scene = lit(**more)
    files = save_lit(scene, tmp_path / "room.toml")
    assert [file.name for file in files] == ["room.toml", "room-0.ply", "room-1.ply"]
    assert sorted(files) == sorted(tmp_path.iterdir())
    again = load_scene(files[0])
    assert again.render == scene.render and again.camera == scene.camera and again.materials == scene.materials
    size = {} if "render" in more or "camera" in more else {"resolution": 24}
    assert np.array_equal(render(again, **size).radiance, render(scene, **size).radiance)


def test_textures_are_named_from_beside_the_scene_file(tmp_path: Path) -> None:
    Pillow.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(tmp_path / "tiles.png")
    folder = tmp_path / "below"
    folder.mkdir()
    ground = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], colors=np.ones((3, 3)), texcoords=np.eye(3)[:, :2])
    map_ = Texture(tmp_path / "tiles.png", wrap=("clamp", "mirror"), transform=[[2, 0, 0], [0, 1, 0.5]])
    look = Phong(diffuse=0, emission=1, emission_map=map_, vertex_colors="linear")
    scene = lit(materials={"tiles": look}, objects=[SceneObject(mesh=ground, material="tiles")])
    save_lit(scene, folder / "a.toml")
    assert 'image = "../tiles.png"' in (folder / "a.toml").read_text()
    assert np.array_equal(
        render(load_scene(folder / "a.toml"), resolution=24).radiance, render(scene, resolution=24).radiance
    )
    made = lit(
        materials={"tiles": look.model_copy(update={"emission_map": Texture.checker()})},
        objects=[SceneObject(mesh=ground, material="tiles")],
    )
    with pytest.raises(ValueError, match="emission_map: expected a texture of a file"):
        save_lit(made, folder / "b.toml")


@cases(("exposure", "up"), [(0.0, "y"), (-2.0, "y"), (1.0, "z"), (0.0, "x")])
def test_other_programs_get_colours(tmp_path: Path, exposure: float, up: Any) -> None:
    scene = lit(up=up)
    ply, glb = (save_lit(scene, tmp_path / name, exposure=exposure) for name in ("a.ply", "a.GLB"))
    radiance = np.concatenate([COLORS * np.array([2.5, 0.25, 1 / 3]), np.zeros((162, 3))]) * 2.0**exposure
    found, linear = load_mesh(ply[0]), load_mesh(glb[0])
    assert found.colors is not None and linear.colors is not None
    places = np.concatenate([instance.mesh.vertices for instance in scene.instances])
    assert np.array_equal(found.vertices, places)
    assert np.array_equal((255 * found.colors).round(), srgb(radiance))
    assert np.allclose(linear.colors, np.clip(radiance, 0, 1), atol=1e-7)
    x, y, z = places.T
    turned = {"x": (-y, x, z), "y": (x, y, z), "z": (x, z, -y)}[up]
    assert np.allclose(linear.vertices, np.stack(turned, axis=1), atol=1e-7)
    assert np.array_equal(linear.faces, found.faces)


def test_glb_is_read_by_others_and_unlit(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    save_lit(lit(), tmp_path / "a.glb")
    (mesh,) = trimesh.load(tmp_path / "a.glb").geometry.values()
    assert len(mesh.faces) == 12 + 320
    (material,) = load_mesh(tmp_path / "a.glb").materials
    assert material.unlit


@cases(("name", "error"), [("a.obj", ValueError), ("a", ValueError), ("none/a.ply", OSError), (3, ValueError)])
def test_bad_paths(tmp_path: Path, name: Any, error: type[Exception]) -> None:
    with pytest.raises(error):
        save_lit(lit(), name if isinstance(name, int) else tmp_path / name)
    assert list(tmp_path.iterdir()) == []
