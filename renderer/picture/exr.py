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


def exr_bytes(channels: Mapping[str, NDArray[Any]]) -> bytes:
    """A scanline file, ZIP compressed without loss. ``channels`` are float32 (h, w), or (h, w, 3) under the name "RGB".

    Raises ``ValueError`` where the package is absent.
    """
    check_exr()
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    # The package writes to paths only.
    with tempfile.TemporaryDirectory(prefix="exr-") as folder:
        path = Path(folder) / "picture.exr"
        OpenEXR.File(header, dict(channels)).write(str(path))
        return path.read_bytes()
