"""Pixels of encoded images: OpenEXR by the package ``OpenEXR``, which only they need, all others by Pillow."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MeshError, extra_hint

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageFile import ImageFile

_EXR = b"\x76\x2f\x31\x01"
# Formats that textures have. Others of Pillow's start programs, as EPS does.
_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "TIFF", "GIF", "PPM", "DDS")
# Pillow's limit is a variable of its module.
_LIMIT = Lock()


def size_of(source: Path | bytes) -> tuple[int, int]:
    """Width and height of an encoded image by its header. Raises ``MeshError``."""
    with _faults_named():
        if _is_exr(source):
            with _exr(source, header_only=True) as file:
                low, high = file.header()["dataWindow"]
            return int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1
        with _opened(source) as image:
            return image.size


def pixels_of(source: Path | bytes) -> NDArray[Any]:
    """The pixels of an encoded image, (h, w) or (h, w, channels), uint8, uint16 or float32. Raises ``MeshError``.

    Palettes, transparent colours and CMYK become RGB or RGBA. The profile of colours and the orientation that a camera
    noted are ignored, as glTF asks. 16 bits a channel are kept, but for grey with alpha.
    """
    with _faults_named():
        if _is_exr(source):
            return _exr_pixels(source)
        with _opened(source) as image:
            raw = image.tile[0][3] if image.format == "PNG" and image.tile else None
            if raw not in ("RGB;16B", "RGBA;16B"):
                return _plain(image)
            high = np.asarray(image).astype(np.uint16)
        with _opened(source) as image:
            # Pillow keeps one byte of two: read as little-endian, the lower one of what is big-endian.
            name, extents, offset, _ = image.tile[0]
            image.tile = [(name, extents, offset, f"{raw[:-1]}L")]  # type: ignore[list-item]
            return high << 8 | np.asarray(image)


@contextmanager
def _faults_named() -> Iterator[None]:
    try:
        yield
    except MeshError:
        raise
    except FileNotFoundError as error:
        raise MeshError(f"cannot be read: {error.strerror}") from error
    except Exception as error:  # each of Pillow's readers raises its own
        fault = " ".join(str(getattr(error, "strerror", None) or error).split())[:120]
        raise MeshError(f"cannot be read as an image: {fault}") from error


@contextmanager
def _opened(source: Path | bytes) -> Iterator[ImageFile]:
    # Imported here, because few meshes have textures.
    from PIL import Image, UnidentifiedImageError

    with _LIMIT:
        # Pillow refuses images beyond a size of its own; ``TextureImage`` has the limit that counts here.
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            image = Image.open(source if isinstance(source, Path) else BytesIO(source), formats=_FORMATS)
        except UnidentifiedImageError:
            raise MeshError("cannot be read as an image: of no known format") from None
        finally:
            Image.MAX_IMAGE_PIXELS = limit
    with image:
        yield image


def _plain(image: Image) -> NDArray[Any]:
    """The pixels of an image of any of Pillow's modes."""
    if image.mode in ("P", "PA", "1", "L", "RGB") and image.has_transparency_data:
        image = image.convert("RGBA")
    elif image.mode == "1":
        image = image.convert("L")
    elif image.mode in ("La", "RGBa"):  # premultiplied
        image = image.convert(image.mode.upper())
    elif image.mode not in ("L", "LA", "RGB", "RGBA", "F") and not image.mode.startswith("I"):
        image = image.convert("RGB")
    found: NDArray[Any] = np.asarray(image)
    if found.dtype.kind in "iu" and found.dtype != np.uint8:
        if found.size and (found.min() < 0 or found.max() > 65535):
            raise MeshError("expected 8 or 16 bits a channel or floats, got integers of 32 bits")
        found = found.astype(np.uint16)
    return found


# --- OpenEXR ------------------------------------------------------------------------------------------------


def _is_exr(source: Path | bytes) -> bool:
    if isinstance(source, bytes):
        return source[:4] == _EXR
    if source.exists() and not source.is_file():
        raise MeshError("cannot be read: expected a file")
    with open(source, "rb") as file:
        return file.read(4) == _EXR


@contextmanager
def _exr(source: Path | bytes, **options: bool) -> Iterator[Any]:
    """An open file of the package, which reads from paths only."""
    try:
        import OpenEXR
    except ImportError:
        raise MeshError(f"expected the package OpenEXR for an .exr file, got none; {extra_hint('exr')}") from None
    if isinstance(source, Path):
        with OpenEXR.File(str(source), **options) as file:
            yield file
        return
    with tempfile.TemporaryDirectory(prefix="exr-") as folder:
        path = Path(folder) / "image.exr"
        path.write_bytes(source)
        with OpenEXR.File(str(path), **options) as file:
            yield file


def _exr_pixels(source: Path | bytes) -> NDArray[np.float32]:
    """The colours of the first part, or its luminance, as float32."""
    with _exr(source) as file:
        channels = file.channels()
        for name in ("RGBA", "RGB", "YA", "Y"):
            if name in channels:
                return np.array(channels[name].pixels, np.float32)
    raise MeshError(f"expected channels R, G and B or Y, got {', '.join(channels) or 'none'}")
