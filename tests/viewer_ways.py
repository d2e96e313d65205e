"""The ways in which the viewer answers a page, each beside what the renderer gives for the scene that it shows."""

import io
import json
import shlex
import tomllib
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from PIL import Image as Pillow
from varied import Table, picture, scene_of

from renderer import PerspectiveCamera, Scene, load_scene, prepare, srgb
from renderer.cli.main import main
from renderer.diagnostics.face_phong import face_colors
from renderer.diagnostics.ray_path import ray_path
from renderer.numerics.vec3 import normalized
from renderer.viewer.commands import command_of, saved, scene_text
from renderer.viewer.compare import FEW, MANY, compared
from renderer.viewer.export import still, turntable
from renderer.viewer.passes import answer, passes_of
from renderer.viewer.pick import picked
from renderer.viewer.protocol import HEADER, parse
from renderer.viewer.shown import ShownScene
from renderer.viewer.viewpoint import camera_of, seen_from


def matrix_of(camera: PerspectiveCamera) -> list[float]:
    right, up, forward = camera.frame()
    return [*right, 0.0, *up, 0.0, *-forward, 0.0, *camera.eye, 1.0]


# Not the camera of the file, which is kept where the page's is the same but for rounding.
LOOKING: Table = {
    "m": matrix_of(PerspectiveCamera(eye=(-2.0, 2.5, 3.0), target=(0.1, 0.4, 0.0))), "fovy": 0.7, "height": None,
    "w": 10, "h": 8,
}  # fmt: skip
INSIDE = matrix_of(PerspectiveCamera(eye=(0.28, 0.4, 0.5), target=(1.2, 0.3, 0.9)))


def page_of(scene: Scene) -> dict[str, Any]:
    """The settings that a page takes over from a scene."""
    return {name: getattr(scene.render, name) for name in ("samples", "max_depth", "shadows")}


@dataclass(frozen=True, eq=False)
class Case:
    """A scene on show with the page's settings, and the scene whose pictures they should be."""

    shown: ShownScene
    settings: dict[str, Any]
    scene: Scene
    looking: Table = field(default_factory=lambda: LOOKING)

    def message(self, kind: str, **more: Any) -> Any:
        """What the page sends."""
        view = {key: value for key, value in self.looking.items() if kind not in ("save", "camera") or key not in "wh"}
        return parse(json.dumps({"type": kind, **view, "settings": self.settings, **more}))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture."""
        return self.looking["w"], self.looking["h"]

    def picture(self, **options: Any) -> Any:
        """The picture of the scene."""
        return picture(self.scene, resolution=self.size, **options)

    def seen(self, **looking: Any) -> "Case":
        """The same of another view."""
        view = self.looking | looking
        camera = camera_of(view["m"], view["fovy"], height=view["height"])
        return replace(self, scene=self.scene.altered(camera=camera), looking=view)

    def answer(self, mode: str, number: int = -1) -> Any:
        """One pass of a view, without its header: the last, or another."""
        view = self.message("view", seq=1, mode=mode)
        return answer(self.shown, view, passes_of(view)[number], lambda share: None).message[HEADER.size :]

    def colors(self, mode: str, number: int = -1) -> Any:
        """The colours of a picture's pass."""
        return np.frombuffer(self.answer(mode, number), np.uint8).reshape(*self.size[::-1], 4)[..., :3]


def octree(case: Case) -> tuple[Any, Any]:
    return case.colors("octree"), srgb(case.picture().radiance)


def first_pass(case: Case) -> tuple[Any, Any]:
    """Of one sample."""
    return case.colors("octree", 0), srgb(case.picture(samples=1).radiance)


def brute(case: Case) -> tuple[Any, Any]:
    return case.colors("brute"), srgb(case.picture(samples=1, accelerator="brute").radiance)


def phong(case: Case) -> tuple[Any, Any]:
    ready = prepare(case.scene)
    eye = seen_from(case.scene.camera, ready.mesh.bounds)
    return case.answer("phong"), face_colors(ready.arrays, eye).tobytes()


def proof_by_brute_force(case: Case) -> tuple[Any, Any]:
    case = replace(case, settings=case.settings | {"pair": "brute"})
    found = compared(case.shown, case.message("view", seq=1, mode="proof"), case.size, lambda share: None)
    return found.pictures, [case.picture(samples=1).radiance] * 2


def proof_by_samples(case: Case) -> tuple[Any, Any]:
    case = replace(case, settings=case.settings | {"pair": "samples"})
    found = compared(case.shown, case.message("view", seq=1, mode="proof"), case.size, lambda share: None)
    return found.pictures, [case.picture(samples=samples).radiance for samples in (FEW, MANY)]


def a_still(case: Case) -> tuple[Any, Any]:
    file = still(case.shown, case.message("still", seq=1), lambda rays: None)
    return np.asarray(Pillow.open(io.BytesIO(file))), srgb(case.picture().radiance)


def a_turntable(case: Case) -> tuple[Any, Any]:
    turn = {"pivot": [0, 0, 0], "axis": [0, 1, 0], "frames": 2}
    file = turntable(case.shown, case.message("turntable", seq=1, **turn), lambda rays: None)
    return np.asarray(Pillow.open(io.BytesIO(file)).convert("RGB")), srgb(case.picture().radiance)


def click(case: Case) -> tuple[Any, Any]:
    """The rays through some pixels, and all that they spawn."""
    ready, rows, settings = prepare(case.scene), case.scene.camera.rows(*case.size), case.scene.render
    found, expected = [], []
    for x, y in ((3, 4), (5, 4), (6, 3), (0, 0)):
        found.append(picked(case.shown, case.message("pick", seq=1, x=x, y=y))["path"])
        origin, direction = (row[0] + ((x + 0.5) * row[1] + (y + 0.5) * row[2]) for row in (rows[:3], rows[3:]))
        path = ray_path(ready, origin, normalized(tuple(direction)), settings.max_depth, min_weight=settings.min_weight,
                        shadows=settings.shadows)  # fmt: skip
        expected.append(list(map(asdict, path)))
    return found, expected


WAYS = [octree, first_pass, brute, phong, proof_by_brute_force, proof_by_samples, a_still, a_turntable, click]


def command(case: Case) -> tuple[Any, Any]:
    words = shlex.split(command_of(case.shown, case.message("command", mode="octree")))
    assert main([*words[1:-1], str(case.shown.path) + ".png", "--quiet"]) == 0
    return np.asarray(Pillow.open(str(case.shown.path) + ".png")), srgb(case.picture().radiance)


def save(case: Case) -> tuple[Any, Any]:
    assert case.shown.path is not None
    path = case.shown.path.with_name("saved.toml")
    path.write_text(scene_text(case.shown, case.message("save")).text)
    return picture(load_scene(path), resolution=case.size).radiance, case.picture().radiance


def save_camera(case: Case) -> tuple[Any, Any]:
    """With what else the file has."""
    assert case.shown.path is not None
    found, table = tomllib.loads(saved(case.shown, case.message("camera"))), tomllib.loads(case.shown.path.read_text())
    table |= found | {"render": table["render"] | found["render"]}
    return picture(scene_of(case.shown.path.parent, table), resolution=case.size).radiance, case.picture().radiance


WRITTEN = [command, save, save_camera]


def same(answers: tuple[Any, Any]) -> bool:
    found, expected = answers
    return found == expected if isinstance(found, list | bytes) else bool(np.array_equal(found, expected))
