"""Images of textures: their pixels beside other readers', and the message of each that cannot be read."""

import io
import pickle
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest
from cases import cases

from renderer import MeshError, TextureImage

mi = pytest.importorskip("mitsuba")
pytestmark = pytest.mark.judges("TextureImage", "TextureImage.pixels", "TextureImage.size")

RNG = np.random.default_rng(5)


def png(width: int, height: int, bits: int, kind: int, rows: bytes) -> bytes:
    """A PNG file made by hand."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def encoded(image: PIL.Image.Image, kind: str = "PNG", **options: Any) -> bytes:
    out = io.BytesIO()
    image.save(out, kind, **options)
    return out.getvalue()


@cases("channels", [1, 3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_png_that_mitsuba_wrote_has_its_pixels(dtype: Any, channels: int, tmp_path: Path) -> None:
    """Smooth and noisy, so that rows have all kinds of filters. Pillow alone has 8 of 16 bits in RGB."""
    mi.set_variant("scalar_rgb")
    y, x, c = np.mgrid[:40, :50, :channels]
    given = (
        np.iinfo(dtype).max * (0.5 + 0.4 * np.sin(x / 9 + c) * np.cos(y / 7)) + RNG.integers(0, 9, y.shape)
    ).astype(dtype)
    kinds = {1: mi.Bitmap.PixelFormat.Y, 3: mi.Bitmap.PixelFormat.RGB, 4: mi.Bitmap.PixelFormat.RGBA}
    mi.Bitmap(given, kinds[channels]).write(str(tmp_path / "a.png"))
    image = TextureImage(tmp_path / "a.png")
    assert image.size == (50, 40) and image.pixels.dtype == dtype
    np.testing.assert_array_equal(image.pixels, given)
    assert not image.pixels.flags.writeable


@cases("kind", ["half", "float"])
def test_an_exr_that_mitsuba_wrote_has_its_pixels(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("OpenEXR")
    mi.set_variant("scalar_rgb")
    given = RNG.uniform(0, 9, (7, 5, 3)).astype(np.float16).astype(np.float32)
    bitmap = mi.Bitmap(given, mi.Bitmap.PixelFormat.RGB)
    if kind == "half":
        bitmap = bitmap.convert(component_format=mi.Struct.Type.Float16)
    bitmap.write(str(tmp_path / "a.exr"))
    for source in (tmp_path / "a.exr", (tmp_path / "a.exr").read_bytes()):
        image = TextureImage(source)
        assert image.size == (5, 7)
        np.testing.assert_array_equal(image.pixels, given)


GREY = PIL.Image.fromarray(np.array([[0, 255]], np.uint8))
PALETTE = GREY.convert("P")
PALETTE.putpalette([255, 0, 0] * 255 + [0, 0, 255])
MODES: dict[str, tuple[bytes, list[Any]]] = {
    "bilevel": (encoded(GREY.convert("1")), [[0], [255]]),
    "grey": (encoded(GREY), [[0], [255]]),
    "grey and alpha": (encoded(GREY.convert("LA")), [[0, 255], [255, 255]]),
    "palette": (encoded(PALETTE), [[255, 0, 0], [0, 0, 255]]),
    "a transparent colour of a palette": (encoded(PALETTE, transparency=0), [[255, 0, 0, 0], [0, 0, 255, 255]]),
    "a transparent grey": (encoded(GREY, transparency=0), [[0, 0, 0, 0], [255, 255, 255, 255]]),
    "CMYK": (encoded(PIL.Image.new("CMYK", (2, 1), (0, 0, 0, 255)), "TIFF"), [[0, 0, 0]] * 2),
    "GIF": (encoded(PALETTE, "GIF"), [[255, 0, 0], [0, 0, 255]]),
    "WebP": (encoded(PALETTE.convert("RGB"), "WEBP", lossless=True), [[255, 0, 0], [0, 0, 255]]),
    "floats": (encoded(PIL.Image.fromarray(np.array([[0.25, -2.0]], np.float32)), "TIFF"), [[0.25], [-2.0]]),
    "by hand": (png(1, 2, 16, 2, b"\0\1\2\3\4\5\6" + b"\2\1\1\1\1\1\1"), [[0x0102, 0x0304, 0x0506]]),
}  # fmt: skip


@cases("name", MODES)
def test_each_kind_of_pixels_becomes_grey_or_rgb_with_or_without_alpha(name: str) -> None:
    content, row = MODES[name]
    assert TextureImage(content).pixels[0].tolist() == row


def test_an_orientation_is_ignored_as_texture_coordinates_are_of_the_stored_pixels() -> None:
    exif = PIL.Image.Exif()
    exif[0x0112] = 6  # turned by a quarter
    assert TextureImage(encoded(GREY, "JPEG", exif=exif)).pixels.shape == (1, 2, 1)


@cases("given", [np.array([[1, 2]], np.uint8), [[[0.5, 1.0]]], np.full((2, 3, 4), 7, np.uint16)])
def test_arrays_are_copied_and_have_channels(given: Any) -> None:
    pixels = TextureImage(given).pixels
    assert pixels.ndim == 3 and not np.shares_memory(pixels, np.asarray(given))
    np.testing.assert_array_equal(pixels, np.asarray(given).reshape(pixels.shape))


WIDE = png(20_000, 20_000, 8, 0, b"")
FAULTS: dict[str, tuple[Any, str]] = {
    "missing": ("no.png", "no.png: cannot be read: No such file"),
    "a folder": ("/", "/: cannot be read: expected a file"),
    "no image": (b"v 0 0 0", "image: cannot be read as an image: of no known format"),
    "empty": (b"", "image: cannot be read as an image: of no known format"),
    "cut off": (encoded(PIL.Image.effect_noise((64, 64), 90))[:900], "image: cannot be read as an image: "),
    "no EXR": (b"\x76\x2f\x31\x01 no", "image: cannot be read as an image: "),
    "of nothing": (np.zeros((0, 4)), "image: expected 1 to 268435456 pixels (16384 x 16384), got 4 x 0"),
    "too large": (WIDE, "image: expected 1 to 268435456 pixels (16384 x 16384), got 20000 x 20000"),
    "five channels": (np.zeros((2, 2, 5)), "image: expected shape (h, w) or (h, w, 1 to 4), got (2, 2, 5)"),
    "of int64": ([[1, 2]], "image: expected uint8, uint16 or floats, got int64"),
    "of bool": ([[True]], "image: expected real numbers, got dtype bool"),
    "NaN": ([[0.0, np.nan]], "image: expected finite values, got nan in row 0, column 1"),
    "beyond float32": ([[1e300]], "image: expected finite values, got inf in row 0, column 0"),
    "a name": ("a\ud800", r"source: expected a path that the file system's utf-8 can spell"),
}  # fmt: skip


@cases("name", FAULTS)
def test_what_is_no_image_is_named(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    given, message = FAULTS[name]
    with pytest.raises(MeshError) as refused:
        TextureImage(given).pixels  # noqa: B018
    assert message in str(refused.value)


def test_an_image_of_16384_by_16384_is_within_the_limit_and_pillows_limit_stays() -> None:
    before = PIL.Image.MAX_IMAGE_PIXELS
    assert TextureImage(png(16384, 16384, 8, 0, b"")).size == (16384, 16384)
    assert before == PIL.Image.MAX_IMAGE_PIXELS


def test_images_are_read_late_pickled_by_source_and_equal_by_it(tmp_path: Path) -> None:
    late = TextureImage(tmp_path / "late.png")
    (tmp_path / "late.png").write_bytes(encoded(GREY))
    assert late.pixels.shape == (1, 2, 1)
    content, array = encoded(GREY), TextureImage([[0.5]])
    for image in (late, TextureImage(content, "name")):
        copy = pickle.loads(pickle.dumps(image))
        assert copy == image and hash(copy) == hash(image) and "pixels" not in vars(copy)
    assert pickle.loads(pickle.dumps(array)).pixels.tolist() == [[[0.5]]]
    assert TextureImage(content) == TextureImage(bytes(content)) != TextureImage(content, "other")
    assert array == array != TextureImage([[0.5]])
