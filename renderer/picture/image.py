"""A rendered picture: linear radiance, depths, normals and faces; sRGB, and files."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from numbers import Real
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.picture.encoding import write_pixels
from renderer.picture.exposure import MAX_STOPS, exposed
from renderer.picture.exr import check_exr, exr_bytes
from renderer.picture.tone import TONES, ToneName, toned
from renderer.system.files import as_path, check_writable, write_atomically

# The arrays of an ``Image``; radiance is always there.
PLANES = ("radiance", "depth", "normal", "face", "rays")
# Rows encoded together, so that a large picture is not held twice over.
_ROWS = 64


def srgb(linear: ArrayLike) -> NDArray[np.uint8]:
    """8-bit sRGB codes (IEC 61966-2-1) of linear radiance, which is clipped to [0, 1].

    Parameters
    ----------
    linear : array_like
        Real numbers in any shape.

    Returns
    -------
    ndarray of the same shape, uint8

    Raises
    ------
    ValueError
        For anything else than real numbers.

    Examples
    --------
    >>> from renderer import srgb
    >>> srgb([0.0, 0.2, 0.5, 1.0, 7.0])
    array([  0, 124, 188, 255, 255], dtype=uint8)
    """
    x = real_argument("linear", linear)
    if x.dtype != np.float32:
        return _encoded(x)
    # The same codes without a power for each value: a fifth of the time.
    first, steps = _table()
    code = first.take(x.view(np.uint32) >> 16)
    return code + (x >= steps.take(code))


def srgb_of_linear(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values from 0 to 1 of linear values from 0 to 1, not rounded to codes."""
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1.0 / 2.4) - 0.055)


def _encoded(linear: ArrayLike) -> NDArray[np.uint8]:
    encoded = srgb_of_linear(np.clip(np.asarray(linear, np.float64), 0.0, 1.0))
    # rule: rounded-encoding
    return (encoded * 255.0 + 0.5).astype(np.uint8)


