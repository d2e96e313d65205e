"""Exposure and tone curves of pictures, and of transparent ones; their formulas are judged by validation.promises."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow
from varied import BASE, picture, scene_of, write_meshes

from renderer import load_scene, srgb
from renderer.cli.main import main

pytestmark = pytest.mark.judges("Image.toned", "octree-render render --tone", "octree-render render --exposure")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene before a bright background."""
    folder = tmp_path_factory.mktemp("tone")
    write_meshes(folder)
    scene_of(folder, BASE | {"background": [0.5, 3.0, 9.0], "render": BASE["render"] | {"resolution": [40, 70]}})
    return folder


def aces(x: Any) -> Any:
    return np.minimum(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 1.0)


def reinhard(x: Any) -> Any:
    return x / (1.0 + x @ (0.2126, 0.7152, 0.0722))[..., None]


@cases("tone", ["srgb", "reinhard", "aces"])
@cases("stops", [0.0, -2.0])
def test_the_command_and_python_show_the_curve(folder: Path, tmp_path: Path, tone: str, stops: float) -> None:
    image = picture(load_scene(folder / "scene.toml"))
    words = [folder / "scene.toml", "-o", tmp_path / "a.png", "--tone", tone, f"--exposure={stops}", "--quiet"]
    assert main(["render", *map(str, words)]) == 0
    with Pillow.open(tmp_path / "a.png") as read:
        found = np.asarray(read)
    assert np.array_equal(found, image.toned(tone, exposure=stops).srgb)
    bright = image.radiance.astype(np.float64) * 2.0**stops
    expected = {"srgb": bright, "reinhard": reinhard(bright), "aces": aces(bright)}[tone]
    assert np.abs(found.astype(int) - srgb(expected)).max() <= 1  # of float32
    assert image.toned() is not image and np.array_equal(image.toned().radiance, image.radiance)


@cases("tone", ["reinhard", "aces"])
def test_extreme_radiance_has_a_colour(folder: Path, tone: str) -> None:
    """Also what is below 0, as beside edges under a filter with negative lobes."""
    image = picture(load_scene(folder / "scene.toml"), resolution=4)
    image.radiance[...] = np.array([-1.0, 3e38, 1e-40], np.float32)
    image.radiance[0] = -3e38
    found = image.toned(tone, exposure=50).radiance
    assert (found[0] == 0.0).all() and np.isfinite(found).all() and (found[1:, :, 1] >= 1.0).all()


def test_a_transparent_picture_shows_the_curve_of_its_surfaces(folder: Path, tmp_path: Path) -> None:
    def pixels(*words: str) -> Any:
        told = [folder / "scene.toml", "-o", tmp_path / "a.png", "--transparent", "--quiet", *words]
        assert main(["render", *map(str, told)]) == 0
        with Pillow.open(tmp_path / "a.png") as read:
            return np.asarray(read)

    toned, plain = pixels("--tone", "aces"), pixels()
    assert np.array_equal(toned[..., 3], plain[..., 3])
    whole = plain[..., 3] == 255
    radiance = picture(load_scene(folder / "scene.toml")).radiance.astype(np.float64)
    assert np.abs(toned[whole, :3].astype(int) - srgb(aces(radiance))[whole]).max() <= 1


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"tone": "filmic"}, "tone: expected one of srgb, reinhard, aces, got 'filmic'"),
        ({"tone": None}, "tone: expected one of srgb, reinhard, aces, got None"),
        ({"exposure": "1"}, "exposure: expected a number from -100 to 100, got '1'"),
        ({"exposure": 101}, "exposure: expected a number from -100 to 100, got 101"),
        ({"exposure": np.nan}, "exposure: expected a number from -100 to 100, got nan"),
    ],
)
def test_other_curves_are_refused(folder: Path, given: Any, said: str) -> None:
    with pytest.raises(ValueError) as caught:
        picture(load_scene(folder / "scene.toml"), resolution=1).toned(**given)
    assert str(caught.value) == said


@cases("suffix", [".exr", ".npy"])
def test_linear_files_take_no_curve(folder: Path, capsys: pytest.CaptureFixture[str], suffix: str) -> None:
    assert main(["render", str(folder / "scene.toml"), "-o", f"a{suffix}", "--tone", "aces"]) == 2
    said = f"octree-render: --tone: expected a .png file or an animation, got 'a{suffix}'\n"
    assert capsys.readouterr().err == said
