"""``render``: what it accepts, what it says of the rest, its progress bar and how it stops."""

import dataclasses
import io
import sys
import threading
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from cases import cases

from renderer.materials.phong import Phong
from renderer.mesh.shapes import icosphere
from renderer.picture import prepare as preparing
from renderer.picture.prepare import TILE
from renderer.picture.render import render
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight
from renderer.scene.scene import Floor, RenderSettings, Scene, SceneObject, load_scene

pytestmark = pytest.mark.judges(
    "DirectionalLight", "Image", "PreparedScene.picture", "RenderSettings", "render", "scene.render",
    "scene.render.resolution", "scene.render.shadows",
)  # fmt: skip


SCENES = Path(__file__).parents[2] / "scenes"


def ball(**settings: Any) -> Scene:
    return Scene(
        camera=PerspectiveCamera(eye=(0, 0, 4), target=(0, 0, 0)),
        materials={"m": Phong(reflectance=0.5)},
        objects=(SceneObject(mesh=icosphere(2), material="m"),),
        lights=(DirectionalLight(direction=(-1, -1, -1)),),
        background=0.25,
        render=RenderSettings(**{"resolution": (6, 4), **settings}),
    )


def test_shapes_and_dtypes() -> None:
    image = render(ball(), threads=1)
    expected = {"radiance": (4, 6, 3), "depth": (4, 6), "normal": (4, 6, 3), "face": (4, 6), "rays": (4, 6)}
    dtypes = {"radiance": "f4", "depth": "f8", "normal": "f4", "face": "i4", "rays": "i4"}
    for name, shape in expected.items():
        array = getattr(image, name)
        assert array.shape == shape and array.dtype == dtypes[name], name
    assert image.build_seconds > 0 and image.render_seconds > 0
    assert {f.name for f in dataclasses.fields(image)} == {*expected, "build_seconds", "render_seconds", "cut"}


def test_the_scenes_settings_hold_unless_others_are_given() -> None:
    scene = ball(resolution=(3, 2), max_depth=0, samples=4)
    assert render(scene, threads=1).depth.shape == (2, 3)
    given = render(scene, threads=1, resolution=(6, 4), max_depth=6, samples=1)
    np.testing.assert_array_equal(given.radiance, render(ball(), threads=1).radiance)
    # None stands for the scene's own, as for an option that a command line was not given.
    same = render(scene, threads=1, resolution=None, max_depth=None, samples=None, min_weight=None)
    np.testing.assert_array_equal(same.radiance, render(scene, threads=1).radiance)
    assert scene.render.resolution == (3, 2)


@cases("accelerator", ["octree", "brute"])
@cases("samples", [4, 9, 16, 36])
def test_depth_normal_and_face_are_those_of_the_pixels_centres(
    samples: int, accelerator: Literal["octree", "brute"]
) -> None:
    scene = ball(resolution=(37, 21)).altered(camera=PerspectiveCamera(eye=(0.3, 0.2, 4), target=(0, 0, 0)))
    one, more = (render(scene, accelerator=accelerator, samples=n, threads=2) for n in (1, samples))
    for name in ("depth", "normal", "face"):
        np.testing.assert_array_equal(getattr(more, name), getattr(one, name), err_msg=name)
    # Which of them are kept changes nothing else, and a ray that is no sample is not counted.
    for planes in ((), ("rays",), ("normal", "rays")):
        other = render(scene, accelerator=accelerator, samples=samples, planes=planes)
        np.testing.assert_array_equal(other.radiance, more.radiance)
        assert "rays" not in planes or (other.rays == more.rays).all()
    assert (more.rays.min(), one.rays.min()) == (samples, 1)


@cases("resolution", [(1, 1), (TILE, TILE), (TILE + 1, TILE - 1), (3 * TILE + 5, 2), (1, 2 * TILE + 1)])
def test_every_pixel_is_written_once(resolution: tuple[int, int]) -> None:
    image = render(ball(), resolution=resolution, threads=2, max_depth=0)
    assert image.depth.shape == resolution[::-1]
    # One primary ray each, and a shadow ray where the ball is hit; nothing is left at its initial zero.
    assert (image.rays >= 1).all() and (image.rays <= 2).all()
    np.testing.assert_array_equal(image.radiance[image.face < 0], 0.25)


@cases(
    ("argument", "value", "got"),
    [
        ("accelerator", "bvh", "bvh"),
        ("split", "kd", "kd"),
        ("offset", "none", "none"),
        ("offset", 0.5, "0.5"),
        ("offset", float("nan"), "nan"),
        ("threads", 0, "0"),
        ("threads", True, "True"),
        ("resolution", (0, 4), "0"),
        ("resolution", (4, 1e9), "1000000000|16384"),
        ("samples", 3, "3"),
        ("max_depth", 65, "65"),
        ("min_weight", 1.0, "1"),
        ("shadows", 1, "1"),
        ("speed", 3, "speed"),
        ("camera", "x", "str"),
    ],
)
def test_errors_name_the_argument_and_what_came(argument: str, value: Any, got: str) -> None:
    with pytest.raises(ValueError) as caught:
        render(ball(), **{argument: value})
    assert argument in str(caught.value)
    assert any(g in str(caught.value) for g in got.split("|"))


