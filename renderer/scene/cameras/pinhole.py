"""A pinhole camera by its intrinsics, as OpenCV, COLMAP and nerfstudio have them."""

from __future__ import annotations

from typing import Literal

import numpy as np

from renderer.arguments.fields import stated
from renderer.arguments.types import ArrayLike
from renderer.scene.cameras.base import CentralCamera, Floats
from renderer.scene.cameras.calibrated import CalibratedCamera, opencv_extrinsics, opencv_intrinsics


class PinholeCamera(CalibratedCamera, CentralCamera):
    """A pinhole camera by its intrinsics, without distortion.

    Parameters
    ----------
    width, height : int
        The film in pixels. Pictures have this resolution by default. At another one of the same shape, up to a pixel,
        the intrinsics are scaled.
    fx, fy : float
        Focal lengths in pixels, from 1e-9 to 1e9.
    cx, cy : float, optional
        The principal point in pixels from the film's top left corner, by default the middle. The centre of the first
        pixel is at (0.5, 0.5), as for COLMAP and nerfstudio. `from_opencv` takes OpenCV's, which are half a pixel less.
    skew : float, default 0
        How far a pixel's columns lean, in pixels: K[0, 1] of OpenCV.
    eye, target, up : array_like, shape (3,)
        The place, as of ``PerspectiveCamera``.
    extrinsics : array_like, shape (3, 4) or (4, 4), optional
        In place of `eye`, `target` and `up`: the matrix [R|t] from world to camera, whose axes are OpenCV's: x right, y
        down, z forward. It is kept as eye, target and up.

    Raises
    ------
    SceneError
        For values that are not finite or out of range, or an R that is not a rotation within 1e-4.

    See Also
    --------
    OpenCVCamera : with distortion

    Examples
    --------
    >>> from renderer import PinholeCamera
    >>> camera = PinholeCamera(width=640, height=480, fx=500, fy=500, cx=300, eye=(0, 0, 5), target=(0, 0, 0))
    >>> camera.project([0, 0, 0])
    (array([300., 240.]), array(5.))

    Half the size, half the intrinsics.

    >>> camera.project([0, 0, 0], (320, 240))[0]
    array([150., 120.])
    """

    type: Literal["pinhole"] = "pinhole"

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
        eye: ArrayLike | None = None,
        target: ArrayLike | None = None,
        up: ArrayLike | None = None,
        extrinsics: ArrayLike | None = None,
        type: Literal["pinhole"] = "pinhole",
    ) -> None: ...

    @classmethod
    def from_opencv(cls, K: ArrayLike, R: ArrayLike, t: ArrayLike, *, width: int, height: int) -> PinholeCamera:
        """The camera of OpenCV's matrices, such as those of ``calibrateCamera`` and ``solvePnP``.

        Parameters
        ----------
        K : array_like, shape (3, 3)
            The camera matrix. OpenCV counts pixels from the centre of the first one, so `cx` and `cy` are half a pixel
            more.
        R : array_like, shape (3, 3) or (3,)
            The rotation from world to camera, or its rotation vector.
        t : array_like, shape (3,)
            The translation from world to camera. A column (3, 1) is allowed here and for `R`.
        width, height : int
            The size of the pictures.

        Returns
        -------
        PinholeCamera

        Raises
        ------
        ValueError
            As for the class.

        Notes
        -----
        A pixel of ``cv2.projectPoints`` without distortion is that of ``project`` less 0.5.

        Examples
        --------
        >>> from renderer import PinholeCamera
        >>> K = [[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]]
        >>> camera = PinholeCamera.from_opencv(K, [0, 0, 0], [0, 0, 5], width=640, height=480)
        >>> camera.eye, camera.project([[0, 0, 0], [1, 1, 0]])[0].tolist()
        ((0.0, 0.0, -5.0), [[320.0, 240.0], [420.0, 340.0]])
        """
        film = opencv_intrinsics(K)._asdict()
        return cls(**film, width=width, height=height, extrinsics=opencv_extrinsics(R, t))

    def rows(self, width: int, height: int) -> Floats:
        right, up, forward = self.frame()
        fx, fy, cx, cy, skew = self._intrinsics(width, height)
        across, zero = right / fx, np.zeros(3)
        down = -up / fy - across * (skew / fy)
        return np.array([self.eye, zero, zero, forward - across * cx - down * cy, across, down])
