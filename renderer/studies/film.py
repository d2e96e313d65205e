"""The rays of a camera, one of the renderer's own or any with its methods, for depth maps and scans."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_array
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.numerics.film_rays import affine_map, unit_rows

Floats = NDArray[np.float64]


class AffineCamera(Protocol):
    """A camera whose rays are affine in the film position."""

    def rows(self, width: int, height: int) -> Floats:
        """The affine map from film to rays (6, 3): origin, its steps along x and y, direction, and its steps."""


class Camera(Protocol):
    """A camera with rays of its own, such as a ``FisheyeCamera``."""

    def rays(self, pixels: ArrayLike, resolution: tuple[int, int]) -> tuple[Floats, Floats]:
        """Origins and unit directions (..., 3) through film positions (..., 2); NaN for those that show nothing."""

    def frame(self) -> tuple[Floats, Floats, Floats]:
        """The axes to the right, up and forward."""


def is_camera(given: object) -> bool:
    """Whether it has the methods of a camera."""
    return any(callable(getattr(given, name, None)) for name in ("rows", "rays"))


def rays_of(camera: Any, width: int, height: int) -> Callable[[Floats, Floats], tuple[Floats, Floats]]:
    """The rays of a camera through film positions x and y."""
    if callable(getattr(camera, "rows", None)):
        rows = _rows_of(camera, width, height)
        return lambda x, y: _affine(rows, x, y)
    expect(callable(getattr(camera, "rays", None)), "camera", "a camera", type(camera).__name__)
    return lambda x, y: camera.rays(np.stack([x, y], axis=-1), (width, height))


def _affine(rows: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    origins, ways = affine_map(rows, x, y)
    good = np.isfinite(ways).all(axis=-1) & ways.any(axis=-1)
    if not good.all():
        expect(False, "camera", "rows with finite, non-zero directions", f"{ways[~good][0].tolist()}")
    return origins, unit_rows(ways)


def axis_of(camera: Any, width: int, height: int) -> Floats:
    """The direction along which a camera's z grows: across its film."""
    if callable(getattr(camera, "frame", None)):
        axis: Floats = camera.frame()[2]
        return axis
    rows = _rows_of(camera, width, height)
    return unit_rows(np.cross(rows[1] + rows[4], rows[2] + rows[5]))


def _rows_of(camera: AffineCamera, width: int, height: int) -> Floats:
    """A camera's affine map."""
    expected = "rows(width, height) of shape (6, 3), finite"
    try:
        given = camera.rows(width, height)
    except TypeError as error:  # of a class, or of one that takes other arguments
        raise ValueError(f"camera: expected {expected}, got {error}") from error
    try:
        rows = real_array(given)
    except ValueError as error:
        raise ValueError(f"camera: expected {expected}, got {type(given).__name__}") from error
    expect(rows.shape == (6, 3), "camera", expected, f"shape {rows.shape}")
    bad = ~np.isfinite(rows).all(axis=1)
    expect(not bad.any(), "camera", expected, f"{rows[int(bad.argmax())].tolist()} in row {int(bad.argmax())}")
    return rows.astype(np.float64)
