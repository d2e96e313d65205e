"""Images that textures show: a file, the bytes of one, or an array."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import read_only, real_array
from renderer.arguments.types import ArrayLike
from renderer.errors import MeshError
from renderer.lazy import lazy
from renderer.mesh.decoding import pixels_of, size_of
from renderer.system.files import as_path

# 16384 x 16384, the largest side that graphics cards promise; in RGBA of 8 bits it takes 1 GiB.
MAX_TEXELS = 1 << 28


@dataclass(frozen=True, eq=False)
class TextureImage:
    """An image of a texture, decoded when its pixels are first read.

    Two images are equal if they have one name and one source: a path, equal bytes, or the same array.

    Parameters
    ----------
    source : path, bytes or array_like
        A PNG, JPEG, WebP, BMP, TGA, TIFF, GIF, PPM, DDS or OpenEXR file, which needs the extra ``exr``; the bytes of
        one; or an array (h, w) or (h, w, 1 to 4) of uint8, uint16 or finite floats. Arrays are copied.
    name : str, optional
        Begins error messages; by default the path.

    Raises
    ------
    MeshError
        For another source. Files are read later.

    Examples
    --------
    >>> from renderer import TextureImage
    >>> checker = TextureImage([[0.0, 1.0], [1.0, 0.0]])
    >>> checker.size, checker.pixels.shape, checker.pixels.dtype
    ((2, 2), (2, 2, 1), dtype('float32'))
    """

    source: Path | bytes | NDArray[Any]
    name: str = ""

    def __init__(self, source: str | os.PathLike[str] | bytes | ArrayLike, name: str = "") -> None:
        if not isinstance(name, str):
            raise MeshError(f"name: expected a string, got {type(name).__name__}")
        kept: Any = source
        if isinstance(source, str | os.PathLike):
            try:
                kept = as_path("source", source)
            except ValueError as error:
                raise MeshError(str(error)) from None
        elif isinstance(source, bytearray | memoryview):
            kept = bytes(source)
        object.__setattr__(self, "name", name or (str(kept) if isinstance(kept, Path) else ""))
        if not isinstance(kept, Path | bytes):
            kept = self._checked(self._given(kept))
        object.__setattr__(self, "source", kept)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles have the source, which is decoded anew."""
        return TextureImage, (self.source, self.name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TextureImage) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def _key(self) -> tuple[str, Path | bytes | int]:
        return self.name, self.source if isinstance(self.source, Path | bytes) else id(self.source)

    def __repr__(self) -> str:
        shown = self.name or ("bytes" if isinstance(self.source, bytes) else "array")
        return f"TextureImage({shown!r})"

    @lazy
    def size(self) -> tuple[int, int]:
        """Width and height, by the header of a file.

        Raises ``MeshError``, which names the image, if it cannot be read, is empty, or has more than 2^28 pixels.

        Examples
        --------
        >>> import numpy as np
        >>> from renderer import TextureImage
        >>> TextureImage(np.zeros((2, 3, 4), np.uint8)).size
        (3, 2)
        """
        if isinstance(self.source, np.ndarray):
            height, width = self.source.shape[:2]
            return width, height
        try:
            width, height = size_of(self.source)
        except MeshError as error:
            raise self._error(str(error)) from error
        self._expect_size(width, height)
        return width, height

    @lazy
    def pixels(self) -> NDArray[Any]:
        """The pixels, (h, w, channels), read-only: uint8, uint16 or float32, as the file or array has them.

        The first row is the upper one, where v is 1. Channels are grey, grey and alpha, RGB or RGBA. Raises
        ``MeshError`` as ``size`` does.

        Examples
        --------
        >>> from renderer import TextureImage
        >>> TextureImage([[[0.25, 0.5, 1.0]]]).pixels.tolist()
        [[[0.25, 0.5, 1.0]]]
        """
        if isinstance(self.source, np.ndarray):
            return self.source
        self.size  # noqa: B018  # refuses what is too large before it is decoded
        try:
            return self._checked(pixels_of(self.source))
        except MeshError as error:
            raise self._error(str(error)) from error

    def _error(self, message: str) -> MeshError:
        begin = self.name or "image"
        return MeshError(message if message.startswith(f"{begin}: ") else f"{begin}: {message}")

    def _given(self, values: Any) -> NDArray[Any]:
        try:
            return real_array(values)
        except ValueError as error:
            raise self._error(str(error)) from None

    def _expect_size(self, width: int, height: int) -> None:
        if not 0 < width * height <= MAX_TEXELS:
            raise self._error(f"expected 1 to {MAX_TEXELS} pixels (16384 x 16384), got {width} x {height}")

    def _checked(self, array: NDArray[Any]) -> NDArray[Any]:
        """A read-only copy (h, w, channels) of what has the shape and values of an image."""
        if array.ndim not in (2, 3) or (array.ndim == 3 and not 1 <= array.shape[2] <= 4):
            raise self._error(f"expected shape (h, w) or (h, w, 1 to 4), got {array.shape}")
        self._expect_size(array.shape[1], array.shape[0])
        if array.dtype.kind != "f" and array.dtype not in (np.uint8, np.uint16):
            raise self._error(f"expected uint8, uint16 or floats, got {array.dtype}")
        with np.errstate(over="ignore", invalid="ignore"):  # what float32 cannot hold is refused below
            kept = np.array(array, np.float32 if array.dtype.kind == "f" else array.dtype, order="C")
        if kept.dtype.kind == "f" and not np.isfinite(kept).all():
            row, column = np.argwhere(~np.isfinite(kept))[0][:2].tolist()
            raise self._error(f"expected finite values, got {kept[row, column].tolist()} in row {row}, column {column}")
        return read_only(kept.reshape(*kept.shape[:2], -1))


def value_of_one(pixels: NDArray[Any]) -> float:
    """The value of pixels that stands for 1: the largest of integers, 1 of floats."""
    return 1.0 if pixels.dtype.kind == "f" else float(np.iinfo(pixels.dtype).max)