@cache
def srgb_steps() -> NDArray[np.float64]:
    """The least radiance of each of the codes 1 to 255, (255,): the first float64 that ``srgb`` encodes so."""
    low, high = np.zeros(255), np.ones(255)
    codes = np.arange(1, 256)
    # Halving the interval of bit patterns, which sort as the numbers do: 62 bits from 0 to 1.
    for _ in range(62):
        middle = ((low.view(np.int64) + high.view(np.int64)) // 2).view(np.float64)
        reached = _encoded(middle) >= codes
        low, high = np.where(reached, low, middle), np.where(reached, middle, high)
    return high


@cache
def _table() -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """The code of the float32 with each upper half and a lower half of zeros, (65536,); and the least float32 of the
    code after each, (256,), NaN for the last.

    float32 numbers of one upper half span no two steps: they are within 0.8 %, and steps are 0.9 % apart at 1, more
    below.
    """
    zeros = (np.arange(1 << 16, dtype=np.uint32) << 16).view(np.float32)
    exact = srgb_steps()
    steps = exact.astype(np.float32)
    steps = np.where(steps < exact, np.nextafter(steps, np.float32(np.inf)), steps)
    return _encoded(np.nan_to_num(zeros, nan=0.0)), np.append(steps, np.float32(np.nan))


class CutWarning(UserWarning):
    """The warning that pixels miss rays because of ``max_rays``; the message says how many.

    Examples
    --------
    >>> import warnings
    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, render
    >>> from renderer.mesh.shapes import icosphere
    >>> ball = SceneObject(mesh=icosphere(3), material="grey", normals="smooth")
    >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
    >>> scene = Scene(camera=eye, materials={"grey": Phong(reflectance=0.5, transmittance=0.5)}, objects=[ball])
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     image = render(scene, resolution=(3, 3), max_rays=1)
    >>> image.cut, [warning.category.__name__ for warning in caught]
    (1, ['CutWarning'])
    """


@dataclass(frozen=True, eq=False)
class Image:
    """A picture. Row 0 is the top. ``render`` makes it, and notebooks show it.

    Attributes
    ----------
    radiance : ndarray, shape (height, width, 3), float32
        Linear radiance, the mean of a pixel's samples by the weights of the filter.
    depth : ndarray, shape (height, width), float64
        The distance from the origin of the camera ray; inf for a miss.
    normal : ndarray, shape (height, width, 3), float32
        The unit shading normal; 0 for a miss.
    face : ndarray, shape (height, width), int32
        The face, numbered through all meshes of the scene; -1 for a miss.
    rays : ndarray, shape (height, width), int32
        The number of rays that were traced for the pixel, with shadow rays.
    build_seconds, render_seconds : float
        The time to prepare the scene and to render, without compilation.
    cut : int
        The number of pixels that miss rays because of ``max_rays``, 0 in most pictures.

    Notes
    -----
    Depth, normal and face are those of the ray through the centre of the pixel. Where no sample lies there, as with 4
    or 16 samples, ``rays`` does not count this ray. Arrays that the argument ``planes`` of ``render`` leaves out have
    height and width 0.

    Examples
    --------
    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, render
    >>> from renderer.mesh.shapes import icosphere
    >>> ball = SceneObject(mesh=icosphere(3), material="grey", normals="smooth")
    >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
    >>> scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball], ambient=1, background=(0.2, 0.4, 1))
    >>> image = render(scene, resolution=(3, 3))
    >>> image.depth[1], image.rays[1]
    (array([inf,  4., inf]), array([1, 1, 1], dtype=int32))
    """

    radiance: NDArray[np.float32]
    depth: NDArray[np.float64]
    normal: NDArray[np.float32]
    face: NDArray[np.int32]
    rays: NDArray[np.int32]
    build_seconds: float
    render_seconds: float
    cut: int = 0

    def __repr__(self) -> str:
        height, width = self.radiance.shape[:2]
        return f"<Image of {width} x {height} pixels>"

    def cut_message(self, max_rays: int) -> str:
        """The message of ``CutWarning`` for this picture.

        Examples
        --------
        >>> from renderer import PerspectiveCamera, Scene, render
        >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        >>> sky = render(Scene(camera=eye, materials={}, background=(0.2, 0.4, 1)), resolution=(2, 2))
        >>> sky.cut_message(max_rays=8)[:24]
        '0 of 4 pixels miss rays:'
        """
        return (
            f"{self.cut:,} of {self.radiance.size // 3:,} pixels miss rays: a sample reached max_rays = {max_rays:,}. "
            "Raise max_rays to trace all rays, or set min_weight, such as 0.001, to end those that hardly show"
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture to a file, whole or not at all.

        Parameters
        ----------
        path : path
            The suffix is the format. ``.png``: 8-bit sRGB. ``.npy``: linear radiance, float32. ``.exr``, which needs
            the package OpenEXR: linear radiance, the depth as Z and the normal as normal.X, normal.Y and normal.Z, all
            float32.

        Raises
        ------
        ValueError
            For another suffix, a folder that is not there, or NaN in a PNG.
        OSError
            Where the file cannot be written.

        Examples
        --------
        >>> from tempfile import TemporaryDirectory
        >>> import numpy as np
        >>> from renderer import PerspectiveCamera, Scene, render
        >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        >>> sky = render(Scene(camera=eye, materials={}, background=(0.2, 0.4, 1)), resolution=(2, 2))
        >>> with TemporaryDirectory() as folder:
        ...     sky.save(f"{folder}/sky.npy")
        ...     np.load(f"{folder}/sky.npy")[0, 0]
        array([0.2, 0.4, 1. ], dtype=float32)
        """
        suffix = as_path("path", path).suffix.lower()
        check_picture_path(path)
        if suffix == ".npy":
            write_atomically(path, lambda file: write_array(file, self.radiance))
        elif suffix == ".exr":
            write_exr(path, self.radiance, self._layers())
        else:
            write_atomically(path, self._write_png)

    def _layers(self) -> dict[str, NDArray[np.float32]]:
        """Depth and normal as an EXR file has them, where they were kept."""
        normal = {f"normal.{axis}": self.normal[..., i].copy() for i, axis in enumerate("XYZ")}
        with np.errstate(over="ignore"):  # a depth beyond float32 becomes inf, as a miss is
            layers = {"Z": self.depth.astype(np.float32), **normal}
        return {name: layer for name, layer in layers.items() if layer.size}

    @property
    def srgb(self) -> NDArray[np.uint8]:
        """The picture in 8-bit sRGB, as in a PNG file: ndarray, shape (height, width, 3), uint8.

        Examples
        --------
        >>> from renderer import PerspectiveCamera, Scene, render
        >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        >>> sky = render(Scene(camera=eye, materials={}, background=(0.2, 0.4, 1)), resolution=(2, 2))
        >>> sky.srgb[0, 0]
        array([124, 170, 255], dtype=uint8)
        """
        codes = np.empty(self.radiance.shape, np.uint8)
        for begin in range(0, len(codes), _ROWS):
            codes[begin : begin + _ROWS] = srgb(self.radiance[begin : begin + _ROWS])
        return codes

    def toned(self, tone: ToneName = "srgb", *, exposure: float = 0.0) -> Image:
        """The picture as a screen is to show it: brighter or darker, and with a tone curve for what is too bright.

        Parameters
        ----------
        tone : {"srgb", "reinhard", "aces"}, default "srgb"
            "srgb": none, so that a PNG clips what is brighter than 1. "reinhard": colours divided by 1 + their
            luminance 0.2126 R + 0.7152 G + 0.0722 B, so that hues stay; single channels may still exceed 1. "aces":
            Narkowicz's fit of the curve of ACES, x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14) for each channel, at
            most 1.
        exposure : float, default 0
            Stops, from -100 to 100: radiance is multiplied by 2 to their power before the curve.

        Returns
        -------
        Image
            Its radiance is linear, for ``srgb``, PNG files and notebooks. All else is the same.

        Raises
        ------
        ValueError
            For another tone or exposure.

        References
        ----------
        Reinhard, Stark, Shirley and Ferwerda, Photographic tone reproduction for digital images, 2002. Narkowicz, ACES
        filmic tone mapping curve, 2016.

        Examples
        --------
        >>> from renderer import PerspectiveCamera, Scene, render
        >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        >>> sky = render(Scene(camera=eye, materials={}, background=(0.5, 2, 8)), resolution=1)
        >>> [sky.toned(tone).srgb[0, 0].tolist() for tone in ("srgb", "reinhard", "aces")]
        [[188, 255, 255], [112, 210, 255], [206, 245, 255]]
        >>> sky.toned("aces", exposure=-3).srgb[0, 0].tolist()
        [71, 165, 232]
        """
        expect(isinstance(tone, str) and tone in TONES, "tone", f"one of {', '.join(TONES)}", repr(tone))
        number = isinstance(exposure, Real) and abs(exposure) <= MAX_STOPS
        expect(number, "exposure", f"a number from {-MAX_STOPS:g} to {MAX_STOPS:g}", repr(exposure))
        radiance = exposed(self.radiance, float(exposure))
        if tone != "srgb":
            rows = range(0, len(radiance), _ROWS)
            radiance = np.concatenate([toned(radiance[begin : begin + _ROWS], tone) for begin in rows])
        return replace(self, radiance=radiance)

    def _repr_png_(self) -> bytes:
        """The picture as PNG; notebooks show it."""
        buffer = io.BytesIO()
        self._write_png(buffer)
        return buffer.getvalue()

    def _write_png(self, file: BinaryIO) -> None:
        for begin in range(0, len(self.radiance), _ROWS):
            rows = self.radiance[begin : begin + _ROWS]
            expect(not np.isnan(rows).any(), "radiance", "numbers that have a colour", "nan")
        write_pixels(file, self.srgb)


def exr_of(image: Image, beside: Path) -> bytes:
    """The content of the .exr file of a picture; ``beside`` as of ``exr_bytes``."""
    return exr_bytes(_channels(image.radiance, image._layers()), beside)


def check_picture_path(path: str | os.PathLike[str]) -> None:
    """Raise ``ValueError`` or ``OSError`` unless ``save`` can write there; to be called before a long render."""
    if check_output_path(path, (".png", ".exr", ".npy")).suffix.lower() == ".exr":
        check_exr()


def check_output_path(path: str | os.PathLike[str], suffixes: Sequence[str]) -> Path:
    """The path, with one of ``suffixes``. Raises ``ValueError`` or ``OSError`` unless a file can be written there."""
    path = as_path("path", path)
    expected = f"a {', '.join(suffixes[:-1])} or {suffixes[-1]} file"
    expect(path.suffix.lower() in suffixes, "output", expected, repr(str(path)))
    expect(path.parent.is_dir(), "output", "a path in an existing folder", repr(str(path)))
    expect(not path.is_dir(), "output", "a file", f"the folder {str(path)!r}")
    check_writable(path)
    return path


def write_array(file: BinaryIO, values: NDArray[Any]) -> None:
    """As ``numpy.save``, which writes to no pipe, and leaks its file where a signal's handler raises."""
    values = np.ascontiguousarray(values)
    np.lib.format.write_array_header_1_0(file, np.lib.format.header_data_from_array_1_0(values))
    file.write(values.data)


def write_exr(
    path: str | os.PathLike[str], radiance: ArrayLike, layers: Mapping[str, NDArray[np.float32]] | None = None
) -> None:
    """Write linear ``radiance`` (h, w, 3) as R, G and B, and further ``layers`` (h, w), as float32 without loss.

    Whole or not at all. Raises ``ValueError`` where the package OpenEXR is absent.
    """
    content = exr_bytes(_channels(radiance, layers or {}), Path(path).resolve().parent)
    write_atomically(path, lambda file: file.write(content))


def _channels(radiance: ArrayLike, layers: Mapping[str, NDArray[np.float32]]) -> dict[str, NDArray[np.float32]]:
    return {"RGB": np.ascontiguousarray(radiance, np.float32), **layers}
