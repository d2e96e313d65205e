"""A pinhole camera with distortion: OpenCV's own model, which COLMAP and nerfstudio call OPENCV."""

from __future__ import annotations

from typing import Literal

import numpy as np

from renderer.arguments.arrays import real_argument
from renderer.arguments.fields import stated
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.scene.cameras.base import AngularCamera, Floats
from renderer.scene.cameras.calibrated import CalibratedCamera, Number, opencv_extrinsics, opencv_intrinsics
from renderer.scene.cameras.distortion import Distortion


class OpenCVCamera(CalibratedCamera, AngularCamera):
    """A pinhole camera whose lens distorts the picture, by OpenCV's model (Brown and Conrady).

    A point at (X, Y, Z) in OpenCV's axes has x = X / Z, y = Y / Z and r² = x² + y². It appears where a pinhole camera
    shows

    | x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²),
    | y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y.

    Parameters
    ----------
    width, height, fx, fy, cx, cy, skew, eye, target, up, extrinsics
        As of ``PinholeCamera``.
    k1, k2, k3 : float, default 0
        The radial distortion.
    p1, p2 : float, default 0
        The tangential distortion.

    Raises
    ------
    SceneError
        As for ``PinholeCamera``.

    See Also
    --------
    PinholeCamera : without distortion
    OpenCVFisheyeCamera : the model of ``cv2.fisheye``

    Notes
    -----
    `rays` inverts the formula by Newton's method until roundings are left: within two focal lengths of the principal
    point the formula leads back to the pixel within 1e-14 focal lengths.

    Far from the axis the formula may turn back, so that two points share a pixel. `project` gives NaN from there on,
    unlike ``cv2.projectPoints``, and the picture is black where no other point appears. With tangential distortion the
    edge is a little early: where d/dr (r + k1 r³ + k2 r⁵ + k3 r⁷) falls to 8 r √(p1² + p2²).

    References
    ----------
    OpenCV, Camera Calibration and 3D Reconstruction; Brown, Close-range camera calibration, 1971.

    Examples
    --------
    >>> from renderer import OpenCVCamera
    >>> camera = OpenCVCamera(width=640, height=480, fx=500, fy=500, k1=-0.2, eye=(0, 0, 5), target=(0, 0, 0))
    >>> camera.project([[0, 0, 0], [2.5, 0, 0]])[0].tolist()
    [[320.0, 240.0], [557.5, 240.0]]
    >>> camera.rays((557.5, 240))[1].round(6).tolist()
    [0.447214, 0.0, -0.894427]
    """

    type: Literal["opencv"] = "opencv"
    k1: Number = 0.0
    k2: Number = 0.0
    p1: Number = 0.0
    p2: Number = 0.0
    k3: Number = 0.0

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
        p1: float = 0.0,
        p2: float = 0.0,
        k3: float = 0.0,
        eye: ArrayLike | None = None,
        target: ArrayLike | None = None,
        up: ArrayLike | None = None,
        extrinsics: ArrayLike | None = None,
        type: Literal["opencv"] = "opencv",
    ) -> None: ...

    @classmethod
    def from_opencv(
        cls, K: ArrayLike, D: ArrayLike, R: ArrayLike, t: ArrayLike, *, width: int, height: int
    ) -> OpenCVCamera:
        """The camera of OpenCV's matrices, such as those of ``cv2.calibrateCamera``.

        Parameters
        ----------
        K, R, t, width, height
            As of ``PinholeCamera.from_opencv``.
        D : array_like, shape (4,) or (5,)
            k1, k2, p1, p2 and, if there are five, k3. A column or a row is allowed.

        Returns
        -------
        OpenCVCamera

        Raises
        ------
        ValueError
            As for the class, and for the longer `D` of the rational, thin prism and tilted models.

        Notes
        -----
        A pixel of ``cv2.projectPoints`` is that of ``project`` less 0.5.

        Examples
        --------
        >>> from renderer import OpenCVCamera
        >>> K = [[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]]
        >>> D = [-0.2, 0.05, 0.001, -0.002]
        >>> camera = OpenCVCamera.from_opencv(K, D, [0, 0, 0], [0, 0, 5], width=640, height=480)
        >>> camera.k1, camera.p2, camera.project([1, 0, 0])[0].round(6).tolist()
        (-0.2, -0.002, [419.088, 240.02])
        """
        bent = real_argument("D", D)
        expected = "4 or 5 numbers k1, k2, p1, p2, k3, of no model with more"
        line = bent.size in (4, 5) and bent.size == max(bent.shape)
        expect(line, "D", expected, f"shape {bent.shape}")
        film = opencv_intrinsics(K)._asdict() | dict(zip(Distortion._fields, bent.ravel().tolist(), strict=False))
        return cls(**film, width=width, height=height, extrinsics=opencv_extrinsics(R, t))

    def _directions(self, x: Floats, y: Floats, width: int, height: int) -> Floats:
        right, down = self._distortion().straight(*self._intrinsics(width, height).plane(x, y))
        directions = np.stack([right, -down, np.ones_like(right)], axis=-1)
        return np.where(np.isnan(right)[..., None], np.nan, directions)

    def _film(self, across: Floats, above: Floats, ahead: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        bent = self._distortion()
        right, down = across / ahead, -above / ahead
        unseen = ~((ahead > 0.0) & (np.hypot(right, down) <= bent.reach()))
        x, y = self._intrinsics(width, height).film(*bent.bent(right, down))
        return np.where(unseen, np.nan, x), np.where(unseen, np.nan, y)

    def _distortion(self) -> Distortion:
        return Distortion(self.k1, self.k2, self.p1, self.p2, self.k3)
