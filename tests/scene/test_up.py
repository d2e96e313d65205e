"""The axis that points up: of mesh files, of scenes, and of the pictures and views that are made of them."""

from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from cases import cases

from renderer import Floor, Image, Mesh, PerspectiveCamera, Phong, Scene, SceneError, load_scene, render
from renderer.arguments.up import UP_AXES, turn_to
from renderer.cli.main import main
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box, torus
from renderer.scene.overview import from_above
from renderer.scene.scene import write_scene

Up = Literal["x", "y", "z"]
AXES: list[Up] = ["x", "y", "z"]
# Of three different sides, none of them in the middle.
RING = Mesh(torus().vertices * (1.0, 2.0, 0.5) + (3.0, -1.0, 7.0), torus().faces)


def lying(mesh: Mesh, up: str) -> Mesh:
    """A mesh with y up as a file has it in which another axis points up."""
    return Mesh(mesh.vertices @ turn_to(up).T, mesh.faces)


def file_of(folder: Path, mesh: Mesh) -> Path:
    save_ply(mesh, folder / "model.ply")
    return folder / "model.ply"


@cases("up", AXES)
def test_turns_take_y_to_the_axis_and_are_rotations(up: Up) -> None:
    turn = turn_to(up)
    assert (turn @ (0, 1, 0)).tolist() == np.eye(3)[UP_AXES[up]].tolist()
    assert np.array_equal(turn @ turn.T, np.eye(3)) and np.linalg.det(turn) == 1.0


def alike(one: Image, other: Image) -> None:
    """The same model before the eye; squares of the floor may be those of the other colour."""
    model = (one.face >= 0) & (one.face < len(RING.faces))
    # A ray that passes an edge within rounding may miss it in one of them.
    assert np.isclose(one.depth, other.depth, rtol=1e-9).mean() > 0.998
    assert model.mean() > 0.05 and (one.face == other.face)[model].mean() > 0.995
    assert np.isclose(one.radiance, other.radiance, atol=1e-5)[model].all(axis=-1).mean() > 0.995


@pytest.mark.judges("load_scene", "scene.up")
@cases("up", AXES)
def test_a_mesh_that_lies_in_its_file_stands_in_the_picture(tmp_path: Path, up: Up) -> None:
    upright = render(load_scene(file_of(tmp_path, RING)), resolution=(60, 50))
    file = file_of(tmp_path, lying(RING, up))
    scene = load_scene(file, up=up)
    assert scene.up == up and scene.camera.up == tuple(np.eye(3)[UP_AXES[up]])
    alike(upright, render(scene, resolution=(60, 50)))
    # As does the scene file that is written of it.
    write_scene(file, tmp_path / "it.toml", up)
    again = render(load_scene(tmp_path / "it.toml"), resolution=(60, 50))
    assert again.radiance.tobytes() == render(scene, resolution=(60, 50)).radiance.tobytes()


@pytest.mark.judges("Floor", "scene.floor.max", "scene.floor.min", "scene.floor.squares", "scene.up")
@cases("up", AXES)
def test_the_floor_lies_across_the_axis_and_faces_up(up: Up) -> None:
    floor = Floor(min=(-1, -2), max=(3, 5), materials=["a", "b"], squares=(2, 3))
    camera = PerspectiveCamera(eye=(4, 5, 6), target=(0, 0, 0))
    scene = Scene(camera=camera, materials={"a": Phong(), "b": Phong()}, floor=floor, up=up)
    axis = UP_AXES[up]
    others = [i for i in range(3) if i != axis]
    meshes = [part.mesh for part in scene.instances]
    assert [len(mesh.faces) for mesh in meshes] == [6, 6]
    area = 0.0
    for mesh in meshes:
        lower, upper = mesh.bounds
        assert lower[axis] == upper[axis] == 0.0 and (lower[others] >= (-1, -2)).all()
        p0, p1, p2 = mesh.triangles.transpose(1, 0, 2)
        normals = np.cross(p1 - p0, p2 - p0)
        assert (normals[:, axis] > 0).all() and not normals[:, others].any()
        area += normals[:, axis].sum() / 2
    assert area == pytest.approx(4 * 7, rel=1e-15)


