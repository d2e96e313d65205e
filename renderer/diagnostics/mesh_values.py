"""Values on a mesh as colours: of a PLY file's faces, vertices or points, and of a picture with its legend."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer.diagnostics.false_color import shades_of
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.mesh.ply import by_name, format_columns
from renderer.picture.encoding import write_pixels
from renderer.picture.image import Image, write_array
from renderer.system.files import write_atomically

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]
# So many times finer than a picture is the image that it is drawn from, along each side.
FINER = 2
# What has no value.
_GREY = 128
# Of a legend: its share of the picture's height, its least and greatest height in pixels, and the height of a letter's
# share of it.
_SHARE, _LEAST, _MOST = 0.06, 28, 60


def scale_of(values: Floats) -> tuple[float, float]:
    """Least and greatest of the values that are numbers; (0, 0) without any."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)


def colors_of(values: Floats, scale: tuple[float, float]) -> Bytes:
    """(..., 3) sRGB colours: viridis from the scale's low end to its high one; grey where a value is NaN."""
    colors = np.full((*values.shape, 3), _GREY, np.uint8)
    known = np.isfinite(values)
    colors[known] = shades_of(values[known], *scale)
    return colors


def write_ply(path: Path, vertices: Floats, faces: NDArray[np.int32] | None, values: Floats, of_faces: bool) -> None:
    """A binary PLY whose vertices, or faces, have ``red``, ``green``, ``blue`` and the ``value`` itself as double.

    faces : None for a cloud of points.
    """
    colors = colors_of(values, scale_of(values))
    valued = {"value": values, **by_name(("red", "green", "blue"), colors)}
    points = by_name(("x", "y", "z"), vertices)
    content = format_columns(points, faces, valued) if of_faces else format_columns(points | valued, faces)
    write_atomically(path, lambda file: file.write(content))


def draw(image: Image, mesh: Mesh, values: Floats, title: str) -> Bytes:
    """A picture of the mesh (h, w, 3) from an image ``FINER`` times its size: each place in the colour of its face's
    value, walls darker, white where nothing is, and a pixel the mean of its places; below it a legend.
    """
    expect(len(values) == len(mesh.faces), "values", f"{len(mesh.faces)} values", str(len(values)))
    hit, scale = image.face >= 0, scale_of(values)
    canvas = np.full((*hit.shape, 3), 255, np.uint8)
    colors = colors_of(values, scale)[image.face[hit]].astype(np.float64)
    # By the normal's height: walls and ground of the same value are told apart, and the hue stays.
    light = 0.8 + 0.2 * np.abs(image.normal[hit][:, 2:3])
    canvas[hit] = (colors * light + 0.5).astype(np.uint8)
    tall, wide = canvas.shape[0] // FINER, canvas.shape[1] // FINER
    canvas = (canvas.reshape(tall, FINER, wide, FINER, 3).mean(axis=(1, 3)) + 0.5).astype(np.uint8)
    return np.concatenate([canvas, legend(canvas.shape[1], canvas.shape[0], scale, title)])


def legend(width: int, height: int, scale: tuple[float, float], title: str) -> Bytes:
    """A bar of colours with the scale's ends, its middle and a title, (h, width, 3), for a picture of some height."""
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    tall = int(np.clip(_SHARE * height, _LEAST, _MOST))
    bar = tall // 3
    strip = np.full((tall, width, 3), 255, np.uint8)
    strip[:bar] = (
        shades_of(np.linspace(*scale, width), *scale)
        if scale[1] > scale[0]
        else shades_of(np.full(width, scale[0]), *scale)
    )
    picture = Pillow.fromarray(strip)
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(size=0.42 * tall)
    middle = bar + (tall - bar) / 2
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
