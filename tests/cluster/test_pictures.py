"""Pictures and animations on a cluster have the bits of those on this machine, also when a run goes on."""

import re
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from cases import cases
from watched import Watched

from renderer import PerspectiveCamera, Scene, load_scene, render
from renderer.cluster import frames_on, render_on
from renderer.picture.image import PLANES
from renderer.scene.camera import Camera

pytestmark = pytest.mark.judges("cluster.frames_on", "cluster.render_on")


OPTIONS: dict[str, Any] = {"resolution": (60, 44), "samples": 4, "max_depth": 4}


@pytest.fixture(scope="module")
def glass() -> Scene:
    return load_scene("scenes/glass.toml")


def camera_at(x: float) -> Camera:
    return PerspectiveCamera(eye=(x, 2.0, 7.0), target=(0.0, 0.5, 0.0))


@cases(
    "band, options",
    [
        (None, {}),
        (7, {"max_rays": 9, "camera": camera_at(3.0)}),
    ],
)
def test_a_picture_has_the_bits_of_render(
    client: Any, glass: Scene, tmp_path: Path, band: int | None, options: dict[str, Any]
) -> None:
    asked = OPTIONS | options
    run = render_on(client, glass, tmp_path / "parts", band=band, **asked)
    image = run.image()
    if "max_rays" in options:
        with pytest.warns(match="pixels miss rays"):
            expected = render(glass, **asked)
        assert expected.cut > 0
    else:
        expected = render(glass, **asked)
    for name in PLANES:
        assert getattr(image, name).tobytes() == getattr(expected, name).tobytes(), name
    assert image.cut == expected.cut
    run.remove()
    assert not list(tmp_path.iterdir())


def test_a_picture_goes_on_where_it_was_stopped(client: Any, glass: Scene, tmp_path: Path) -> None:
    folder = tmp_path / "parts"

    def stop(name: str) -> None:
        if name == "submit" and len(list(folder.glob("*.part"))) >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stopped:
        render_on(Watched(client, stop), glass, folder, band=4, **OPTIONS)
    end = time.monotonic() + 60.0
    while any(str(key).startswith("SentScene") for key in client.futures):  # while somebody looks at the error
        assert time.monotonic() < end and stopped.value
        time.sleep(0.01)
    kept = {path: path.stat().st_mtime_ns for path in folder.glob("*.part")}
    asked: list[str] = []
    image = render_on(Watched(client, asked.append), glass, folder, band=4, **OPTIONS).image()
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert 2 <= len(kept) < 11 and asked.count("submit") == 11 - len(kept)
    assert image.radiance.tobytes() == render(glass, **OPTIONS).radiance.tobytes()
    again: list[str] = []
    render_on(Watched(client, again.append), glass, folder, band=4, **OPTIONS)
    assert again == []


