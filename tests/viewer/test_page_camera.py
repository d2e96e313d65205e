"""What the page shows of cameras that it does not have."""

import math
from pathlib import Path
from typing import Any

import pytest
import tomlkit

from renderer import (
    EquirectangularCamera,
    FisheyeCamera,
    OpenCVCamera,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PinholeCamera,
    Scene,
    SceneObject,
    ThinLensCamera,
    shapes,
)
from renderer.mesh.load import save_ply
from renderer.viewer.commands import scene_text
from renderer.viewer.payload import description
from renderer.viewer.protocol import SaveScene
from renderer.viewer.shown import open_file, prepare_shown
from renderer.viewer.viewpoint import page_camera

PLACE: dict[str, Any] = {"eye": (1.0, 2.0, 5.0), "target": (0.0, 0.5, 0.0), "up": (0.1, 1.0, 0.0)}
PINHOLE = PinholeCamera(**PLACE, width=33, height=20, fx=30.0, fy=10.0, cx=5.0)


@pytest.mark.parametrize(
    ("camera", "fov"),
    [
        (PINHOLE, 90.0), (ThinLensCamera(**PLACE, aperture=0.1, fov=30.0), 30.0), (FisheyeCamera(**PLACE), 90.0),
        (EquirectangularCamera(**PLACE), 90.0),
        (OpenCVCamera(**PLACE, width=33, height=20, fx=30.0, fy=10.0, k1=-0.1), 90.0),
    ],
)  # fmt: skip
def test_another_camera_is_shown_as_a_perspective_one_at_its_place(camera: Any, fov: float) -> None:
    shown = page_camera(camera)
    assert type(shown) is PerspectiveCamera and shown.fov == pytest.approx(fov)
    assert (shown.eye, shown.target, shown.up) == (camera.eye, camera.target, camera.up)


def test_the_pages_own_cameras_stay_as_they_are() -> None:
    for camera in (PerspectiveCamera(**PLACE, fov=20.0), OrthographicCamera(**PLACE, height=2.0)):
        assert page_camera(camera) is camera


def test_a_scene_with_a_calibrated_camera_opens() -> None:
    ball = SceneObject(mesh=shapes.icosphere(1), material="m")
    shown = prepare_shown(Scene(camera=PINHOLE, materials={"m": Phong()}, objects=[ball]))
    assert description(shown)["camera"]["type"] == "perspective"


def test_another_view_does_not_replace_a_camera_that_the_page_lacks(tmp_path: Path) -> None:
    save_ply(shapes.icosphere(1), tmp_path / "ball.ply")
    table = {"camera": PINHOLE.model_dump(), "materials": {"m": {}}, "objects": [{"mesh": "ball.ply", "material": "m"}]}
    (tmp_path / "a.toml").write_text(tomlkit.dumps(table))
    shown, seen = open_file(tmp_path / "a.toml"), page_camera(PINHOLE)
    right, up, forward = (axis.tolist() for axis in seen.frame())
    for eye, told in ((seen.eye, None), ((3.0, 2.0, 5.0), "the view of the file's pinhole camera")):
        m = [*right, 0.0, *up, 0.0, *(-x for x in forward), 0.0, *eye, 1.0]
        asked = SaveScene.model_validate({"type": "save", "m": m, "fovy": math.pi / 2, "settings": {"max_depth": 3}})
        if told is None:
            assert 'type = "pinhole"' in scene_text(shown, asked).text
        else:
            with pytest.raises(ValueError, match=told):
                scene_text(shown, asked)
