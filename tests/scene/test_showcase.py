"""A mesh file in place of a scene: seen whole, lit, on a floor; and the scene file that is written for it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import Mesh, SceneError, load_scene, render
from renderer.cli.main import main
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.scene.scene import write_scene

SHAPES = {
    "ball": icosphere(3),
    "ring": torus(),
    "box": box(),
    "sheet": Mesh([[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 1, 2]]),
}


def file_of(folder: Path, mesh: Mesh, scale: float = 1.0, offset: Any = (0, 0, 0), name: str = "model.ply") -> Path:
    path = folder / name
    save_ply(Mesh(mesh.vertices * scale + np.asarray(offset) * scale, mesh.faces), path)
    return path


@pytest.mark.judges("load_scene", "octree-render render scene", "octree-render view scene")
@cases("shape", SHAPES)
@cases("scale", [1e-6, 1.0, 1e6])
@cases("offset", [(0, 0, 0), (30, -20, 10)])
def test_the_whole_mesh_is_seen_and_lit_and_large_enough(tmp_path: Path, shape: str, scale: float, offset: Any) -> None:
    mesh = SHAPES[shape]
    image = render(load_scene(file_of(tmp_path, mesh, scale, offset)), resolution=(80, 80), samples=1)
    model = (image.face >= 0) & (image.face < len(mesh.faces))
    rows, columns = np.flatnonzero(model.any(axis=1)), np.flatnonzero(model.any(axis=0))
    assert rows[0] > 0 and columns[0] > 0 and rows[-1] < 79 and columns[-1] < 79
    assert max(rows[-1] - rows[0], columns[-1] - columns[0]) > 30
    assert np.median(image.radiance[model]) > 0.05
    # It stands on the floor, which is seen before it.
    assert (image.face[rows[-1] + 2] >= len(mesh.faces)).any()


@pytest.mark.judges("octree-render render --write-scene")
@cases("leads_to", [None, ".", "far/away", "models"])
def test_the_written_scene_is_the_one_that_is_rendered(tmp_path: Path, leads_to: str | None) -> None:
    """Also where the scene is written through a link, into whichever folder it leads."""
    for name in ("models", "scenes", "far/away"):
        (tmp_path / name).mkdir(parents=True)
    path, written = file_of(tmp_path / "models", icosphere(2), name='a "b".ply'), tmp_path / "scenes" / "it.toml"
    if leads_to is not None:
        written.symlink_to(tmp_path / leads_to / "other.toml")
    write_scene(path, written)
    assert written.is_symlink() == (leads_to is not None)
    found, expected = (render(load_scene(p), resolution=(30, 20)) for p in (written, path))
    assert found.radiance.tobytes() == expected.radiance.tobytes()


@pytest.mark.judges("octree-render info scene", "octree-render render --write-scene", "octree-render render scene")
@pytest.mark.parametrize("command", ["render", "info"])
def test_the_command_line_takes_a_mesh(tmp_path: Path, capsys: Any, command: str) -> None:
    path, out, written = file_of(tmp_path, icosphere(2)), tmp_path / "out.png", tmp_path / "it.toml"
    more = (
        ["-o", str(out), "--resolution", "16x16", "--up", "y", "--write-scene", str(written)]
        if command == "render"
        else []
    )
    assert main([command, str(path), *more]) == 0
    assert capsys.readouterr().err == ""
    assert command == "info" or (out.exists() and load_scene(written).floor)


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    """A folder with two mesh files, the first and the last by their names far from each other."""
    (tmp_path / "pair").mkdir()
    file_of(tmp_path / "pair", SHAPES["ball"], offset=(5, 0, 0), name="z.ply")
    file_of(tmp_path / "pair", SHAPES["ring"], name="a.ply")
    return tmp_path / "pair"


@pytest.mark.judges("octree-render render --write-scene", "octree-render render scene")
def test_several_meshes_are_objects_of_one_scene(pair: Path, capsys: Any) -> None:
    files = [str(pair / "a.ply"), str(pair / "z.ply")]
    rest = ["--resolution", "40x30", "--up", "y", "--quiet"]
    assert main(["render", *files, "-o", str(pair / "a.npy"), "--write-scene", str(pair / "it.toml"), *rest]) == 0
    assert main(["render", str(pair), "-o", str(pair / "b.npy"), *rest]) == 0
    assert np.load(pair / "a.npy").tobytes() == np.load(pair / "b.npy").tobytes()
    scene = load_scene(pair)
    assert [thing.mesh.name for thing in scene.objects if isinstance(thing.mesh, Mesh)] == ["a", "z"]
    for found in (scene, load_scene(pair / "it.toml")):
        image = render(found, resolution=(40, 30))
        assert image.radiance.tobytes() == np.load(pair / "a.npy").tobytes()
    # Both are seen, as far apart as they are, and stand on the floor as one.
    bounds = [part.mesh.bounds for part in scene.instances[:2]]
    count = len(scene.instances[0].mesh.faces)
    assert (image.face < count).any() and ((image.face >= count) & (image.face < count + 1280)).any()
    assert 0.0 < min(lower[1] for lower, _ in bounds) < 1e-3 * np.ptp(bounds, axis=(0, 1)).max()
    apart = SHAPES["ball"].bounds[0][0] + 5 - SHAPES["ring"].bounds[0][0]
    assert bounds[1][0][0] - bounds[0][0][0] == pytest.approx(apart)


def test_a_flat_mesh_is_seen_on_the_floor(tmp_path: Path) -> None:
    grid(3, 3).save(tmp_path / "flat.ply")
    scene = load_scene(tmp_path / "flat.ply")
    mesh = scene.instances[0].mesh
    pixels, _ = scene.camera.project(mesh.triangles.mean(axis=1), 60)
    columns, rows = np.floor(pixels).astype(int).T
    assert (render(scene, resolution=60).face[rows, columns] < len(mesh.faces)).all()


def test_of_several_meshes_one_line_says_which_axis_is_taken(pair: Path, capsys: Any) -> None:
    words = ["--resolution", "4x4", "-o", str(pair / "a.png")]
    assert main(["render", str(pair), *words]) == 0
    taken = "not say which axis points up: y was taken; --up x|y|z changes it\n"
    assert capsys.readouterr().err == f"octree-render: the mesh files do {taken}"


@cases(
    ("names", "message"),
    [
        (["a.ply", "it.toml"], r"it\.toml: expected a mesh file \(\.ply, .*\) beside others"),
        (["a.ply", "none.ply"], r"none\.ply: cannot be read: No such file"),
        (["."], r"expected mesh files \(\.ply, .*\) in the folder, got none"),
    ],
)
def test_files_that_make_no_scene_together_are_named(tmp_path: Path, names: list[str], message: str) -> None:
    (tmp_path / "it.toml").write_text("")
    if names != ["."]:
        file_of(tmp_path, SHAPES["box"], name="a.ply")
    with pytest.raises(SceneError, match=message):
        load_scene([tmp_path / name for name in names])


def test_only_of_a_mesh_a_scene_is_written(tmp_path: Path, capsys: Any) -> None:
    scene = Path(__file__).parents[2] / "scenes" / "stairs.toml"
    arguments = ["render", str(scene), "-o", str(tmp_path / "a.png"), "--write-scene", str(tmp_path / "b.toml")]
    assert main(arguments) == 2
    assert "--write-scene: expected a mesh file" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_what_is_neither_is_said_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="expected a scene file"):
        (tmp_path / "a.txt").write_text("no scene")
        load_scene(tmp_path / "a.txt")


@pytest.mark.parametrize("through_link", [False, True])
def test_a_scene_is_written_over_no_mesh(tmp_path: Path, capsys: Any, through_link: bool) -> None:
    path = file_of(tmp_path, icosphere(1))
    before, target = path.read_bytes(), path
    if through_link:
        target = tmp_path / "it.toml"
        target.symlink_to(path)
    assert main(["render", str(path), "-o", str(tmp_path / "a.png"), "--write-scene", str(target)]) == 2
    assert "--write-scene: expected a new file" in capsys.readouterr().err
    with pytest.raises(ValueError, match="path: expected a .toml file, got .*" + ("a link to" if through_link else "")):
        write_scene(path, target)
    assert path.read_bytes() == before