def test_brute_force_is_as_strict_about_arguments_that_it_does_not_use() -> None:
    with pytest.raises(ValueError, match="split"):
        render(ball(), accelerator="brute", split="kd")  # type: ignore[arg-type]


def test_arguments_are_checked_before_anything_is_built(monkeypatch: pytest.MonkeyPatch) -> None:
    def built(*_: object) -> None:
        raise AssertionError("built a tree for arguments that are no good")

    monkeypatch.setattr(preparing, "pack", built)
    for bad in ({"threads": 0}, {"samples": 3}, {"accelerator": "x"}, {"offset": "x"}, {"split": "x"}):
        with pytest.raises(ValueError):
            render(ball(), **bad)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_bar_shows_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch) -> None:
    for stream, progress, shows in ((Terminal(), True, True), (Terminal(), False, False), (io.StringIO(), True, False)):
        monkeypatch.setattr(sys, "stderr", stream)
        render(ball(), resolution=(3 * TILE, TILE), threads=2, progress=progress)
        assert ("tile" in stream.getvalue()) == shows, (stream, progress)


@cases("threads", [1, 3])
@cases("error", [KeyboardInterrupt, MemoryError])
def test_an_exception_in_a_tile_stops_the_rest(monkeypatch: pytest.MonkeyPatch, threads: int, error: type) -> None:
    tiles, lock = [], threading.Lock()

    def interrupted(*arguments: Any) -> bool:
        with lock:
            tiles.append(arguments[-1])
            count = len(tiles)
        if count == 5:
            raise error
        return True

    monkeypatch.setattr(preparing, "render_tile", interrupted)
    with pytest.raises(error):
        render(ball(), resolution=(20 * TILE, 20 * TILE), threads=threads)
    # Each other thread may have had one tile under way and have taken one more before it saw the stop.
    assert 5 <= len(tiles) <= 5 + 2 * threads
    monkeypatch.undo()
    assert render(ball(), resolution=(2 * TILE, TILE), threads=threads).rays.min() >= 1


def test_concurrent_callers_get_the_same_picture() -> None:
    expected = render(ball(), resolution=(70, 40), threads=1)
    images: list[Any] = [None] * 6

    def call(i: int) -> None:
        images[i] = render(ball(), resolution=(70, 40), threads=2)

    callers = [threading.Thread(target=call, args=(i,)) for i in range(len(images))]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    for image in images:
        assert image.radiance.tobytes() == expected.radiance.tobytes()
        assert image.face.tobytes() == expected.face.tobytes()


def test_offset_may_be_a_number() -> None:
    by_name = render(load_scene(SCENES / "glass.toml"), resolution=(16, 16), offset="mitsuba", threads=1)
    by_number = render(load_scene(SCENES / "glass.toml"), resolution=(16, 16), offset=1500 * 2.0**-24, threads=1)
    np.testing.assert_array_equal(by_name.radiance, by_number.radiance)
    bounded = render(load_scene(SCENES / "glass.toml"), resolution=(16, 16), threads=1)
    assert (bounded.radiance != by_name.radiance).any()
    # The rules differ by 1e-4 of the scene; only rays that pass an edge may see something else.
    assert np.median(np.abs(bounded.radiance - by_name.radiance)) < 1e-3


def test_without_shadows_every_light_reaches_what_faces_it() -> None:
    """A light right above a ball that stands over a floor: the floor beneath is dark with shadows, N.L without."""
    scene = Scene(
        camera=PerspectiveCamera(eye=(0, 1, 6), target=(0, 0, 0)),
        materials={"m": Phong(diffuse=(0.5, 0.5, 0.5))},
        objects=(SceneObject(mesh=icosphere(1), material="m", translate=(0.0, 1.5, 0.0)),),
        floor=Floor(min=(-3.0, -3.0), max=(3.0, 3.0), materials=("m",)),
        lights=(DirectionalLight(direction=(0, -1, 0)),),
        render=RenderSettings(resolution=(40, 40)),
    )
    lit, hidden = render(scene, threads=1, shadows=False), render(scene, threads=1)
    floor = np.isclose(lit.normal[..., 1], 1.0)
    assert (lit.radiance[floor] == np.float32(0.5)).all()
    assert (hidden.radiance[floor] == 0.0).any() and (hidden.radiance[floor] == np.float32(0.5)).any()
    assert lit.rays.max() == 1 and hidden.rays.max() == 2
