"""A camera with a thin lens, which is sharp at one distance alone."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from renderer.arguments.fields import stated
from renderer.arguments.limits import FARTHEST
from renderer.arguments.types import ArrayLike
from renderer.numerics.film_rays import affine_map, affine_rays, unit_rows
from renderer.numerics.mixing import mixed
from renderer.scene.cameras.base import Floats
from renderer.scene.cameras.perspective import PerspectiveCamera

_Length = Annotated[float, Field(ge=0.0, le=FARTHEST, strict=True)]
# The powers of the inverse of the plastic number, whose multiples fill the unit square evenly: the R2 sequence.
_R2 = 0.7548776662466927, 0.5698402909980532


class ThinLensCamera(PerspectiveCamera):
    """A perspective camera with a thin lens: what is not in focus is blurred.

    Parameters
    ----------
    eye : array_like, shape (3,)
        The middle of the lens.
    target, up, fov
        As of ``PerspectiveCamera``.
    aperture : float
        The radius of the lens in scene units, 0 or more.
    focus : float, optional
        The distance of the plane in focus, along the axis and above 0; by default that of `target`.

    Raises
    ------
    SceneError
        For values that are not finite or out of range.

    Notes
    -----
    A pixel's sample number i starts at the point of the lens that Shirley and Chiu's concentric map has for the place
    (frac(u + i a), frac(v + i a²)) of the unit square. Here a = 0.7549, the inverse of the plastic number, makes
    the R2 sequence, and u and v are a hash of the pixel's column and row. So bits are the same for any number of
    threads and any window. Sixteen samples and more look smooth. With one sample the picture is that of the
    `PerspectiveCamera`.

    Depth, normal and face of an ``Image``, ``rays``, ``project`` and ``depth_map`` are those of the lens's middle. The
    media around the eye are those of all points of the lens.

    References
    ----------
    Shirley and Chiu, A low distortion map between disk and square, 1997. Roberts, The unreasonable effectiveness of
    quasirandom sequences, 2018.

    Examples
    --------
    >>> from renderer import Phong, Scene, SceneObject, ThinLensCamera, render, shapes
    >>> camera = ThinLensCamera(eye=(0, 0, 5), target=(0, 0, 0), fov=30, aperture=0.5, focus=4)
    >>> ball = SceneObject(mesh=shapes.icosphere(3), material="grey")
    >>> scene = Scene(camera=camera, materials={"grey": Phong()}, objects=[ball], background=1)
    >>> [int((render(scene, resolution=64, samples=n).radiance < 1).all(axis=2).sum()) for n in (1, 64)]
    [1852, 2292]
    """

    type: Literal["thin_lens"] = "thin_lens"  # type: ignore[assignment]
    aperture: _Length
    focus: Annotated[float, Field(gt=0.0, le=FARTHEST, strict=True)] | None = None

    @stated
    def __init__(
        self,
        *,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 1.0, 0.0),
        fov: float = 45.0,
        aperture: float,
        focus: float | None = None,
        type: Literal["thin_lens"] = "thin_lens",
    ) -> None: ...

    def _focus_distance(self) -> float:
        return math.dist(self.eye, self.target) if self.focus is None else self.focus

    def _has_lens(self, samples: int) -> bool:
        return samples > 1 and self.aperture > 0.0

    def _sample_rays(
        self, x: Floats, y: Floats, width: int, height: int, number: int, samples: int
    ) -> tuple[Floats, Floats]:
        rows = self.rows(width, height)
        if number == samples:
            return affine_rays(rows, x, y)
        right, up, _ = self.frame()
        across, above = (self.aperture * place[..., None] for place in _on_disk(*lens_places(x, y, number)))
        # rule: point-on-lens
        on_lens = across * right + above * up
        # The rows' directions reach one unit along the axis.
        in_focus = affine_map(rows, x, y)[1] * self._focus_distance()
        return rows[0] + on_lens, unit_rows(in_focus - on_lens)


def lens_places(x: Floats, y: Floats, number: int) -> tuple[Floats, Floats]:
    """Places in the unit square for a sample of the pixels at film positions ``x`` and ``y``."""
    column, row = (np.floor(place).astype(np.int64).astype(np.uint64) for place in (x, y))  # also beside the film
    mixed_bits = mixed(column << np.uint64(32) | row)
    starts = mixed_bits >> np.uint64(32), mixed_bits & np.uint64(0xFFFFFFFF)
    u, v = ((start.astype(np.float64) / 2.0**32 + number * step) % 1.0 for start, step in zip(starts, _R2, strict=True))
    return u, v


def _on_disk(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Shirley and Chiu's concentric map of the unit square to the unit disk, which keeps ratios of areas."""
    a, b = 2.0 * u - 1.0, 2.0 * v - 1.0
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    ratio = np.where(wide, b, a) / np.where(radius == 0.0, 1.0, radius)
    angle = np.where(wide, 0.25 * math.pi * ratio, 0.5 * math.pi - 0.25 * math.pi * ratio)
    return radius * np.cos(angle), radius * np.sin(angle)
