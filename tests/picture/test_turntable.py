"""Turntables: the camera goes once around its target, and each frame is the picture of its camera."""

import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow
from varied import BASE, OPENCV_FISHEYE, ORTHOGRAPHIC, PERSPECTIVE, PINHOLE, picture, scene_of, write_meshes

from renderer import load_scene, render
from renderer.cli.main import main
from renderer.picture.turntable import turned_cameras

pytestmark = pytest.mark.judges("octree-render render --frames")


@pytest.fixture
def scene(tmp_path: Path) -> Any:
    write_meshes(tmp_path)
    return scene_of(tmp_path, BASE)


def rendered(folder: Path, output: str, *words: object) -> int:
    told = ("render", folder / "scene.toml", "-o", folder / output, "--quiet", *words)
    return main([*map(str, told)])


@cases("up", ["x", "y", "z"])
@cases("camera", [PERSPECTIVE, ORTHOGRAPHIC, PINHOLE, OPENCV_FISHEYE])
def test_a_quarter_turn_is_a_permutation_of_coordinates(scene: Any, camera: Any, up: str) -> None:
    """Anticlockwise from above: x goes to y, y to z or z to x. A film sees the turned world as before."""
    axis = "xyz".index(up)
    turned = scene.altered(camera=camera).model_copy(update={"up": up})
    cameras = list(turned_cameras(turned, 4))
    assert len(cameras) == 4 and cameras[0] is turned.camera
    first, second = (axis + 1) % 3, (axis + 2) % 3
    quarter = np.zeros((3, 3))
    quarter[axis, axis] = quarter[second, first] = 1.0
    quarter[first, second] = -1.0
    points = np.random.default_rng(1).normal(size=(20, 3))
    target = np.array(turned.camera.target)
    for before, after in pairwise(cameras):
        moved = target + (points - target) @ quarter.T
        seen, expected = after.project(moved, (20, 16))[0], before.project(points, (20, 16))[0]
        assert np.allclose(seen, expected, atol=1e-9, equal_nan=True)


@pytest.mark.parametrize("suffix", ["gif", "webp"])
def test_frames_are_the_pictures_of_the_turned_cameras(scene: Any, tmp_path: Path, suffix: str) -> None:
    assert rendered(tmp_path, f"a.{suffix}", "--frames", 5, "--tone", "aces", "--samples", 1) == 0
    expected = [picture(scene, camera=camera, samples=1).toned("aces").srgb for camera in turned_cameras(scene, 5)]
    with Pillow.open(tmp_path / f"a.{suffix}") as read:
        assert read.format == suffix.upper() and read.n_frames == 5 and read.info["loop"] == 0
        for number, frame in enumerate(expected):
            read.seek(number)
            # GIF has 256 colours, which are more than 80 pixels have.
            assert np.array_equal(np.asarray(read.convert("RGB")), frame)
            assert read.info["duration"] == 800
    assert [path.name for path in tmp_path.glob("*a.*")] == [f"a.{suffix}"]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # the package leaves pipes open
def test_mp4_is_read_as_the_pictures(scene: Any, tmp_path: Path) -> None:
    """Within what its colours, which are shared by four pixels, and its compression change."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    assert rendered(tmp_path, "a.mp4", "--frames", 5, "--resolution", "64x48") == 0
    reader = ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    assert next(reader)["size"] == (64, 48)
    frames = [np.frombuffer(frame, np.uint8).reshape(48, 64, 3) for frame in reader]
    expected = [picture(scene, camera=c, resolution=(64, 48)).srgb for c in turned_cameras(scene, 5)]
    assert len(frames) == 5
    off = [np.abs(frame.astype(int) - other).mean() for frame in frames for other in expected]
    assert np.argmin(np.reshape(off, (5, 5)), axis=1).tolist() == list(range(5)) and min(off) < 6


def test_a_scene_is_prepared_once(scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module, made = import_module("renderer.picture.render"), []
    prepare = module.prepare
    monkeypatch.setattr(module, "prepare", lambda *told, **more: made.append(told) or prepare(*told, **more))
    assert rendered(tmp_path, "a.gif", "--frames", 3) == 0
    assert len(made) == 1


def test_nothing_is_left_of_one_that_is_stopped(
    scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By Ctrl-C in the third frame; the file that was there stays."""
    (tmp_path / "a.gif").write_bytes(b"before")
    names, frames = sorted(tmp_path.iterdir()), []

    def stops(*told: Any, **more: Any) -> Any:
        if len(frames) == 2:
            raise KeyboardInterrupt
        frames.append(render(*told, **more))
        return frames[-1]

    monkeypatch.setattr(import_module("renderer.picture.render"), "render", stops)
    assert rendered(tmp_path, "a.gif", "--frames", 9, "--max-rays", 999) == 130
    assert sorted(tmp_path.iterdir()) == names and (tmp_path / "a.gif").read_bytes() == b"before"
    assert capsys.readouterr().err == "octree-render: interrupted\n"


@pytest.mark.parametrize("suffix", ["gif", "webp"])
def test_cut_pixels_are_said_once(scene: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str) -> None:
    assert rendered(tmp_path, f"a.{suffix}", "--frames", 3, "--max-rays", 5) == 0
    most = max(picture(scene, camera=camera, max_rays=5).cut for camera in turned_cameras(scene, 3))
    said = capsys.readouterr().err
    assert said.startswith(f"octree-render: in a frame {most} of 80 pixels miss rays") and said.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "a.png", "--frames", "3"], "output: expected a .gif, .webp or .mp4 file, got 'a.png'"),
        (["-o", "a.gif"], "output: expected a .png, .exr or .npy file, got 'a.gif'"),
        (["-o", "a.gif", "--frames", "3", "--cluster"], "--frames: expected a picture of this machine, got --cluster"),
        (["-o", "a.gif", "--frames", "3", "--transparent"], "--transparent: expected a .png file, got 'a.gif'"),
        (["-o", "a.mp4", "--frames", "3"], "output: expected the package imageio-ffmpeg for an .mp4 file, got none"),
        (["-o", "a.gif", "--frames", "1"], "argument --frames: expected an integer from 2 to 3600, got '1'"),
    ],
)
def test_what_cannot_be_written_is_refused(
    scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str],
    said: str,
) -> None:  # fmt: skip
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.chdir(tmp_path)
    try:
        code = main(["render", "scene.toml", *words])
    except SystemExit as ended:
        code = ended.code  # type: ignore[assignment]
    assert code == 2 and said in capsys.readouterr().err
    assert load_scene(tmp_path / "scene.toml") and not list(tmp_path.glob("a.*"))
