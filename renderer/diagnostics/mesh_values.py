"""Values on a mesh as colours: of a PLY file's faces, vertices or points, and of a picture with its legend."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.mesh.colormaps import colors_of, scale_of, shades_of
from renderer.mesh.mesh import Mesh
from renderer.mesh.ply import by_name
from renderer.mesh.save import format_valued
from renderer.picture.encoding import write_pixels
from renderer.picture.image import Image, write_array
from renderer.system.files import write_atomically

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]
# So many times finer than a picture is the image that it is drawn from, along each side.
FINER = 2
# Of a legend: its share of the picture's height, its least and greatest height in pixels, and the height of a letter's
# share of it.
_SHARE, _LEAST, _MOST = 0.06, 28, 60


def write_ply(path: Path, vertices: Floats, faces: NDArray[np.int32] | None, values: Floats, of_faces: bool) -> None:
    """A binary PLY whose vertices, or faces, have ``red``, ``green``, ``blue`` and the ``value`` itself as double.

    faces : None for a cloud of points.
    """
    content = format_valued(by_name(("x", "y", "z"), vertices), faces, values, of_faces)
    write_atomically(path, lambda file: file.write(content))


def legend_rows(height: int) -> int:
    """The rows of the legend of a picture of this height; 0 where it would take more than half of them."""
    return int(np.clip(_SHARE * height, _LEAST, _MOST)) if height >= 2 * _LEAST else 0


def map_size(resolution: tuple[int, int]) -> tuple[int, int]:
    """Width and height of what is above the legend of a picture of this resolution."""
    width, height = resolution
    return width, height - legend_rows(height)


def draw(image: Image, mesh: Mesh, values: Floats, title: str, legend_rows: int, up: int = 2) -> Bytes:
    """A picture of the mesh (h, w, 3) with a legend below.

    image        ``FINER`` times as wide and high as what is above the legend
    legend_rows  0: no legend
    up           the axis that points up

    Each place has the colour of its face's value, walls are darker, and it is white where nothing is.
    """
    expect(len(values) == len(mesh.faces), "values", f"{len(mesh.faces)} values", str(len(values)))
    hit, scale = image.face >= 0, scale_of(values)
    canvas = np.full((*hit.shape, 3), 255, np.uint8)
    colors = colors_of(values, scale)[image.face[hit]].astype(np.float64)
    # By the normal's height: walls and ground of the same value are told apart, and the hue stays.
    light = 0.8 + 0.2 * np.abs(image.normal[hit][:, up, None])
    canvas[hit] = (colors * light + 0.5).astype(np.uint8)
    tall, wide = canvas.shape[0] // FINER, canvas.shape[1] // FINER
    canvas = (canvas.reshape(tall, FINER, wide, FINER, 3).mean(axis=(1, 3)) + 0.5).astype(np.uint8)
    return np.concatenate([canvas, legend(wide, legend_rows, scale, title)]) if legend_rows else canvas


def legend(width: int, rows: int, scale: tuple[float, float], title: str) -> Bytes:
    """A bar of colours with the scale's ends and a title, (rows, width, 3)."""
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    bar = rows // 3
    strip = np.full((rows, width, 3), 255, np.uint8)
    strip[:bar] = (
        shades_of(np.linspace(*scale, width), *scale)
        if scale[1] > scale[0]
        else shades_of(np.full(width, scale[0]), *scale)
    )
    picture = Pillow.fromarray(strip)
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(size=0.42 * rows)
    middle = bar + (rows - bar) / 2
    ends = [(4, "lm", f"{scale[0]:.4g}"), (width - 4, "rm", f"{scale[1]:.4g}"), (width / 2, "mm", title)]
    for x, anchor, text in ends:
        pen.text((x, middle), text, fill=(0, 0, 0), font=font, anchor=anchor)
    return np.array(picture)


def write_npy(path: Path, values: Floats) -> None:
    """Write an array."""
    write_atomically(path, lambda file: write_array(file, values))


def write_png(path: Path, picture: Bytes) -> None:
    """Write (h, w, 3) sRGB."""
    write_atomically(path, lambda file: write_pixels(file, picture))
