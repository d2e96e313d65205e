"""The pictures that answer one view: small ones at once, the full one when it is done, finer ones while it rests."""

import struct
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.diagnostics.face_phong import face_colors
from renderer.diagnostics.false_color import Limits, false_color, limits_of, limits_of_counts, scale_colors, shades_of
from renderer.diagnostics.ray_cost import camera_steps
from renderer.picture.camera_rays import TILE
from renderer.picture.encoding import encoded
from renderer.picture.exposure import exposed
from renderer.picture.image import Image, srgb
from renderer.picture.prepare import PreparedScene, tiles
from renderer.scene.camera import Camera
from renderer.scene.scene import RenderSettings
from renderer.trace.spawn import BOUNDED
from renderer.viewer.compare import Comparison, compared, heat_map
from renderer.viewer.protocol import (
    FACE_COLORS,
    JPEG,
    PROOF,
    RGBA,
    CameraMessage,
    Mode,
    Probe,
    Rows,
    packed,
)
from renderer.viewer.shown import ShownScene, render_settings, varied
from renderer.viewer.viewpoint import camera_of, seen_from

# Longest sides of the first passes: a sixteenth and a quarter of the pixels of a picture of 512 x 512; and of a third
# one, of at most a quarter of the pixels, before a picture of so many that it takes its time.
COARSE = (128, 256)
_MIDDLE = 1024
# The pixels of a message, four megabytes: as many as a browser draws without a hitch. Larger pictures come in bands.
BAND_PIXELS = 1 << 20
# The longest side of a picture that is compared with another renderer's, which may take milliseconds a ray.
_LONGEST_REFERENCE = 256
# The samples per pixel by which the picture of a camera at rest grows, each four times those before.
REFINED = (4, 16, 64)
# The planes that an AOV is drawn from, beside radiance, and the counted rays that give the pace.
_PLANES = {"color": (), "cost": (), "depth": ("depth", "face"), "normal": ("normal", "face"), "face": ("face",)}
STEPS = ("nodes", "triangles")
# AOVs on a scale that goes from the least value of the whole picture to the greatest.
_SCALED = ("depth", "cost", *STEPS)
# On Pillow's scale; above it files grow faster than the quality that can be seen.
_JPEG_QUALITY = 90
# Of Pillow's nine: on this machine the page is as fast with larger files.
_PNG_EFFORT = 1


@dataclass(frozen=True)
class Pass:
    """One answer to a view: its number from 0, whether the picture is whole and as fine as asked for by it, the
    picture's size (w, h) and samples per pixel; the rows that are a part of the full picture, first and end, or None
    for all of one; and whether it only refines a picture that was whole before.
    """

    step: int
    last: bool
    size: tuple[int, int]
    samples: int
    band: tuple[int, int] | None = None
    refines: bool = False

    @property
    def work(self) -> int:
        """The number of its camera rays."""
        first, end = self.band or (0, self.size[1])
        return self.size[0] * (end - first) * self.samples


def passes_of(view: CameraMessage, threads: int = 1) -> list[Pass]:
    """The passes that answer ``view``: none for "gl", face colours for "phong", one picture or growing ones.

    Brute force takes one sample per pixel: with many it would take minutes; its picture comes in bands of a few tiles
    for each of ``threads``. Octree pictures of more than BAND_PIXELS end in bands too, where the colours of a pixel do
    not depend on all others.
    """
    if view.mode == "gl":
        return []
    if view.mode == "phong":
        return [Pass(0, True, (view.w, view.h), 1)]
    octree, (width, height) = view.mode == "octree", _full_size(view)
    samples = view.settings.samples if octree else 1
    coarse = _coarse_sizes(width, height, samples, octree)
    found = [Pass(step, False, size, 1) for step, size in enumerate(coarse)]
    bands = _bands(view, threads)
    for number in (samples, *_refined(view)):
        found += [
            Pass(len(found) + i, band is bands[-1], (width, height), number, band, number > samples)
            for i, band in enumerate(bands)
        ]
    return found


