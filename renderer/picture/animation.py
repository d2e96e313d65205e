"""Animations as files, which repeat for ever: GIF and WebP by Pillow, MP4 by the package ``imageio-ffmpeg``, which the
extra ``mp4`` brings.
"""

import os
import tempfile
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from renderer.errors import extra_hint
from renderer.picture.image import check_output_path

if TYPE_CHECKING:  # not needed before a file is made
    from PIL.Image import Image as Pillow

Format = Literal["gif", "webp", "mp4"]
# Milliseconds of a whole turn, and the least of a frame: browsers show GIF frames of less than 20 for 100.
_TURN, _SHORTEST = 4000, 20
# The colours of high-definition video, which players expect of untagged files too.
_COLORS = ("-vf", "scale=out_color_matrix=bt709", "-colorspace", "bt709", "-color_primaries", "bt709",
           "-color_trc", "iec61966-2-1")  # fmt: skip


def check_animation_path(path: str | os.PathLike[str]) -> Format:
    """The format of an animation. Raises ``ValueError`` or ``OSError`` unless it can be written there."""
    format: Any = check_output_path(path, (".gif", ".webp", ".mp4")).suffix.lower()[1:]
    if format == "mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError:
            fault = "output: expected the package imageio-ffmpeg for an .mp4 file, got none; write a .gif or .webp, or"
            raise ValueError(f"{fault} {extra_hint('mp4')}") from None
    return format


def write_animation(file: BinaryIO, frames: Iterator[NDArray[np.uint8]], count: int, format: Format) -> None:
    """Write ``count`` frames of sRGB pixels (h, w, 3), which take four seconds together, or 20 ms each.

    A frame is made when it is its turn. WebP is without loss, GIF has 256 colours a frame, MP4 is H.264.
    """
    duration = max(_SHORTEST, round(_TURN / count / 10) * 10)  # GIF counts in hundredths of a second
    if format == "mp4":
        file.write(_mp4(frames, 1000.0 / duration))
        return
    images = (_image(frame, format) for frame in frames)
    lossless = {"lossless": True} if format == "webp" else {}
    first, rest = next(images), _Sequence(images, count - 1)
    first.save(file, format, save_all=True, append_images=[rest], duration=duration, loop=0, **lossless)


def _image(pixels: NDArray[np.uint8], format: Format) -> "Pillow":
    from PIL import Image as Pillow

    image = Pillow.fromarray(pixels)
    return image.quantize() if format == "gif" else image


class _Sequence:
    """Frames as one image of several, for Pillow, each made when it is sought: WebP takes all images first, which were
    four bytes a pixel.
    """

    def __init__(self, frames: "Iterator[Pillow]", number: int) -> None:
        self.n_frames = number
        self._frames = frames
        self._frame: Pillow | None = None

    def seek(self, _: int) -> None:
        """Take the next frame, in whose order they are sought."""
        self._frame = next(self._frames)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._frame, name)


def _mp4(frames: Iterator[NDArray[np.uint8]], per_second: float) -> bytes:
    """The content of an MP4 file. The package writes to paths only."""
    import imageio_ffmpeg

    with tempfile.TemporaryDirectory(prefix="mp4-") as folder:
        path, first = Path(folder) / "turn.mp4", next(frames)
        size = first.shape[1], first.shape[0]
        writer = imageio_ffmpeg.write_frames(
            str(path), size, fps=per_second, macro_block_size=1, output_params=[*_COLORS]
        )
        try:
            writer.send(None)
            for frame in chain([first], frames):
                writer.send(frame)
        finally:
            writer.close()
        return path.read_bytes()
