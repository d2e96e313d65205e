"""Pixels as files of images, by Pillow."""

import io
from typing import Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

Format = Literal["png", "jpeg"]


def write_pixels(file: BinaryIO, pixels: NDArray[np.uint8], format: Format = "png", **options: Any) -> None:
    """Write sRGB pixels (h, w, 3); ``options`` are Pillow's for the format."""
    from PIL import Image as Pillow  # not needed to trace rays, and slow to import

    Pillow.fromarray(pixels).save(file, format, **options)


def encoded(pixels: NDArray[np.uint8], format: Format = "png", **options: Any) -> bytes:
    """The bytes that ``write_pixels`` writes."""
    buffer = io.BytesIO()
    write_pixels(buffer, pixels, format, **options)
    return buffer.getvalue()
