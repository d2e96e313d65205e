"""The pictures that answer one view: small ones at once, the full one when it is done."""

import io
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.inspect.face_phong import face_colors
from renderer.inspect.false_color import Limits, false_color, limits_of
from renderer.picture.image import Image
from renderer.picture.prepare import TILE
from renderer.trace.spawn import BOUNDED
from renderer.viewer.protocol import FACE_COLORS, JPEG, RGBA, CameraMessage, Rows, packed
from renderer.viewer.shown import ShownScene, render_settings, varied
from renderer.viewer.viewpoint import camera_of, seen_from

# Longest sides of the first passes: a sixteenth and a quarter of the pixels of a picture of 512 x 512; and of a third
# one, of at most a quarter of the pixels, before a picture of so many that it takes its time.
COARSE = (128, 256)
_MIDDLE = 1024
# The pixels of a message, four megabytes: as many as a browser draws without a hitch. Larger pictures come in bands.
BAND_PIXELS = 1 << 20
# The planes that an AOV is drawn from, beside radiance, and the counted rays that give the pace.
_PLANES = {"color": (), "cost": (), "depth": ("depth", "face"), "normal": ("normal", "face"), "face": ("face",)}
# AOVs on a scale that goes from the least value of the whole picture to the greatest.
_SCALED = ("depth", "cost")
# On Pillow's scale; above it files grow faster than the quality that can be seen.
_JPEG_QUALITY = 90


@dataclass(frozen=True)
class Pass:
    """One answer to a view: its number from 0, whether it is the last, the picture's size (w, h) and samples per pixel;
    and the rows that are a part of the full picture, first and end, or None for all of one.
    """

    step: int
    last: bool
    size: tuple[int, int]
    samples: int
    band: tuple[int, int] | None = None


def passes_of(view: CameraMessage) -> list[Pass]:
    """The passes that answer ``view``: none for "gl", face colours for "phong", one picture or growing ones.

    Brute force takes one sample per pixel: with many it would take minutes. Octree pictures of more than BAND_PIXELS
    end in bands from top to bottom, where the colours of a pixel do not depend on all others.
    """
    if view.mode == "gl":
        return []
    longest = max(view.w, view.h)
    coarse = [side for side in COARSE if side < longest] if view.mode == "octree" else []
    if coarse and longest >= 2 * _MIDDLE:
        coarse.append(_MIDDLE)
    # The first pass is shown even if a newer view comes meanwhile, so it must not be one of many samples.
    if view.mode == "octree" and view.settings.samples > 1 and not coarse:
        coarse = [longest]
    sizes = [(_scaled(view.w, side, longest), _scaled(view.h, side, longest)) for side in coarse]
    first = [Pass(step, False, size, 1) for step, size in enumerate(sizes)]
    samples = view.settings.samples if view.mode == "octree" else 1
    bands = _bands(view) if view.mode == "octree" and view.settings.aov not in _SCALED else [None]
    full = enumerate(bands, len(sizes))
    return [*first, *(Pass(step, band is bands[-1], (view.w, view.h), samples, band) for step, band in full)]


def _bands(view: CameraMessage) -> list[tuple[int, int] | None]:
    """Rows of the full picture, first and end of each band; None for all where it is no large one."""
    if view.w * view.h <= BAND_PIXELS:
        return [None]
    rows = max(TILE, BAND_PIXELS // view.w // TILE * TILE)
    return [(first, min(first + rows, view.h)) for first in range(0, view.h, rows)]


class Answer(NamedTuple):
    """A message for the page, and the values at the ends of its scale of colours if it has one."""

    message: bytes
    limits: Limits | None


def answer(shown: ShownScene, view: CameraMessage, wanted: Pass, finished: Callable[[int], None]) -> Answer:
    """The answer of one pass. ``finished(tiles)`` is called after each tile; what it raises ends the pass.

    The milliseconds that it gives are from the start of the pass to its payload, the rays per second those of tracing
    alone.
    """
    began, limits, (width, height) = time.perf_counter(), None, wanted.size
    first, end = wanted.band or (0, height)
    if view.mode == "phong":
        prepared = varied(shown.prepared, view.settings)
        eye = seen_from(camera_of(view.m, view.fovy, height=view.height), prepared.mesh.bounds)
        payload = face_colors(prepared.arrays, eye, shown.threads).tobytes()
        kind, pace = FACE_COLORS, 0.0
    else:
        image = picture(shown, view, wanted, finished)
        rgb, limits = colored(image, view.settings.aov)
        kind, payload = (JPEG, _jpeg(rgb)) if view.settings.pixels == "jpeg" else (RGBA, _rgba(rgb))
        pace = float(image.rays.sum()) / image.render_seconds / 1e6
    ms = (time.perf_counter() - began) * 1e3
    rows = Rows(first, end - first, height)
    return Answer(packed(kind, view, wanted.step, wanted.last, width, rows, (ms, pace)) + payload, limits)


def picture(
    shown: ShownScene, view: CameraMessage, wanted: Pass, finished: Callable[[int], None] | None = None
) -> Image:
    """The same picture that ``render`` gives for the view's camera and settings, or the band of it that is wanted."""
    prepared = varied(shown.brute if view.mode == "brute" else shown.prepared, view.settings)
    settings = render_settings(
        shown.scene, view.settings, wanted.size, wanted.samples, wanted.last or wanted.band is not None
    )
    camera = camera_of(view.m, view.fovy, height=view.height)
    planes = ("rays", *_PLANES[view.settings.aov])
    return prepared.picture(camera, settings, BOUNDED, shown.threads, finished, planes, wanted.band)


def colored(image: Image, aov: str) -> tuple[NDArray[np.uint8], Limits | None]:
    """The colours of a picture's AOV, (h, w, 3), and the ends of their scale if it has one."""
    limits = limits_of(image, aov) if aov in _SCALED else None
    return false_color(image, aov, limits), limits


def _scaled(side: int, longest: int, of: int) -> int:
    return max(1, round(side * longest / of))


def _rgba(rgb: NDArray[np.uint8]) -> bytes:
    opaque = np.full((*rgb.shape[:2], 4), 255, np.uint8)
    opaque[..., :3] = rgb
    return opaque.tobytes()


def _jpeg(rgb: NDArray[np.uint8]) -> bytes:
    from PIL import Image as Pillow  # not needed where a page asks for "rgba"

    buffer = io.BytesIO()
    Pillow.fromarray(rgb).save(buffer, "jpeg", quality=_JPEG_QUALITY)
    return buffer.getvalue()