def _full_size(view: CameraMessage) -> tuple[int, int]:
    """The size of the last picture: that of the view, or less for a proof, whose floats are kept."""
    if view.mode != "proof":
        return view.w, view.h
    most, longest = min(1.0, (BAND_PIXELS / (view.w * view.h)) ** 0.5), max(view.w, view.h)
    if view.settings.pair not in ("brute", "samples"):
        most = min(most, _LONGEST_REFERENCE / longest)
    return max(1, int(view.w * most)), max(1, int(view.h * most))


def _coarse_sizes(width: int, height: int, samples: int, octree: bool) -> list[tuple[int, int]]:
    longest = max(width, height)
    coarse = [side for side in COARSE if side < longest]
    if coarse and octree and longest >= 2 * _MIDDLE:
        coarse.append(_MIDDLE)
    # The first pass is shown even if a newer view comes meanwhile, so it must not be one of many samples.
    if samples > 1 and not coarse:
        coarse = [longest]
    return [(_scaled(width, side, longest), _scaled(height, side, longest)) for side in coarse]


def _refined(view: CameraMessage) -> list[int]:
    """The samples per pixel to which the view's picture grows at rest."""
    settings = view.settings
    if view.mode != "octree" or settings.aov != "color":
        return []
    return [samples for samples in REFINED if settings.samples < samples <= settings.refine]


