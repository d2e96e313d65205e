"""Shared by calibrated cameras: intrinsics in pixels of a stated film, and extrinsics [R|t] in OpenCV's axes."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.scene.cameras.base import BaseCamera, Floats
from renderer.scene.cameras.intrinsics import Intrinsics

# Of R R^T from the unit matrix: files keep six digits or more.
_RIGID = 1e-4

# What may be None, which is as if left out.
_OPTIONAL = ("eye", "target", "up", "extrinsics", "cx", "cy")

_MOST_PIXELS = 65536
# So that products of intrinsics and directions are far from the ends of float64.
_LARGEST = 1e9
Pixels = Annotated[int, Field(ge=1, le=_MOST_PIXELS, strict=True)]
Focal = Annotated[float, Field(ge=1.0 / _LARGEST, le=_LARGEST, allow_inf_nan=False, strict=True)]
Number = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST, allow_inf_nan=False, strict=True)]


class CalibratedCamera(BaseCamera):
    """A camera with a focal length along x and y, a principal point and a skew."""

    width: Pixels
    height: Pixels
    fx: Focal
    fy: Focal
    cx: Number
    cy: Number
    skew: Number = 0.0

    @model_validator(mode="before")
    @classmethod
    def _placed(cls, values: Any) -> Any:
        """Eye, target and up in place of ``extrinsics``, and the film's middle as principal point by default."""
        if not isinstance(values, dict):
            return values
        left_out = [name for name in _OPTIONAL if name in values and values[name] is None]
        values = {name: value for name, value in values.items() if name not in left_out}
        if "extrinsics" in values:
            both = [name for name in ("eye", "target", "up") if name in values]
            expect(not both, "extrinsics", "none beside eye, target and up", f"{' and '.join(both)}, too")
            values |= _place_of(values.pop("extrinsics"))
        for name, size in (("cx", "width"), ("cy", "height")):
            pixels = values.get(size)
            if name not in values and isinstance(pixels, int | np.integer):
                values[name] = min(max(pixels, 0), _MOST_PIXELS) / 2  # others are refused with their field
        return values

    @property
    def film_size(self) -> tuple[int, int]:
        return self.width, self.height

    def _intrinsics(self, width: int, height: int) -> Intrinsics:
        """Those for a film of another size and the same shape."""
        far = abs(width * self.height - height * self.width)
        same = far <= max(self.width, self.height)
        expected = f"{self.width} x {self.height}, the camera's own, or another size of that shape"
        expect(same, "resolution", expected, f"{width} x {height}")
        x, y = width / self.width, height / self.height
        return Intrinsics(self.fx * x, self.fy * y, self.cx * x, self.cy * y, self.skew * x)


def opencv_intrinsics(K: ArrayLike) -> Intrinsics:
    """The ``Intrinsics`` of OpenCV's camera matrix (3, 3), which has the first pixel's centre at (0, 0)."""
    matrix = real_argument("K", K).astype(np.float64)
    shape = matrix.shape == (3, 3) and matrix[1, 0] == 0.0 and matrix[2].tolist() == [0.0, 0.0, 1.0]
    expect(shape, "K", "[[fx, skew, cx], [0, fy, cy], [0, 0, 1]]", repr(matrix.tolist()))
    (fx, skew, cx), (_, fy, cy), _ = matrix.tolist()
    # rule: opencv-pixels
    return Intrinsics(fx, fy, cx + 0.5, cy + 0.5, skew)


def opencv_extrinsics(R: ArrayLike, t: ArrayLike) -> Floats:
    """[R|t] of a rotation (3, 3) or OpenCV's rotation vector (3,), and a translation (3,); columns are allowed."""
    turn, move = real_argument("R", R).astype(np.float64), real_argument("t", t).astype(np.float64)
    expect(turn.shape in ((3, 3), (3,), (3, 1), (1, 3)), "R", "shape (3, 3) or (3,)", f"shape {turn.shape}")
    expect(move.shape in ((3,), (3, 1), (1, 3)), "t", "shape (3,)", f"shape {move.shape}")
    turn = turn if turn.shape == (3, 3) else _turn_about(turn.ravel())
    return np.concatenate([turn, move.reshape(3, 1)], axis=1)


def _turn_about(vector: Floats) -> Floats:
    """Rodrigues' formula: the rotation about a vector by its length in radians."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + 2.0 * np.sin(angle / 2.0) ** 2 * (cross @ cross)


def _place_of(extrinsics: ArrayLike) -> dict[str, tuple[float, ...]]:
    """Eye, target and up of a matrix [R|t], world to camera: x right, y down, z forward."""
    matrix = real_argument("extrinsics", extrinsics).astype(np.float64)
    expect(matrix.shape in ((3, 4), (4, 4)), "extrinsics", "shape (3, 4) or (4, 4)", f"shape {matrix.shape}")
    expect(bool(np.isfinite(matrix).all()), "extrinsics", "finite numbers", repr(matrix.tolist()))
    last = matrix[3:].tolist()
    expect(last in ([], [[0.0, 0.0, 0.0, 1.0]]), "extrinsics", "a last row of 0, 0, 0, 1", last)
    turn, move = matrix[:3, :3], matrix[:3, 3]
    with np.errstate(all="ignore"):
        rigid = np.abs(turn @ turn.T - np.eye(3)).max() <= _RIGID and np.linalg.det(turn) > 0.0
    expect(bool(rigid), "extrinsics", "a rotation R, without a scale or a mirror, in [R|t]", repr(turn.tolist()))
    eye = 0.0 - np.linalg.solve(turn, move)
    # As far away as the eye is from the origin, or their difference would lose digits.
    far = 2.0 ** np.ceil(np.log2(max(1.0, np.abs(eye).max())))
    place = {"eye": eye, "target": eye + far * turn[2], "up": 0.0 - turn[1]}
    return {name: tuple(vector.tolist()) for name, vector in place.items()}
