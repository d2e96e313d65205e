"""Our cameras against Mitsuba's sensors, and that the check sees a camera that is off."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene.camera import (
    Camera,
    EquirectangularCamera,
    OrthographicCamera,
    PerspectiveCamera,
    PinholeCamera,
    ThinLensCamera,
)
from renderer.scene.cameras import thin_lens
from validation.references.mitsuba.camera import can_judge, largest_distance
from validation.thresholds import Pictures

CAMERA_PIXELS = Pictures().camera_pixels
PERSPECTIVE = PerspectiveCamera(eye=(1.0, 2.0, 5.0), target=(0.2, 0.5, 0.0), fov=37.0)
ORTHOGRAPHIC = OrthographicCamera(type="orthographic", eye=(3.0, 4.0, 5.0), target=(0.0, 1.0, 0.0), height=4.0)


PLACE: dict[str, Any] = {"eye": (1.0, 2.0, 5.0), "target": (0.2, 0.5, 0.0)}
PINHOLE = PinholeCamera(**PLACE, width=96, height=64, fx=80.0, fy=80.0, cx=20.0, cy=50.0)
LENS = ThinLensCamera(**PLACE, fov=37.0, aperture=0.4, focus=7.0)


@pytest.mark.judges(
    "OrthographicCamera.rows", "PerspectiveCamera", "PerspectiveCamera.rows", "PinholeCamera.rows", "ThinLensCamera"
)
@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC, PINHOLE, LENS])
def test_our_rays_are_mitsubas(camera: Camera) -> None:
    assert can_judge(camera) is None
    assert largest_distance(camera, (96, 64)) < CAMERA_PIXELS


def test_cameras_that_mitsuba_lacks_have_a_reason() -> None:
    assert can_judge(PINHOLE.model_copy(update={"skew": 1.0})) == "a pinhole camera whose pixels are not square"
    assert can_judge(EquirectangularCamera(**PLACE)) == "a camera of type equirectangular"


def test_another_principal_point_or_lens_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    moved = PINHOLE.model_copy()
    object.__setattr__(moved, "rows", PINHOLE.model_copy(update={"cx": 20.5}).rows)
    assert largest_distance(moved, (96, 64)) == pytest.approx(0.5, rel=1e-3)
    on_disk = thin_lens._on_disk
    monkeypatch.setattr(thin_lens, "_on_disk", lambda u, v: on_disk(u, 1.0 - v))
    assert largest_distance(LENS, (96, 64)) > 1.0


@pytest.mark.parametrize("row", [0, 3])
def test_a_tenth_of_a_pixel_is_seen(monkeypatch: pytest.MonkeyPatch, row: int) -> None:
    kind = PerspectiveCamera if row == 3 else OrthographicCamera
    rows = kind.rows

    def shifted(self: PerspectiveCamera, width: int, height: int) -> NDArray[np.float64]:
        moved = rows(self, width, height)
        moved[row] += 0.1 * moved[row + 1]
        return moved

    monkeypatch.setattr(kind, "rows", shifted)
    assert largest_distance(PERSPECTIVE if row == 3 else ORTHOGRAPHIC, (96, 96)) > 10 * CAMERA_PIXELS


def test_a_wider_field_of_view_is_seen() -> None:
    other = PERSPECTIVE.model_copy(update={"fov": 37.3})
    assert largest_distance(other, (96, 96)) < CAMERA_PIXELS
    wide = PERSPECTIVE.model_copy()
    object.__setattr__(wide, "rows", other.rows)
    assert largest_distance(wide, (96, 96)) > 0.1
