"""The rays of a camera as the picture's kernel reads them, tile by tile."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.scene.camera import Camera
from renderer.scene.filters import film_samples
from renderer.shade.bundle import SIDE
from renderer.shade.tile import CameraRays, Rectangle

# The side of a tile in pixels: 256 tiles share a 512 x 512 picture, and neighbouring rays find their nodes in the
# cache.
TILE = 32
# The most samples for which the rays of such a tile are listed: 13 MB.
_LISTED_SAMPLES = 256


def tile_side(camera: Camera, resolution: tuple[int, int], samples: int) -> int:
    """The side of a picture's tiles: that of a block where the rays of a larger tile would take much memory."""
    few = samples <= _LISTED_SAMPLES or camera._rows_for(*resolution, samples) is not None
    return TILE if few else SIDE


def rays_of_tiles(
    camera: Camera, resolution: tuple[int, int], samples: int, filter: str = "box"
) -> Callable[[Rectangle], CameraRays]:
    """The function that gives the rays of a tile: of an affine camera the rows of its map, of others a list."""
    places, weights = film_samples(filter, samples)
    centre = samples // 2 if samples % 2 and not camera._has_lens(samples) else samples
    if centre == samples:
        places = np.concatenate([places, [[0.5, 0.5]]])
    rows = camera._rows_for(*resolution, samples)
    if rows is not None:
        shared = CameraRays(rows, places, weights, samples, centre)
        return lambda tile: shared
    return lambda tile: CameraRays(_listed(camera, resolution, samples, places, tile), places, weights, samples, centre)


def _listed(
    camera: Camera, resolution: tuple[int, int], samples: int, places: NDArray[np.float64], tile: Rectangle
) -> NDArray[np.float64]:
    """Origin and unit direction of each ray of a tile, (n, 6)."""
    columns, rows = np.arange(tile.x0, tile.x1), np.arange(tile.y0, tile.y1)
    listed = np.empty((len(places), len(rows), len(columns), 6))
    for number, (across, down) in enumerate(places):
        x, y = np.meshgrid(columns + across, rows + down)
        listed[number, ..., :3], listed[number, ..., 3:] = camera._sample_rays(x, y, *resolution, number, samples)
    return listed.reshape(-1, 6)
