"""Pictures without their background: the share of each pixel that shows a surface, as the alpha of a PNG file."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderer.materials.columns import AMBIENT, IOR, KIND, UNLIT
from renderer.picture.encoding import write_pixels
from renderer.picture.exposure import exposed
from renderer.picture.image import srgb
from renderer.picture.prepare import PreparedScene
from renderer.picture.tone import toned
from renderer.scene.camera import Camera
from renderer.scene.scene import RenderSettings
from renderer.shade.records import EMISSION, OPACITY, OPACITY_MAP, TINTED
from renderer.system.files import write_atomically
from renderer.trace.spawn import BOUNDED


@dataclass(frozen=True, eq=False)
class Matte:
    """The hits of a picture's camera rays.

    hits        the sum of the weights of a pixel's samples that hit a surface, (h, w) float64: their number, but for
                filters that are negative somewhere, and clipped to that of all samples
    samples     the number of samples of each pixel
    background  the weighted sum over the other samples of the radiance that they see, divided by ``samples``, (h, w, 3)
                float32
    """

    hits: NDArray[np.float64]
    samples: int
    background: NDArray[np.float32]

    @property
    def alpha(self) -> NDArray[np.uint8]:
        """The share of hits in 255ths, rounded up, (h, w)."""
        return (-(-255 * self.hits // self.samples)).astype(np.uint8)

    def exposed(self, stops: float) -> "Matte":
        """That of a picture with an exposure."""
        return replace(self, background=exposed(self.background, stops))


def matte_of(
    prepared: PreparedScene,
    camera: Camera,
    chosen: RenderSettings,
    threads: int,
    finished: Callable[[int], object] | None = None,
    band: tuple[int, int] | None = None,
    columns: tuple[int, int] | None = None,
) -> Matte:
    """The matte of the picture with these arguments; see ``PreparedScene.picture``.

    Two pictures by the same rays tell it, without bounces but through surfaces that are partly there: white surfaces
    before black, and black surfaces before the background.
    """
    shapes, colors, sky = _unlit(prepared), prepared.arrays.colors, prepared.arrays.sky
    blends = bool((shapes.arrays.maps[:, OPACITY] < 1.0).any() or (shapes.arrays.maps[:, OPACITY_MAP] >= 0.0).any())
    if not blends:
        chosen = chosen.model_copy(update={"max_depth": 0})

    def seen(ambient: float, background: NDArray[np.float64], sky: NDArray[np.float64]) -> NDArray[np.float32]:
        arrays = shapes.arrays._replace(colors=np.array([[ambient] * 3, background]), sky=sky)
        shown = replace(shapes, arrays=arrays)
        return shown.picture(camera, chosen, BOUNDED, threads, finished, (), band, columns=columns).radiance

    share = seen(1.0, np.zeros(3), sky[:0])[..., 0].astype(np.float64)
    hits = np.clip(chosen.samples * share, 0.0, chosen.samples)
    if chosen.filter != "mitchell" and not blends:  # all samples count 1, up to the rounding of float32
        hits = np.rint(hits)
    return Matte(hits, chosen.samples, seen(0.0, colors[1], sky))


def _unlit(prepared: PreparedScene) -> PreparedScene:
    """``prepared`` with opaque surfaces whose radiance is that of the ambient light."""
    arrays = prepared.arrays
    materials = np.zeros_like(arrays.materials)
    materials[:, KIND], materials[:, AMBIENT : AMBIENT + 3], materials[:, IOR] = UNLIT, 1.0, 1.0
    # Of what changes along surfaces, opacity alone is left.
    maps = arrays.maps.copy()
    maps[:, :EMISSION], maps[:, EMISSION : EMISSION + 3], maps[:, TINTED] = -1.0, 0.0, 0.0
    needs = replace(prepared.needs, reflection=False, refraction=prepared.needs.textures)
    alone = arrays._replace(materials=materials, maps=maps, media=arrays.media[:0], touching=arrays.touching[:0])
    return replace(prepared, needs=needs, arrays=alone)


def cut_out(radiance: NDArray[np.float32], matte: Matte, tone: str = "srgb") -> NDArray[np.uint8]:
    """The pixels of a transparent picture, (h, w, 4): sRGB that is not multiplied by alpha, and alpha.

    Linear colours over the background, by alpha in 255ths, are ``radiance`` again. Alpha is rounded up, so that each
    colour lies between that of the surface and of the background, and is one that sRGB has if both are. A tone curve
    is that of the surface alone.
    """
    alpha, misses = matte.alpha, matte.samples - matte.hits
    share = (alpha / 255.0)[..., None]
    behind = matte.background * (matte.samples / np.where(misses > 0.0, misses, 1.0))[..., None]
    seen = alpha > 0
    colors = (radiance - (1.0 - share) * behind)[seen] / share[seen]
    pixels = np.zeros((*alpha.shape, 4), np.uint8)
    pixels[seen] = np.column_stack([srgb(toned(colors, tone)), alpha[seen]])
    return pixels


def save_cut_out(path: str | os.PathLike[str], radiance: NDArray[np.float32], matte: Matte, tone: str = "srgb") -> None:
    """Write a transparent picture as a PNG file, whole or not at all."""
    write_atomically(path, lambda file: write_pixels(file, cut_out(radiance, matte, tone)))
