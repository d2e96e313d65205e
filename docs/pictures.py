"""Draw the README's pictures of three jobs: ``python docs/pictures.py``; needs Matplotlib."""

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray
from PIL import Image

from renderer import Octree, PerspectiveCamera, load_mesh
from renderer.studies import depth_map

ROOT = Path(__file__).resolve().parents[1]
WIDTH, HEIGHT = 480, 382  # in the proportion of scenes/quarter.webp


def depth() -> NDArray[np.uint8]:
    """A teapot's distances from a camera: the nearest yellow, nothing white."""
    octree = Octree.from_mesh(load_mesh(ROOT / "scenes" / "models" / "teapot.ply"))
    camera = PerspectiveCamera(eye=(2.0, 3.5, 6.0), target=(0.1, 0.7, 0.0), fov=16.0)
    found = depth_map(octree, camera, 2 * WIDTH, 2 * HEIGHT)
    hit = np.isfinite(found)
    near, far = found[hit].min(), found[hit].max()
    return _small(np.where(hit[..., None], _colours("viridis", (far - found) / (far - near)), 1.0))


def distance() -> NDArray[np.uint8]:
    """Signed distances in a plane through a knot: blue outside, red inside, black the surface."""
    octree = Octree.from_mesh(load_mesh(ROOT / "scenes" / "models" / "torus_knot.ply"))
    low, high = octree.mesh.vertices.min(axis=0), octree.mesh.vertices.max(axis=0)
    middle, step = (low + high) / 2, 1.25 * (high - low)[1] / (2 * HEIGHT)
    x = middle[0] + step * (np.arange(2 * WIDTH) - WIDTH)
    y = middle[1] - step * (np.arange(2 * HEIGHT) - HEIGHT)
    found = octree.signed_distance(np.stack(np.broadcast_arrays(x, y[:, None], middle[2]), axis=-1))
    drawn = _colours("RdBu", found + 0.5)
    return _small(np.where(np.abs(found)[..., None] < step, 0.1, drawn))


def sun() -> NDArray[np.uint8]:
    """Hours of sun in a city: the picture of ``scenes/make_quarter.py``, smaller."""
    with Image.open(ROOT / "scenes" / "quarter.webp") as picture:
        return np.asarray(picture.convert("RGB").resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS))


def _colours(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(colormaps[name](np.clip(values, 0.0, 1.0)))[..., :3]


def _small(colours: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The means of four pixels each."""
    means = colours.reshape(HEIGHT, 2, WIDTH, 2, 3).mean(axis=(1, 3))
    return np.round(255.0 * means).astype(np.uint8)


if __name__ == "__main__":
    for picture in (depth, sun, distance):
        path = ROOT / "docs" / "drawings" / f"{picture.__name__}.webp"
        Image.fromarray(picture()).save(path, quality=80, method=6)