def _bands(view: CameraMessage, threads: int) -> list[tuple[int, int] | None]:
    """Rows of the full picture, first and end of each band; None for all where it comes whole."""
    if view.mode == "proof" or view.settings.aov in _SCALED:
        return [None]
    across = -(-view.w // TILE)
    rows = max(TILE, BAND_PIXELS // view.w // TILE * TILE)
    if view.mode == "brute":
        rows = min(rows, TILE * -(-2 * threads // across))
    if view.h <= rows or (view.mode == "octree" and view.w * view.h <= BAND_PIXELS):
        return [None]
    return [(first, min(first + rows, view.h)) for first in range(0, view.h, rows)]


class Answer(NamedTuple):
    """A message for the page, what is told before it, the colours if they are a picture's, and a proof's pictures."""

    message: bytes
    told: dict[str, Any] | None = None
    colors: NDArray[np.uint8] | None = None
    comparison: Comparison | None = None


class _Payload(NamedTuple):
    kind: int
    payload: bytes
    rays: float = 0.0  # a second
    told: dict[str, Any] | None = None
    colors: NDArray[np.uint8] | None = None
    comparison: Comparison | None = None


def answer(shown: ShownScene, view: CameraMessage, wanted: Pass, finished: Callable[[float], object]) -> Answer:
    """The answer of one pass. ``finished(share)`` is called with shares of it as they are done; what it raises ends it.

    The milliseconds that it gives are from the start of the pass to its payload, the rays per second those of tracing
    alone.
    """
    began, (width, height) = time.perf_counter(), wanted.size
    first, end = wanted.band or (0, height)
    made = _PAYLOADS.get(view.mode, _traced)(shown, view, wanted, finished)
    pace = (time.perf_counter() - began) * 1e3, made.rays / 1e6
    header = packed(made.kind, view, wanted.step, wanted.last, width, Rows(first, end - first, height), pace)
    told = made.told and made.told | {"seq": view.seq, "step": wanted.step, "w": width, "h": height}
    return Answer(header + made.payload, told, made.colors, made.comparison)


def _colored(shown: ShownScene, view: CameraMessage, *_: object) -> _Payload:
    """Face colours."""
    prepared = varied(shown.prepared, view.settings)
    eye = seen_from(camera_of(view.m, view.fovy, height=view.height), prepared.mesh.bounds)
    return _Payload(FACE_COLORS, face_colors(prepared.arrays, eye, shown.threads).tobytes())


def _traced(shown: ShownScene, view: CameraMessage, wanted: Pass, finished: Callable[[float], object]) -> _Payload:
    """A picture, or a band of one."""
    aov, (rgb, limits, rays) = view.settings.aov, colored(shown, view, wanted, finished)
    legend = _legend(aov, limits) if aov in _SCALED else None
    if view.settings.pixels == "jpeg":
        return _Payload(JPEG, encoded(rgb, "jpeg", quality=_JPEG_QUALITY), rays, legend, rgb)
    return _Payload(RGBA, _rgba(rgb), rays, legend, rgb)


def colored(
    shown: ShownScene, view: CameraMessage, wanted: Pass, finished: Callable[[float], object]
) -> tuple[NDArray[np.uint8], Limits, float]:
    """The colours of a picture or a band, (h, w, 3), the ends of their scale if it has one, and rays per second."""
    aov = view.settings.aov
    if aov in STEPS:
        return _steps(shown, view, wanted, finished)
    image = picture(shown, view, wanted, finished)
    limits = limits_of(image, aov)
    rgb = false_color(image, aov, limits if aov in _SCALED else None, len(shown.prepared.mesh.faces))
    return rgb, limits, float(image.rays.sum()) / image.render_seconds


def _proven(shown: ShownScene, view: CameraMessage, wanted: Pass, finished: Callable[[float], object]) -> _Payload:
    """Both pictures of a comparison, and their heat map."""
    comparison = compared(shown, view, wanted.size, finished)
    heat, limits = heat_map(comparison)
    colors = [srgb(exposed(picture, view.settings.exposure)) for picture in comparison.pictures]
    files = [encoded(rgb, compress_level=_PNG_EFFORT) for rgb in (*colors, heat)]
    told = _legend("difference", limits) | comparison.described() | {"type": "proof"}
    payload = b"".join(chain(*((struct.pack("<I", len(file)), file) for file in files)))
    return _Payload(PROOF, payload, told=told, comparison=comparison)


_PAYLOADS: dict[Mode, Callable[[ShownScene, CameraMessage, Pass, Callable[[float], object]], _Payload]] = {
    "phong": _colored,
    "proof": _proven,
}


def _legend(aov: str, limits: Limits) -> dict[str, Any]:
    """The legend of a scale of colours: its ends, and the colours at even steps between them."""
    return {"type": "legend", "aov": aov, "low": limits[0], "high": limits[1], "colors": scale_colors(aov).tolist()}


def _steps(
    shown: ShownScene, view: CameraMessage, wanted: Pass, finished: Callable[[float], object]
) -> tuple[NDArray[np.uint8], Limits, float]:
    """The steps of the camera rays as colours, the ends of their scale, and rays per second."""
    began = time.perf_counter()
    prepared = shown.brute if view.mode == "brute" else shown.prepared
    camera = camera_of(view.m, view.fovy, height=view.height)
    counts = getattr(camera_steps(prepared, camera, wanted.size, finished), view.settings.aov)
    low, high = limits_of_counts(counts)
    return shades_of(counts, low, high), (low, high), counts.size / (time.perf_counter() - began)


def picture(
    shown: ShownScene,
    view: CameraMessage | Probe,
    wanted: Pass,
    finished: Callable[[float], object] = lambda share: None,
    planes: Collection[str] | None = None,
) -> Image:
    """The picture that ``render`` gives for the view's camera and settings, or one band of it, with the ``planes`` that
    are asked for, by default those that it is drawn from. In colour it has the view's exposure.
    """
    prepared, camera, settings = traced_by(shown, view, wanted)
    planes = ("rays", *_PLANES[view.settings.aov]) if planes is None else planes
    first, end = wanted.band or (0, wanted.size[1])
    number = tiles(wanted.size[0], end - first)
    image = prepared.picture(
        camera, settings, BOUNDED, shown.threads, lambda done: finished(done / number), planes, wanted.band
    )
    if view.settings.aov != "color":
        return image
    return replace(image, radiance=exposed(image.radiance, view.settings.exposure))


def traced_by(
    shown: ShownScene, view: CameraMessage | Probe, wanted: Pass
) -> tuple[PreparedScene, Camera, RenderSettings]:
    """The arguments of ``render`` for the view's camera and settings."""
    prepared = varied(shown.brute if view.mode == "brute" else shown.prepared, view.settings)
    full = wanted.last or wanted.band is not None
    settings = render_settings(shown.scene, view.settings, wanted.size, wanted.samples, full)
    return prepared, camera_of(view.m, view.fovy, height=view.height), settings


def _scaled(side: int, longest: int, of: int) -> int:
    return max(1, round(side * longest / of))


def _rgba(rgb: NDArray[np.uint8]) -> bytes:
    opaque = np.full((*rgb.shape[:2], 4), 255, np.uint8)
    opaque[..., :3] = rgb
    return opaque.tobytes()