def test_frames_that_differ_in_the_camera_share_what_is_sent(
    client: Any, glass: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pictures, digests = import_module("renderer.cluster.pictures"), list[str]()
    own = pictures.digest_of_scene
    monkeypatch.setattr(pictures, "digest_of_scene", lambda *of: digests.append(own(*of)) or digests[-1])
    dimmed = glass.altered(ambient=(0.0, 0.0, 0.0))
    scenes = [s.altered(camera=camera_at(x)) for s, x in ((glass, -3.0), (glass, 0.0), (glass, 3.0), (dimmed, 3.0))]
    outputs = [tmp_path / f"{number}.npy" for number in range(4)]
    asked: list[str] = []
    frames_on(Watched(client, asked.append), iter(scenes), outputs, tmp_path / "frames", band=16, **OPTIONS)
    assert asked.count("scatter") == 2 and asked.count("submit") == 4 * 3 and len(digests) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.npy", "1.npy", "2.npy", "3.npy"]
    for scene, output in zip(scenes, outputs, strict=True):
        render(scene, **OPTIONS).save(tmp_path / "expected.npy")
        assert output.read_bytes() == (tmp_path / "expected.npy").read_bytes()


def test_scenes_of_frames_that_are_done_are_dropped(client: Any, glass: Scene, tmp_path: Path) -> None:
    """Of animations whose scenes all differ: four tasks are under way, so at most four scenes, and the one before."""
    scenes = [glass.altered(ambient=(0.0, 0.0, x / 16.0)) for x in range(12)]
    outputs, held = [tmp_path / f"{number}.npy" for number in range(12)], list[int]()

    def count(name: str) -> None:
        held.append(sum(str(key).startswith("SentScene") for key in client.futures))

    frames_on(Watched(client, count), scenes, outputs, tmp_path / "frames", resolution=(8, 8))
    assert 1 <= max(held) <= 5


def test_frames_go_on_where_they_were_stopped(client: Any, glass: Scene, tmp_path: Path) -> None:
    scenes = [glass.altered(camera=camera_at(x)) for x in range(5)]
    outputs, folder = [tmp_path / f"{number}.png" for number in range(5)], tmp_path / "frames"

    def stop(name: str) -> None:
        if name == "submit" and len(list(folder.glob("*.done"))) >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        frames_on(Watched(client, stop), scenes, outputs, folder, band=11, **OPTIONS)
    done = sorted(path for path in outputs if path.exists())
    assert 2 <= len(done) < 5
    done[0].write_bytes(b"spoilt")
    kept = {path: path.stat().st_mtime_ns for path in done[1:]}
    frames_on(client, scenes, outputs, folder, band=11, **OPTIONS)
    assert {path: path.stat().st_mtime_ns for path in kept} == kept and not folder.exists()
    for scene, output in zip(scenes, outputs, strict=True):
        render(scene, **OPTIONS).save(tmp_path / "expected.png")
        assert output.read_bytes() == (tmp_path / "expected.png").read_bytes()


def test_frames_go_on_where_the_parts_of_one_that_is_done_were_left(
    client: Any, glass: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They stayed: the folder could not be removed, and all frames were rendered again."""
    scenes = [glass.altered(camera=camera_at(x)) for x in range(3)]
    outputs, folder = [tmp_path / f"{number}.png" for number in range(3)], tmp_path / "frames"

    def stop(run: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr("renderer.checkpoints.pictures.PictureRun.remove", stop)
        frames_on(client, scenes, outputs, folder, **OPTIONS)
    (done,) = (path for path in outputs if path.exists())
    before = done.stat().st_mtime_ns
    frames_on(client, scenes, outputs, folder, **OPTIONS)
    assert done.stat().st_mtime_ns == before and not folder.exists()


@cases(
    "bad, said",
    [
        ({"scene": "glass.toml"}, "scene: expected a Scene, got str"),
        ({"camera": 3}, "camera: expected a camera"),
        ({"band": 0}, "band: expected an integer >= 1"),
        ({"folder": 3}, "folder: expected a string or path"),
        ({"colour": 1}, "render: expected one of filter, .*got 'colour'"),
        ({"planes": "depth"}, "planes: expected some of"),
        ({"offset": "x"}, "offset: expected 'bounded', 'mitsuba'"),
        ({"accelerator": "x"}, "accelerator: expected 'auto', 'octree' or 'brute'"),
        ({"split": 1}, "split: expected one"),
        ({"client": None}, "client: expected a distributed.Client, got NoneType"),
    ],
)
def test_bad_arguments_are_named(glass: Scene, tmp_path: Path, bad: dict[str, Any], said: str) -> None:
    good = {"client": None, "scene": glass, "folder": tmp_path / "parts"}
    with pytest.raises(ValueError, match=said):
        render_on(**(good | bad))


@cases(
    "count, names, said",
    [
        (1, ("a.npy", "b.npy"), "scenes: expected 2, as outputs are, got 1"),
        (2, ("a.npy",), "scenes: expected 1, as outputs are, got 2"),
        (2, ("a.npy", "./a.npy"), "outputs: expected a file for each frame"),
        (1, ("a.txt",), "output: expected a .png"),
    ],
)
def test_frames_have_a_file_each(
    client: Any, glass: Scene, tmp_path: Path, count: int, names: tuple[str, ...], said: str
) -> None:
    outputs = [f"{tmp_path}/{name}" for name in names]
    with pytest.raises(ValueError, match=said):
        frames_on(client, [glass] * count, outputs, tmp_path / "frames", resolution=(8, 8))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("count, said", [(3, "expected 2, as outputs are, got more"), (1, "expected 2, .* got 1")])
def test_scenes_that_have_no_length_are_counted_as_they_come(
    client: Any, glass: Scene, tmp_path: Path, count: int, said: str
) -> None:
    outputs = [tmp_path / "a.npy", tmp_path / "b.npy"]
    with pytest.raises(ValueError, match=f"scenes: {said}"):
        frames_on(client, iter([glass] * count), outputs, tmp_path / "frames", resolution=(8, 8))
    frames_on(client, iter([]), [], tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_a_link_to_itself_is_told_before_any_work(client: Any, glass: Scene, tmp_path: Path) -> None:
    """It ended in the RuntimeError of Path.resolve."""
    loop = tmp_path / "loop.npy"
    loop.symlink_to(loop)
    with pytest.raises(OSError, match=re.escape(str(loop))):
        frames_on(client, [glass], [loop], tmp_path / "frames", resolution=(8, 8))
    assert list(tmp_path.iterdir()) == [loop]
