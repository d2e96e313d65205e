"""``octree-render radiosity``: each option given alone, the files that it writes, and one line for bad input."""

import argparse
import re
import warnings
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow

from renderer import Mesh, Scene, load_mesh, load_scene, render, shapes
from renderer.cli.main import main, make_parser
from renderer.radiosity import lit_scene

pytestmark = pytest.mark.judges(
    "octree-render radiosity",
    "octree-render radiosity scene",
    "octree-render radiosity --up",
    "octree-render radiosity --output",
    "octree-render radiosity --edge",
    "octree-render radiosity --rtol",
    "octree-render radiosity --max-rays",
    "octree-render radiosity --crease",
    "octree-render radiosity --resolution",
    "octree-render radiosity --samples",
    "octree-render radiosity --exposure",
    "octree-render radiosity --tone",
    "octree-render radiosity --threads",
    "octree-render radiosity --quiet",
)
OPTIONS = [name.rpartition(" ")[2] for name in pytestmark.args[1:]]

ROOM = """
background = [0.5, 0.4, 0.3]

[camera]
eye = [0.5, 0.5, 3.0]
target = [0.5, 0.5, 0.0]
fov = 30

[render]
resolution = [12, 8]

[materials.clay]
diffuse = [0.7, 0.5, 0.3]

[materials.lamp]
diffuse = 0.1
emission = 2.0

[[objects]]
mesh = "room.ply"
material = "clay"

[[objects]]
mesh = "lamp.ply"
material = "lamp"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A room without its front wall, with a lamp."""
    room = shapes.box()
    inside = Mesh(room.vertices, room.faces[room.face_normals()[:, 2] < 0.5][:, ::-1])
    inside.save(tmp_path / "room.ply")
    lamp = shapes.box((0.4, 0.8, 0.4), (0.6, 0.9, 0.6))
    lamp.save(tmp_path / "lamp.ply")
    (tmp_path / "room.toml").write_text(ROOM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words: object) -> None:
    assert main(["radiosity", "room.toml", "--quiet", *map(str, words)]) == 0


def test_every_option_is_here() -> None:
    (choice,) = (a for a in make_parser()._actions if isinstance(a, argparse._SubParsersAction))
    actions = [action for action in choice.choices["radiosity"]._actions if action.dest != "help"]
    assert {max(action.option_strings, key=len, default=action.dest) for action in actions} == set(OPTIONS)


@cache
def radiance(**options: Any) -> Any:
    """Of the room of ``folder``, which is always the same."""
    return render(lit_scene(load_scene("room.toml"), **options)).radiance


@cases(
    ("words", "given"),
    [
        ([], {}),
        (["--edge", "0.5"], {"edge": 0.5}),
        (["--rtol", "0.5"], {"rtol": 0.5}),
        (["--max-rays", "256"], {"max_rays": 256}),
        (["--crease", "100"], {"crease": 100.0}),
        (["--threads", "1"], {"threads": 1}),
    ],
)
def test_a_picture_is_that_of_the_lit_scene(folder: Path, words: list[str], given: dict[str, Any]) -> None:
    usual = {"edge": 0.45, "rtol": 0.01}
    told = {"--edge": "0.45", "--rtol": "0.01"} | dict([words] if words else [])
    run(*(word for option in told.items() for word in option), "-o", "a.npy")
    expected = radiance(**{**usual, **given})
    assert np.array_equal(np.load("a.npy"), expected)
    assert np.array_equal(expected, radiance(**usual)) == (given.keys() <= {"threads"})


