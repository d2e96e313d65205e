"""Files of compared pictures: those that the report shows, and those of a failing gate."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer.picture.encoding import write_pixels
from renderer.picture.image import srgb, write_exr
from renderer.system.files import write_atomically
from validation.pictures.compare import ImageComparison, Picture

# This makes one step of an 8-bit picture a visible grey.
_ENLARGED = 16.0


def write_shown(folder: Path, stem: str, ours: Picture, reference: Picture, result: ImageComparison) -> dict[str, str]:
    """Write ours, the reference, 16 times the difference and FLIP's map as PNGs; returns their names in ``folder``."""
    pictures = {
        "ours": srgb(ours),
        "reference": srgb(reference),
        "difference": _grey(_ENLARGED * result.difference),
        "flip": _grey(result.flip_map),
    }
    files = {kind: f"{stem}-{kind}.png" for kind in pictures}
    for kind, pixels in pictures.items():
        write_png(folder / files[kind], pixels)
    return files


def write_failed(folder: Path, stem: str, ours: Picture, reference: Picture, result: ImageComparison) -> list[str]:
    """Write the same PNGs and, without loss, ours, the reference and ours - reference as EXR, all in ``folder``/failed.

    Returns the names in ``folder``.
    """
    failed = folder / "failed"
    failed.mkdir(exist_ok=True)
    names = list(write_shown(failed, stem, ours, reference, result).values())
    difference = np.subtract(ours, reference, dtype=np.float64)
    for kind, radiance in {"ours": ours, "reference": reference, "difference": difference}.items():
        names.append(f"{stem}-{kind}.exr")
        write_exr(failed / names[-1], radiance)
    return [f"failed/{name}" for name in names]


def write_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write 8-bit pixels, (h, w, 3) or grey (h, w), whole or not at all."""
    write_atomically(path, lambda file: write_pixels(file, pixels, optimize=True))


def _grey(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    return (np.clip(values, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
