"""A scene with its film shifted by a fraction of a pixel, for ``compare.fragile_pixels``."""

import numpy as np
from numpy.typing import NDArray

from renderer.scene.camera import OrthographicCamera, PerspectiveCamera
from renderer.scene.scene import Scene

Shift = tuple[float, float]


class _ShiftedPerspective(PerspectiveCamera):
    shift: Shift

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        return _shift_rows(super().rows(width, height), self.shift)


class _ShiftedOrthographic(OrthographicCamera):
    shift: Shift

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        return _shift_rows(super().rows(width, height), self.shift)


def _shift_rows(rows: NDArray[np.float64], shift: Shift) -> NDArray[np.float64]:
    moved = rows.copy()
    moved[0] += shift[0] * rows[1] + shift[1] * rows[2]
    moved[3] += shift[0] * rows[4] + shift[1] * rows[5]
    return moved


def shifted(scene: Scene, shift: Shift) -> Scene:
    """The scene with its film shifted by ``shift`` pixels in x and y; meshes are not loaded again."""
    kind = _ShiftedPerspective if isinstance(scene.camera, PerspectiveCamera) else _ShiftedOrthographic
    return scene.altered(camera=kind(**scene.camera.model_dump(), shift=shift))
