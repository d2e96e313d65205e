"""The rays of a camera as the picture's kernel reads them, tile by tile."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.scene.camera import Camera, sample_offsets
from renderer.shade.tile import CameraRays, Rectangle


def rays_of_tiles(camera: Camera, resolution: tuple[int, int], samples: int) -> Callable[[Rectangle], CameraRays]:
    """The function that gives the rays of a tile: of an affine camera the rows of its map, of others a list."""
    places = sample_offsets(samples)
    centre = samples // 2 if samples % 2 and not camera._has_lens(samples) else samples
    if centre == samples:
        places = np.concatenate([places, [[0.5, 0.5]]])
    rows = camera._rows_for(*resolution, samples)
    if rows is not None:
        shared = CameraRays(rows, places, samples, centre)
        return lambda tile: shared
    return lambda tile: CameraRays(_listed(camera, resolution, samples, places, tile), places, samples, centre)


def _listed(
    camera: Camera, resolution: tuple[int, int], samples: int, places: NDArray[np.float64], tile: Rectangle
) -> NDArray[np.float64]:
    """Origin and unit direction of each ray of a tile, (n, 6)."""
    listed = np.empty((len(places), tile.y1 - tile.y0, tile.x1 - tile.x0, 6))
    for number, (across, down) in enumerate(places):
        x, y = np.meshgrid(np.arange(tile.x0, tile.x1) + across, np.arange(tile.y0, tile.y1) + down)
        listed[number, ..., :3], listed[number, ..., 3:] = camera._sample_rays(x, y, *resolution, number, samples)
    return listed.reshape(-1, 6)
