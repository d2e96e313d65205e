"""A rendered picture: linear radiance with its AOVs, tone mapping, and files."""

import io
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.errors import expect


def srgb(linear: ArrayLike) -> NDArray[np.uint8]:
    """Linear radiance, clipped to [0, 1], as 8-bit sRGB (IEC 61966-2-1)."""
    x = np.clip(np.asarray(linear, np.float64), 0.0, 1.0)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1.0 / 2.4) - 0.055)
    return (encoded * 255.0 + 0.5).astype(np.uint8)


def write_atomically(path: str | Path, write: Callable[[BinaryIO], object]) -> None:
    """Let ``write`` fill a temporary file beside ``path``, then rename it: never a half-written file."""
    path = Path(path)
    handle, name = tempfile.mkstemp(prefix=".picture.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            write(file)
        # mkstemp makes the file private; give it the permissions that open() would have.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


@dataclass(frozen=True, eq=False)
class Image:
    """A picture of height h and width w; row 0 is the top.

    radiance  (h, w, 3) float32, linear
    depth     (h, w) float64, distance from the camera ray's origin; inf where nothing was hit
    normal    (h, w, 3) float32, unit shading normal of the surface; 0 where nothing was hit
    face      (h, w) int32, face of the merged mesh; -1 where nothing was hit
    rays      (h, w) int32, rays traced for the pixel, shadow rays included
    seconds   build and render time
    """

    radiance: NDArray[np.float32]
    depth: NDArray[np.float64]
    normal: NDArray[np.float32]
    face: NDArray[np.int32]
    rays: NDArray[np.int32]
    build_seconds: float
    render_seconds: float

    def save(self, path: str | Path) -> None:
        """Write ``.png`` (8-bit sRGB) or ``.npy`` (the linear radiance, float32), whole or not at all."""
        suffix = Path(path).suffix.lower()
        check_picture_path(path)
        if suffix == ".npy":
            write_atomically(path, lambda file: np.save(file, self.radiance))
        else:
            write_atomically(path, lambda file: file.write(self._repr_png_()))

    def _repr_png_(self) -> bytes:
        """The picture as PNG; notebooks show it."""
        from PIL import Image as Pillow  # not needed to trace rays, and slow to import

        expect(not np.isnan(self.radiance).any(), "radiance", "numbers that have a colour", "nan")
        buffer = io.BytesIO()
        Pillow.fromarray(srgb(self.radiance)).save(buffer, "png")
        return buffer.getvalue()


def check_picture_path(path: str | Path) -> None:
    """Raise ``ValueError`` unless ``save`` can write there; worth asking before a long render."""
    path = Path(path)
    expect(path.suffix.lower() in (".png", ".npy"), "output", "a .png or .npy file", repr(str(path)))
    expect(path.parent.is_dir(), "output", "a path in an existing folder", repr(str(path)))
    expect(not path.is_dir(), "output", "a file", f"the folder {str(path)!r}")
