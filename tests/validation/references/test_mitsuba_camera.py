"""Our cameras against Mitsuba's sensors, and that the check sees a camera that is off."""

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene.camera import OrthographicCamera, PerspectiveCamera
from validation.references.mitsuba.camera import largest_distance
from validation.thresholds import Pictures

CAMERA_PIXELS = Pictures().camera_pixels
PERSPECTIVE = PerspectiveCamera(eye=(1.0, 2.0, 5.0), target=(0.2, 0.5, 0.0), fov=37.0)
ORTHOGRAPHIC = OrthographicCamera(type="orthographic", eye=(3.0, 4.0, 5.0), target=(0.0, 1.0, 0.0), height=4.0)


@pytest.mark.judges("OrthographicCamera.rows", "PerspectiveCamera", "PerspectiveCamera.rows")
@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC])
def test_our_rays_are_mitsubas(camera: PerspectiveCamera | OrthographicCamera) -> None:
    assert largest_distance(camera, 96) < CAMERA_PIXELS


@pytest.mark.parametrize("row", [0, 3])
def test_a_tenth_of_a_pixel_is_seen(monkeypatch: pytest.MonkeyPatch, row: int) -> None:
    kind = PerspectiveCamera if row == 3 else OrthographicCamera
    rows = kind.rows

    def shifted(self: PerspectiveCamera, width: int, height: int) -> NDArray[np.float64]:
        moved = rows(self, width, height)
        moved[row] += 0.1 * moved[row + 1]
        return moved

    monkeypatch.setattr(kind, "rows", shifted)
    assert largest_distance(PERSPECTIVE if row == 3 else ORTHOGRAPHIC, 96) > 10 * CAMERA_PIXELS


def test_a_wider_field_of_view_is_seen() -> None:
    other = PERSPECTIVE.model_copy(update={"fov": 37.3})
    assert largest_distance(other, 96) < CAMERA_PIXELS
    wide = PERSPECTIVE.model_copy()
    object.__setattr__(wide, "rows", other.rows)
    assert largest_distance(wide, 96) > 0.1
