"""Each field in which frames and pictures of a cluster may differ: its picture, and what a run that goes on keeps."""

import json
import pickle
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from inspect import signature
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from varied import OTHERS, VARIATIONS, Variation, picture, scene_of

from renderer import PerspectiveCamera, RenderSettings, Scene, prepare, render
from renderer.cluster import frames_on, pictures, render_on, workers
from renderer.cluster.tasks import Task
from renderer.picture.image import PLANES
from renderer.picture.render import View

BEHIND = PerspectiveCamera(eye=(-2.0, 2.5, 3.0), target=(0.0, 0.5, 0.0))
# Another value for each argument of ``render`` that a cluster takes: those that change bits, and those that do not.
SETTINGS = OTHERS[RenderSettings]
ARGUMENTS: dict[str, Any] = {
    "camera": BEHIND,
    "offset": 0.01,
    "media": "normal",
    "planes": ("depth", "rays"),
    **SETTINGS,
}
BITLESS = {"accelerator": "brute", "split": "midpoint", "progress": True}


@pytest.fixture(scope="module")
def bases(folder: Path) -> dict[str, Scene]:
    """The scenes that fields are varied of, by the types of their cameras."""
    return {other.table["camera"]["type"]: scene_of(folder, other.table) for other in (VARIATIONS[0], VARIATIONS[-1])}


@pytest.fixture(scope="module")
def base(bases: dict[str, Scene]) -> Scene:
    return bases["perspective"]


@pytest.fixture
def prepared(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """A worker in this process, to which tasks travel as bytes; how it makes scenes ready."""
    asked: list[tuple[Any, ...]] = []
    own = workers.prepare_scene

    def results(_client: object, function: Callable[..., Any], tasks: Iterable[Task]) -> Iterator[tuple[Any, Any]]:
        for task in tasks:
            shared, arguments = pickle.loads(pickle.dumps((task.shared, task.arguments)))
            yield task.name, function(shared, *arguments)

    monkeypatch.setattr(pictures, "results", results)
    monkeypatch.setattr(workers, "_TREES", {})
    monkeypatch.setattr(workers, "prepare_scene", lambda *told, **more: asked.append(told) or own(*told, **more))
    return asked


def plan_of(scene: Scene, camera: Any = None, **options: Any) -> str:
    """What a folder is known by, as it is written there."""
    _, picture = pictures._Sender(options).picture(scene, camera)
    return json.dumps(asdict(picture.plan(8)))


def frame_of(scene: Scene, varied: Scene, other: Variation) -> Scene:
    """The scene with the field, over the same meshes unless it is one of theirs."""
    top = str(other.keys[0])
    return varied if top in ("objects", "floor", "up") else scene.altered(**{top: getattr(varied, top)})


@pytest.mark.parametrize("other", VARIATIONS, ids=str)
def test_a_frame_has_the_bits_of_its_scene_alone_and_takes_over_no_other(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prepared: object,
    other: Variation,
) -> None:  # fmt: skip
    """Frames that an earlier animation left, of the same folder and names, are rendered again where they differ."""
    base, varied = scene_of(folder, other.table), scene_of(folder, other.varied())
    scenes = [base, frame_of(base, varied, other)]
    expected = [picture(scene).radiance.tobytes() for scene in (base, varied)]
    outputs = [tmp_path / "0.npy", tmp_path / "1.npy"]
    with monkeypatch.context() as killed:
        killed.setattr(pictures._Frames, "remove", lambda frames: None)
        frames_on(None, scenes, outputs, tmp_path / "parts")
    assert [np.load(output).tobytes() for output in outputs] == expected
    frames_on(None, scenes[::-1], outputs, tmp_path / "parts")
    assert [np.load(output).tobytes() for output in outputs] == expected[::-1]
    assert expected[0] != expected[1]


def test_no_two_pictures_have_a_plan_in_common(bases: dict[str, Scene], base: Scene, folder: Path) -> None:
    scenes = [bases[kind] for kind in bases]
    scenes += [scene_of(folder, other.varied()) for other in VARIATIONS if other.keys != ("camera", "type")]
    plans = [plan_of(scene) for scene in scenes]
    plans += [plan_of(base, **{name: ARGUMENTS[name]}) for name in ("camera", "offset", "media")]
    # Some planes have rows of as many bytes as others.
    plans += [plan_of(base, planes=some) for number in range(4) for some in combinations(PLANES[1:], number)]
    assert len(set(plans)) == len(plans)


def test_every_argument_of_a_picture_is_varied() -> None:
    own = signature(render).parameters.keys() - {"scene", "settings", "needs", "threads", "window"}
    assert ARGUMENTS.keys() | BITLESS.keys() == own | RenderSettings.model_fields.keys()
    assert set(View._fields) == {"camera", "chosen", "offset", "media", "planes"}


@pytest.mark.parametrize("name", [*ARGUMENTS, *BITLESS])
def test_an_argument_gives_the_picture_that_render_gives_with_it(
    base: Scene, tmp_path: Path, prepared: list[tuple[Any, ...]], name: str
) -> None:
    given = {name: (ARGUMENTS | BITLESS)[name]}
    found, expected = render_on(None, base, tmp_path / "parts", band=3, **given).image(), picture(base, **given)
    for plane in PLANES:
        assert getattr(found, plane).tobytes() == getattr(expected, plane).tobytes(), plane
    assert found.cut == expected.cut
    usual = {"accelerator": "auto", "split": "sah"}
    assert prepared[0][2:] == tuple((usual | given)[key] for key in usual)


@pytest.mark.parametrize("name", [*ARGUMENTS, *BITLESS])
def test_a_worker_gives_other_pictures_of_a_scene_that_it_has(
    base: Scene, tmp_path: Path, prepared: object, name: str
) -> None:
    """Whichever of both it was asked for before."""
    other = {name: (ARGUMENTS | BITLESS)[name]}
    for number, given in enumerate((other, {}, other)):
        found = render_on(None, base, tmp_path / f"parts{number}", **given).image()
        assert found.radiance.tobytes() == picture(base, **given).radiance.tobytes()


@cases("other", [other for other in VARIATIONS if other.keys[0] in ("camera", "render")])
def test_a_prepared_scene_takes_the_picture_of_another_camera_or_setting(folder: Path, other: Variation) -> None:
    stage, varied = prepare(scene_of(folder, other.table)), scene_of(folder, other.varied())
    found, expected = picture(stage, camera=varied.camera, **varied.render.model_dump()), picture(varied)
    assert found.radiance.tobytes() == expected.radiance.tobytes()
