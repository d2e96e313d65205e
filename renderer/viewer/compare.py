"""The picture of a view computed in two ways, and their differences."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.diagnostics.false_color import Limits, shades_of
from renderer.errors import expect
from renderer.picture.prepare import tiles
from renderer.scene.scene import Scene
from renderer.trace.spawn import BOUNDED
from renderer.viewer.commands import lights_of
from renderer.viewer.protocol import CameraMessage, ViewSettings
from renderer.viewer.references import reference_picture
from renderer.viewer.shown import ShownScene, edited, render_settings, varied
from renderer.viewer.viewpoint import camera_of

# The two numbers of samples that are compared: few that show stairs at edges, and the most of a view.
FEW, MANY = 4, 64
# The grey of pixels that are the same to the bit, darker than all colours of the scale.
_SAME = 18


class Way(NamedTuple):
    """One way of computing a picture: its name, its samples per pixel, and "octree", "brute" or a reference's name."""

    name: str
    samples: int
    by: str = "octree"


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two pictures of one view: linear radiance (h, w, 3) float32, the seconds that each took, and for each the number
    of rays of each pixel, (h, w), or None where that is not known.
    """

    ways: tuple[Way, Way]
    pictures: tuple[NDArray[np.float32], NDArray[np.float32]]
    rays: tuple[NDArray[np.int32] | None, NDArray[np.int32] | None]
    seconds: tuple[float, float]

    @property
    def difference(self) -> NDArray[np.float64]:
        """The largest difference of a pixel's three values, (h, w)."""
        first, second = self.pictures
        return np.abs(first.astype(np.float64) - second).max(axis=2)

    @property
    def identical(self) -> NDArray[np.bool_]:
        """Whether the three values of a pixel have the same bits, (h, w)."""
        first, second = (picture.view(np.uint32) for picture in self.pictures)
        return (first == second).all(axis=2)

    @property
    def by_brute_force(self) -> bool:
        """Whether one of them is."""
        return any(way.by == "brute" for way in self.ways)

    def described(self) -> dict[str, Any]:
        """The page's message about it, without the view's numbers."""
        difference, identical = self.difference, self.identical
        y, x = np.unravel_index(np.argmax(difference), difference.shape)
        return {
            "names": [way.name for way in self.ways],
            "seconds": self.seconds,
            "pixels": identical.size,
            "identical": int(identical.sum()),
            "largest": float(difference[y, x]),
            "mean": float(difference.mean()),
            "at": [int(x), int(y)],
        }

    def values_at(self, x: int, y: int) -> list[dict[str, Any]]:
        """Name, radiance and number of rays of a pixel, both ways; rays are null where their number is not known."""
        return [
            {"name": way.name, "radiance": picture[y, x].tolist(), "rays": None if rays is None else int(rays[y, x])}
            for way, picture, rays in zip(self.ways, self.pictures, self.rays, strict=True)
        ]


def ways_of(view: CameraMessage) -> tuple[Way, Way]:
    """The two ways in the view's settings."""
    pair = view.settings.pair
    if pair == "samples":
        return Way(f"{FEW} samples", FEW), Way(f"{MANY} samples", MANY)
    if pair == "brute":
        return Way("octree", 1), Way("brute force", 1, "brute")
    return Way("octree", 1), Way(pair, 1, pair)


def compared(
    shown: ShownScene, view: CameraMessage, size: tuple[int, int], finished: Callable[[float], object]
) -> Comparison:
    """Both pictures of ``view`` with ``size`` (w, h). ``finished(share)`` is called as they grow."""
    ways = ways_of(view)
    all_samples = sum(way.samples for way in ways)
    pictures, rays, seconds = [], [], []
    for way in ways:
        began = time.perf_counter()
        share = way.samples / all_samples
        picture, counted = _computed(shown, view, way, size, _scaled(finished, share))
        pictures.append(picture)
        rays.append(counted)
        seconds.append(time.perf_counter() - began)
    return Comparison(ways, (pictures[0], pictures[1]), (rays[0], rays[1]), (seconds[0], seconds[1]))


def _scaled(finished: Callable[[float], object], share: float) -> Callable[[float], object]:
    return lambda done: finished(share * done)


def _computed(
    shown: ShownScene, view: CameraMessage, way: Way, size: tuple[int, int], finished: Callable[[float], object]
) -> tuple[NDArray[np.float32], NDArray[np.int32] | None]:
    """The picture of one way, and its rays if they are counted."""
    camera = camera_of(view.m, view.fovy, height=view.height)
    if way.by not in ("octree", "brute"):
        scene = _for_others(shown, view.settings).altered(camera=camera)
        return reference_picture(way.by, scene, size, view.settings.max_depth, finished), None
    prepared = varied(shown.brute if way.by == "brute" else shown.prepared, view.settings)
    settings = render_settings(shown.scene, view.settings, size, way.samples, last=True)
    image = prepared.picture(camera, settings, BOUNDED, shown.threads, _shares(size, finished), ("rays",))
    return image.radiance, image.rays


def _shares(size: tuple[int, int], finished: Callable[[float], object]) -> Callable[[int], object]:
    number = tiles(*size)
    return lambda done: finished(done / number)


def _for_others(shown: ShownScene, settings: ViewSettings) -> Scene:
    """The scene with settings that other renderers have too. Raises ``ValueError`` for other settings."""
    for switch in ("reflection", "refraction"):
        expect(getattr(settings, switch), "comparison", f"{switch} as the materials have it", "it switched off")
    render = shown.scene.render.model_copy(update={"shadows": settings.shadows})
    return edited(shown.scene, settings.edits).altered(lights=lights_of(shown, settings), render=render)


def heat_map(comparison: Comparison) -> tuple[NDArray[np.uint8], Limits]:
    """The differences of the pictures as colours, (h, w, 3) uint8, and the ends of their scale.

    The scale is logarithmic: a difference of one unit in the last place is to be seen beside a missing shadow. Pixels
    that are the same to the bit are dark grey; where all are, the ends are (0, 0).
    """
    difference = comparison.difference
    colors = np.full((*difference.shape, 3), _SAME, np.uint8)
    differing = ~comparison.identical & (difference > 0.0)
    if not differing.any():
        return colors, (0.0, 0.0)
    found = difference[differing]
    low, high = float(found.min()), float(found.max())
    colors[differing] = shades_of(np.log10(found), np.log10(low), np.log10(high))
    return colors, (low, high)
