"""A rendered picture: linear radiance with its AOVs, tone mapping, and files."""

import io
import os
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.errors import expect
from renderer.exr import check_exr, exr_bytes


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
        """Write ``.png`` (8-bit sRGB), ``.exr`` or ``.npy`` (the linear radiance, float32), whole or not at all.

        An EXR file also has the depth as Z and the normal as normal.X, normal.Y and normal.Z, float32. It needs the
        package OpenEXR.
        """
        suffix = Path(path).suffix.lower()
        check_picture_path(path)
        if suffix == ".npy":
            write_atomically(path, lambda file: np.save(file, self.radiance))
        elif suffix == ".exr":
            normal = {f"normal.{axis}": self.normal[..., i].copy() for i, axis in enumerate("XYZ")}
            with np.errstate(over="ignore"):  # a depth beyond float32 becomes inf, as a miss is
                write_exr(path, self.radiance, {"Z": self.depth.astype(np.float32), **normal})
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
    expect(path.suffix.lower() in (".png", ".exr", ".npy"), "output", "a .png, .exr or .npy file", repr(str(path)))
    expect(path.parent.is_dir(), "output", "a path in an existing folder", repr(str(path)))
    expect(not path.is_dir(), "output", "a file", f"the folder {str(path)!r}")
    if path.suffix.lower() == ".exr":
        check_exr()


def write_exr(path: str | Path, radiance: ArrayLike, layers: Mapping[str, NDArray[np.float32]] | None = None) -> None:
    """Write linear ``radiance`` (h, w, 3) as R, G and B, and further ``layers`` (h, w), as float32 without loss.

    Whole or not at all. Raises ``ValueError`` where the package OpenEXR is absent.
    """
    channels = {"RGB": np.ascontiguousarray(radiance, np.float32), **(layers or {})}
    content = exr_bytes(channels)
    write_atomically(path, lambda file: file.write(content))
