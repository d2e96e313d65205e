"""A calibrated fish-eye: the model of ``cv2.fisheye``, which COLMAP and nerfstudio call OPENCV_FISHEYE."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from renderer.arguments.arrays import real_argument
from renderer.arguments.fields import stated
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.numerics.polynomials import least_positive_root, polynomial
from renderer.scene.cameras.base import AngularCamera, Floats
from renderer.scene.cameras.calibrated import CalibratedCamera, Number, opencv_extrinsics, opencv_intrinsics
from renderer.scene.cameras.fisheye import turned_away

# Steps of Newton's method, each at least as good as halving where that fails: enough for all bits.
_STEPS = 60


class OpenCVFisheyeCamera(CalibratedCamera, AngularCamera):
    """A calibrated fish-eye by OpenCV's model.

    A ray at the angle θ from the axis falls on the film at the distance θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) from the
    principal point, in focal lengths. The picture is black where this has no inverse.

    Parameters
    ----------
    width, height, fx, fy, cx, cy, skew, eye, target, up, extrinsics
        As of ``PinholeCamera``.
    k1, k2, k3, k4 : float, default 0
        The distortion. Without it the fish-eye is equidistant.

    Raises
    ------
    SceneError
        As for ``PinholeCamera``.

    Notes
    -----
    Points at 90 degrees from the axis and more have pixels too, unlike for ``cv2.fisheye.projectPoints``.

    References
    ----------
    OpenCV, fisheye camera model; Kannala and Brandt, A generic camera model and calibration method, 2006.

    Examples
    --------
    >>> from renderer import OpenCVFisheyeCamera
    >>> camera = OpenCVFisheyeCamera(width=640, height=480, fx=200, fy=200, k1=0.01, eye=(0, 0, 5), target=(0, 0, 0))
    >>> camera.project([[0, 0, 0], [5, 0, 0]])[0].round(6).tolist()
    [[320.0, 240.0], [478.048579, 240.0]]
    """

    type: Literal["opencv_fisheye"] = "opencv_fisheye"
    k1: Number = 0.0
    k2: Number = 0.0
    k3: Number = 0.0
    k4: Number = 0.0

    @stated
    def __init__(
        self,
        *,
        width: int,
        height: int,
        fx: float,
        fy: float,
        cx: float | None = None,
        cy: float | None = None,
        skew: float = 0.0,
        k1: float = 0.0,
        k2: float = 0.0,
        k3: float = 0.0,
        k4: float = 0.0,
        eye: ArrayLike | None = None,
        target: ArrayLike | None = None,
        up: ArrayLike | None = None,
        extrinsics: ArrayLike | None = None,
        type: Literal["opencv_fisheye"] = "opencv_fisheye",
    ) -> None: ...

    @classmethod
    def from_opencv(
        cls, K: ArrayLike, D: ArrayLike, R: ArrayLike, t: ArrayLike, *, width: int, height: int
    ) -> OpenCVFisheyeCamera:
        """The camera of OpenCV's matrices, such as those of ``cv2.fisheye.calibrate``.

        Parameters
        ----------
        K, R, t, width, height
            As of ``PinholeCamera.from_opencv``.
        D : array_like, shape (4,)
            k1, k2, k3 and k4. A column (4, 1) is allowed.

        Returns
        -------
        OpenCVFisheyeCamera

        Raises
        ------
        ValueError
            As for the class.

        Examples
        --------
        >>> from renderer import OpenCVFisheyeCamera
        >>> K = [[200, 0, 319.5], [0, 200, 239.5], [0, 0, 1]]
        >>> camera = OpenCVFisheyeCamera.from_opencv(K, [0.01, 0, 0, 0], [0, 0, 0], [0, 0, 5], width=640, height=480)
        >>> camera.cx, camera.k1
        (320.0, 0.01)
        """
        bent = real_argument("D", D)
        expect(bent.shape in ((4,), (4, 1), (1, 4)), "D", "shape (4,)", f"shape {bent.shape}")
        film = opencv_intrinsics(K)._asdict() | dict(zip(("k1", "k2", "k3", "k4"), bent.ravel().tolist(), strict=True))
        return cls(**film, width=width, height=height, extrinsics=opencv_extrinsics(R, t))

    def _directions(self, x: Floats, y: Floats, width: int, height: int) -> Floats:
        right, down = self._intrinsics(width, height).plane(x, y)
        return turned_away(self._angle(np.hypot(right, down)), right, down)

    def _film(self, across: Floats, above: Floats, ahead: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        aside = np.hypot(across, above)
        angle = np.arctan2(aside, ahead)
        share = self._distance(angle)[0] / np.where(aside > 0.0, aside, 1.0)
        unseen = (angle > self._widest()) | ((aside == 0.0) & (ahead <= 0.0))
        x, y = self._intrinsics(width, height).film(across * share, -above * share)
        return np.where(unseen, np.nan, x), np.where(unseen, np.nan, y)

    def _distance(self, angle: Floats) -> tuple[Floats, Floats]:
        """The distance from the principal point where a ray at an angle falls, in focal lengths, and its derivative."""
        square = angle * angle
        # rule: fisheye-distortion
        powers = (1.0, self.k1, self.k2, self.k3, self.k4)
        return angle * polynomial(powers, square), polynomial(self._slopes(), square)

    def _slopes(self) -> tuple[float, ...]:
        """The coefficients of the derivative in the angle's square."""
        return 1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3, 9.0 * self.k4

    def _widest(self) -> float:
        """The angle up to which the distance grows, at most a half turn."""
        return math.sqrt(min(least_positive_root(self._slopes()), math.pi**2))

    def _angle(self, distance: Floats) -> Floats:
        """The inverse of ``_distance``, by Newton's method within bounds; NaN where there is none."""
        widest = self._widest()
        least, most = np.zeros_like(distance), np.full_like(distance, widest)
        angle = np.minimum(distance, most)
        for _ in range(_STEPS):
            found, slope = self._distance(angle)
            error = found - distance
            least, most = np.where(error < 0.0, angle, least), np.where(error > 0.0, angle, most)
            with np.errstate(divide="ignore", invalid="ignore"):
                angle = angle - error / slope
            angle = np.where((angle >= least) & (angle <= most), angle, 0.5 * (least + most))
        return np.where(distance > self._distance(np.asarray(widest))[0], np.nan, angle)
