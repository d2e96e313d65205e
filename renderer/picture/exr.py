"""OpenEXR files, by the package ``OpenEXR``, which only they need and the extra ``exr`` brings."""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from renderer.errors import extra_hint


def check_exr() -> None:
    """Raise ``ValueError`` where the package is absent."""
    try:
        import OpenEXR  # noqa: F401
    except ImportError:
        raise ValueError(
            f"output: expected the package OpenEXR for an .exr file, got none; {extra_hint('exr')}"
        ) from None


def exr_bytes(channels: Mapping[str, NDArray[Any]], beside: Path) -> bytes:
    """A scanline file, ZIP compressed without loss. ``channels`` are float32 (h, w), or (h, w, 3) under the name "RGB".

    The package writes to paths only: to a temporary folder of the system, or where that is full to one in ``beside``.
    Raises ``ValueError`` where the package is absent, ``OSError`` where there is no room.
    """
    check_exr()
    try:
        return _written(channels, None)
    except OSError:
        return _written(channels, beside)


def _written(channels: Mapping[str, NDArray[Any]], place: Path | None) -> bytes:
    """The bytes of a file that is written to a temporary folder in ``place``."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with tempfile.TemporaryDirectory(prefix="exr-", dir=place) as folder:
        path = Path(folder) / "picture.exr"
        try:
            OpenEXR.File(header, dict(channels)).write(str(path))
        except RuntimeError as error:  # the package's only kind
            raise OSError(str(error)) from None
        return path.read_bytes()
