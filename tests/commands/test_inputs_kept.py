"""Commands never write over what they read, nor over a scene that may have been changed since."""

import os
import re
import shutil
from pathlib import Path

import pytest

from renderer.cli import main as cli

SCENES = Path(__file__).parents[2] / "scenes"
MATERIAL = re.compile(r"^material = (.*)$", re.MULTILINE)
SMALL = ["--resolution", "4x4", "--quiet"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    shutil.copy(SCENES / "models" / "block.ply", tmp_path / "m.ply")
    shutil.copy(SCENES / "stairs.toml", tmp_path)
    (tmp_path / "models").mkdir()
    shutil.copy(SCENES / "models" / "stairs.ply", tmp_path / "models")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("scene", "lost", "output"),
    [
        ("m.ply", "m.ply", "link.npy"),
        ("m.ply", "m.ply", "link.png"),
        ("stairs.toml", "stairs.toml", "link.png"),
        ("stairs.toml", "models/stairs.ply", "link.npy"),
        ("m.ply models", "models/stairs.ply", "link.npy"),
    ],
)
def test_a_picture_is_not_written_over_its_scene(folder, capsys, scene, lost, output):
    (folder / output).symlink_to(lost)
    before = (folder / lost).read_bytes()
    assert cli.main(["render", *scene.split(), "-o", output, *SMALL]) == 2
    assert "--output: expected another file than the scene's own" in capsys.readouterr().err
    assert (folder / lost).read_bytes() == before


@pytest.mark.parametrize("change", [[], ["--change", 'hide = ["objects.1"]']])
def test_nor_over_a_second_mesh_whether_it_is_seen_or_not(folder, capsys, change):
    """A picture in which it was hidden took its place, and the scene could not be loaded any more."""
    scene = (folder / "stairs.toml").read_text(encoding="utf-8")
    (folder / "two.toml").write_text(f'{scene}\n[[objects]]\nmesh = "m.ply"\nmaterial = {MATERIAL.search(scene)[1]}\n')
    (folder / "link.png").symlink_to("m.ply")
    before = (folder / "m.ply").read_bytes()
    assert cli.main(["render", "two.toml", "-o", "link.png", *change, *SMALL]) == 2
    assert f"got {folder.resolve() / 'm.ply'} by a link" in capsys.readouterr().err
    assert (folder / "m.ply").read_bytes() == before


def test_nor_over_the_scene_that_is_written_with_it(folder, capsys):
    (folder / "link.png").symlink_to("q.toml")
    assert cli.main(["render", "m.ply", "--write-scene", "q.toml", "-o", "link.png", *SMALL]) == 2
    assert not (folder / "q.toml").exists()


def test_a_link_to_another_picture_is_followed(folder):
    (folder / "link.png").symlink_to("other.png")
    assert cli.main(["render", "m.ply", "-o", "link.png", *SMALL]) == 0
    assert (folder / "other.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.judges("octree-render render --write-scene")
def test_a_scene_that_is_there_is_not_written_again(folder, capsys):
    arguments = ["render", "m.ply", "--write-scene", "s.toml", "-o", "a.png", *SMALL]
    assert cli.main(arguments) == 0
    (folder / "s.toml").write_text("mine = 1\n")
    assert cli.main(arguments) == 2
    assert "--write-scene: expected a new file, got s.toml, which is there already" in capsys.readouterr().err
    assert (folder / "s.toml").read_text(encoding="utf-8") == "mine = 1\n"


@pytest.mark.skipif(os.name != "posix", reason="names are bytes on POSIX alone")
def test_a_scene_of_a_name_that_is_no_text_is_refused(folder, capsys):
    name = os.fsdecode(b"z\xff.ply")
    (folder / "m.ply").rename(name)
    assert cli.main(["render", name, "--write-scene", "s.toml", "-o", "a.png", *SMALL]) == 2
    assert "mesh: expected a name in UTF-8" in capsys.readouterr().err
    assert not (folder / "s.toml").exists()