def test_the_default_edge_is_a_share_of_the_scene(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    patch = import_module("renderer.radiosity.lit")
    sound = patch.patches
    monkeypatch.setattr(patch, "patches", lambda mesh, edge: asked.append(edge) or sound(mesh, 0.5))
    run("-o", "a.npy", "--rtol", 0.5)
    assert asked == [pytest.approx(1 / 16)] * 2


@cases(("words", "size", "samples"), [(["--resolution", "6x4"], (6, 4), 1), (["--samples", "4"], (12, 8), 4)])
def test_pictures_have_the_size_and_samples_asked_for(
    folder: Path, words: list[str], size: tuple[int, int], samples: int
) -> None:
    run("--edge", 0.5, *words, "-o", "a.npy")
    lit = lit_scene(load_scene("room.toml"), 0.5)
    assert np.array_equal(np.load("a.npy"), render(lit, resolution=size, samples=samples).radiance)


def test_all_outputs_are_of_one_lit_scene(folder: Path) -> None:
    run(
        "--edge",
        0.5,
        "--exposure",
        -1,
        "--tone",
        "aces",
        *("-o", "a.png", "-o", "a.toml", "-o", "a.ply", "-o", "a.glb"),
    )
    lit = lit_scene(load_scene("room.toml"), 0.5)
    image = render(lit)
    with Pillow.open("a.png") as read:
        assert np.array_equal(np.asarray(read), image.toned("aces", exposure=-1).srgb)
    assert np.array_equal(render(load_scene("a.toml")).radiance, image.radiance)
    assert sorted(path.name for path in folder.glob("a-*")) == ["a-0.ply", "a-1.ply"]
    faces = sum(instance.faces for instance in lit.instances)
    for name in ("a.ply", "a.glb"):
        mesh = load_mesh(name)
        assert len(mesh.faces) == faces and mesh.colors is not None and len(np.unique(mesh.colors)) > 20


def test_meshes_are_a_scene_of_their_own(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["lamp.ply", "room.ply", "--edge", "3", "--rtol", "0.5", "--resolution", "6x4", "-o", "a.npy"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # highlights and ambient light of the scene around meshes
        for up in ("y", "z"):
            assert main(["radiosity", *words, "--up", up]) == 0
            expected = render(lit_scene(load_scene(["lamp.ply", "room.ply"], up=up), 3, rtol=0.5), resolution=(6, 4))
            assert np.array_equal(np.load("a.npy"), expected.radiance)
        assert main(["radiosity", *words]) == 0
    assert "--up x|y|z changes it" in capsys.readouterr().err


@cases("quiet", [True, False])
def test_what_was_written_is_said_unless_quiet(folder: Path, capsys: pytest.CaptureFixture[str], quiet: bool) -> None:
    words = ["radiosity", "room.toml", "--edge", "0.5", "-o", "a.npy", "-o", "a.ply"]
    assert main([*words, *(["--quiet"] if quiet else [])]) == 0
    said = capsys.readouterr().out
    count = sum(i.faces for i in lit_scene(load_scene("room.toml"), 0.5).instances)
    assert said == "" if quiet else re.fullmatch(rf"a\.npy, a\.ply: {count:,} patches in \d+\.\d\d s\n", said)


def test_progress_is_shown_unless_quiet(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    sound = lit_scene

    def told(scene: Scene, **options: Any) -> Scene:
        asked.append(options["progress"])
        return sound(scene, **options)

    monkeypatch.setattr("renderer.radiosity.lit.lit_scene", told)
    monkeypatch.setattr("renderer.radiosity.lit_scene", told, raising=False)
    for quiet in ([], ["--quiet"]):
        assert main(["radiosity", "room.toml", "--edge", "0.5", "-o", "a.npy", *quiet]) == 0
    assert asked == [True, False]


@cases(
    ("words", "says"),
    [
        (["-o", "a.jpg"], "output: expected a .png, .exr, .npy, .toml, .ply or .glb file, got 'a.jpg'"),
        (["-o", "none/a.ply"], "output: expected a path in an existing folder"),
        (["-o", "room.toml"], "--output: expected other files than the scene's own"),
        (["-o", "lamp.ply"], "--output: expected other files than the scene's own"),
        (["-o", "a.png", "-o", "a.png"], "each once"),
        (["-o", "a.npy", "--tone", "aces"], "--tone: expected a .png file"),
        (["-o", "a.ply", "--samples", "4"], "--samples: expected a picture"),
        (["-o", "a.npy", "--edge", "0"], "edge: expected"),
        (["-o", "a.npy", "--edge", "1", "--rtol", "-1"], "rtol: expected"),
        (["-o", "a.npy", "--edge", "1", "--max-rays", "3"], "max_rays: expected"),
        (["-o", "a.npy", "--crease", "-3"], "crease: expected"),
        (["-o", "a.npy", "--threads", "0"], "threads: expected"),
        (["-o", "a.npy", "--samples", "3"], "samples: expected"),
    ],
)
def test_bad_input_is_one_line(folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], says: str) -> None:
    before = {path: path.read_bytes() for path in folder.iterdir()}
    assert main(["radiosity", "room.toml", *words]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.splitlines()) == 1 and says in said.err
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_meshes_of_a_lit_scene_are_not_written_over_the_scenes_own(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "lamp.ply").rename(folder / "b-1.ply")
    (folder / "room.toml").write_text(ROOM.replace("lamp.ply", "b-1.ply"))
    assert main(["radiosity", "room.toml", "-o", "b.toml"]) == 2
    assert "--output: expected other files than the scene's own" in capsys.readouterr().err
    assert not (folder / "b.toml").exists()


def test_what_is_left_out_is_one_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "room.toml").write_text(ROOM.replace("diffuse = 0.1", "diffuse = 0.1\nspecular = 0.3"))
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert main(["radiosity", "room.toml", "--edge", "0.5", "-o", "a.npy"]) == 0
    assert "octree-render: radiosity leaves out materials.lamp: its highlights\n" in capsys.readouterr().err