@pytest.mark.judges("Scene", "scene.up")
def test_a_camera_without_an_up_of_its_own_has_the_scenes() -> None:
    at: dict[str, Any] = {"eye": (4, 5, 6), "target": (0, 0, 0)}
    of_table = Scene(camera=at, materials={}, up="z").camera
    of_camera = Scene(camera=PerspectiveCamera(**at), materials={}, up="z").camera
    own = Scene(camera=PerspectiveCamera(**at, up=(0, 1, 0)), materials={}, up="z").camera
    assert of_table.up == of_camera.up == (0, 0, 1) and own.up == (0, 1, 0)
    # A camera that is left to the scene in a change too.
    assert Scene(camera=at, materials={}, up="x").altered(camera=PerspectiveCamera(**at)).camera.up == (1, 0, 0)


@cases("up", AXES)
def test_the_overview_sees_all_of_the_mesh_from_above(up: Up) -> None:
    mesh = lying(RING, up)
    camera = from_above(mesh, (60, 50), up)
    right, above, forward = camera.frame()
    assert above[UP_AXES[up]] > 0.5 and forward[UP_AXES[up]] < -0.5 and abs(right[UP_AXES[up]]) < 1e-12
    scene = Scene(camera=camera, materials={"m": Phong()}, objects=[{"mesh": mesh, "material": "m"}], up=up)
    seen = render(scene, resolution=(60, 50), max_depth=0).face >= 0
    assert seen.any(axis=1).sum() >= 45 or seen.any(axis=0).sum() >= 55


def test_a_scene_file_has_its_own_axis(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text('up = "z"\nmaterials = {}\n[camera]\neye = [1, 2, 3]\ntarget = [0, 0, 0]\n')
    assert load_scene(tmp_path / "s.toml").camera.up == (0, 0, 1)
    with pytest.raises(SceneError, match=r"^up: expected None for a scene file, which has the key up, got 'z'"):
        load_scene(tmp_path / "s.toml", up="z")
    with pytest.raises(ValueError, match=r"^up: expected 'x', 'y' or 'z', got 'Z'"):
        load_scene(file_of(tmp_path, RING), up="Z")  # type: ignore[arg-type]


NOTICE = "does not say which axis points up: y was taken; --up x|y|z changes it"


@pytest.mark.judges("octree-render render --up")
def test_the_command_says_once_which_axis_it_took(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where neither the user nor the file says it: not for a scene, not with the option, not in silence."""
    file, out = str(file_of(tmp_path, box())), str(tmp_path / "out.png")
    rest = ["-o", out, "--resolution", "16", "--samples", "1"]
    assert main(["render", file, *rest]) == 0
    assert capsys.readouterr().err.splitlines() == [f"octree-render: {file} {NOTICE}"]
    assert main(["render", file, *rest, "--up", "y"]) == 0 and NOTICE not in capsys.readouterr().err
    assert main(["render", file, *rest, "--quiet"]) == 0 and NOTICE not in capsys.readouterr().err
    written = str(tmp_path / "it.toml")
    assert main(["render", file, *rest, "--up", "z", "--write-scene", written]) == 0
    assert load_scene(written).up == "z" and NOTICE not in capsys.readouterr().err
    assert main(["render", written, *rest]) == 0 and NOTICE not in capsys.readouterr().err
    assert main(["render", written, *rest, "--up", "z"]) == 2
    assert capsys.readouterr().err.startswith("octree-render: up: expected none for a scene file")
    assert main(["render", file, "-o", out, "--samples", "3"]) == 2 and NOTICE not in capsys.readouterr().err


@pytest.mark.judges("octree-render view --up", "view")
def test_the_viewer_keeps_the_axis_when_the_file_changes(tmp_path: Path) -> None:
    pytest.importorskip("uvicorn", reason="the extra viewer is not installed")
    import renderer
    from renderer.viewer.app import _current
    from renderer.viewer.shown import open_file

    file = file_of(tmp_path, RING)
    shown = open_file(file, "z")
    save_ply(box(), file)
    again = _current(shown, [])
    assert again is not shown and again.scene.up == again.up == "z" and again.scene.camera.up == (0, 0, 1)
    with pytest.raises(ValueError, match=r"^up: expected None for a Scene"):
        renderer.view(again.scene, up="z", browser=False)
