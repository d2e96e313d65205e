"""Images: the sRGB curve, files that are whole or not there, and what a notebook shows."""

import io
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest
from cases import cases

from renderer.picture.image import Image, check_picture_path, srgb, srgb_steps
from renderer.system.files import write_atomically

pytestmark = pytest.mark.judges("Image", "Image.save", "Image.srgb", "octree-render render --output", "srgb")


def image(radiance: Any = None) -> Image:
    radiance = np.random.default_rng(1).uniform(-0.2, 1.3, (5, 7, 3)) if radiance is None else radiance
    radiance = np.asarray(radiance, np.float32)
    shape = radiance.shape[:2]
    return Image(
        radiance=radiance,
        depth=np.where(np.arange(np.prod(shape)).reshape(shape) % 3, 1.25, np.inf),
        normal=np.random.default_rng(2).normal(size=(*shape, 3)).astype(np.float32),
        face=np.zeros(shape, np.int32),
        rays=np.ones(shape, np.int32),
        build_seconds=0.0,
        render_seconds=0.0,
    )


def decoded(code: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1's inverse: 8-bit sRGB to linear."""
    c = code / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def test_codes_change_half_way_between_neighbours() -> None:
    codes = np.arange(255)
    for side, expected in ((-1e-6, codes), (1e-6, codes + 1)):
        assert (srgb(decoded(codes + 0.5 + side)) == expected).all()


def test_values_out_of_range_are_clipped() -> None:
    assert srgb([-np.inf, -1.0, -0.0, 0.0, 1.0, 1.0000001, 1e30, np.inf]).tolist() == [0, 0, 0, 0, 255, 255, 255, 255]
    assert srgb(0.5) == 188 and srgb(0.18) == 118 and srgb([[0.5, 0.5]]).shape == (1, 2)


def test_png_holds_the_srgb_codes_with_row_zero_at_the_top(tmp_path: Path) -> None:
    picture = image()
    picture.save(tmp_path / "a.png")
    with PIL.Image.open(tmp_path / "a.png") as file:
        assert (file.format, file.mode, file.size) == ("PNG", "RGB", (7, 5))
        assert (np.asarray(file) == srgb(picture.radiance)).all()
    assert picture._repr_png_() == (tmp_path / "a.png").read_bytes()
    assert PIL.Image.open(io.BytesIO(picture._repr_png_())).size == (7, 5)


@cases("height", [1, 64, 65, 129])
def test_each_row_of_a_png_is_written_and_looked_at(height: int) -> None:
    """Rows are taken 64 at a time: the last few, or one alone, count too."""
    picture = image(np.full((height, 2, 3), 1.0))
    with PIL.Image.open(io.BytesIO(picture._repr_png_())) as file:
        assert (np.asarray(file) == 255).all() and file.size == (2, height)
    for row in (0, height - 1):
        spoilt = picture.radiance.copy()
        spoilt[row, 1, 2] = np.nan
        with pytest.raises(ValueError, match="radiance: expected numbers that have a colour, got nan"):
            image(spoilt)._repr_png_()


def test_a_picture_prints_as_its_size() -> None:
    assert repr(image()) == "<Image of 7 x 5 pixels>"


def test_png_is_read_by_mitsuba(tmp_path: Path, mitsuba: Any) -> None:
    """Another reader than the package that wrote it."""
    picture = image()
    picture.save(tmp_path / "a.png")
    read = mitsuba.Bitmap(str(tmp_path / "a.png"))
    assert read.pixel_format() == mitsuba.Bitmap.PixelFormat.RGB and read.srgb_gamma()
    assert np.array(read).dtype == np.uint8 and np.array_equal(np.array(read), srgb(picture.radiance))


def test_npy_holds_the_radiance(tmp_path: Path) -> None:
    picture = image()
    picture.save(str(tmp_path / "a.NPY"))
    loaded = np.load(tmp_path / "a.NPY")
    assert loaded.dtype == np.float32 and loaded.tobytes() == picture.radiance.tobytes()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@cases("name", ["a.npy", "a.exr"])
def test_a_pipe_gets_the_whole_file(tmp_path: Path, name: str) -> None:
    """numpy.save asks for a position in the file: a pipe got the header, and the message blamed the disk."""
    picture = image()
    picture.save(tmp_path / f"file{name}")
    os.mkfifo(tmp_path / name)
    reader = os.open(tmp_path / name, os.O_RDONLY | os.O_NONBLOCK)
    picture.save(tmp_path / name)
    assert os.read(reader, 1 << 16) == (tmp_path / f"file{name}").read_bytes()
    os.close(reader)


def test_exr_holds_the_radiance_and_its_layers(tmp_path: Path, mitsuba: Any) -> None:
    """Read back by Mitsuba's reader, which is not the package that wrote it."""
    picture = image()
    picture.save(tmp_path / "a.exr")
    read = mitsuba.Bitmap(str(tmp_path / "a.exr"))
    channels = {field.name: np.array(read)[..., i] for i, field in enumerate(read.struct_())}
    assert all(np.array_equal(channels[name], picture.radiance[..., i]) for i, name in enumerate("RGB"))
    assert all(np.array_equal(channels[f"normal.{name}"], picture.normal[..., i]) for i, name in enumerate("XYZ"))
    assert np.array_equal(channels["Z"], picture.depth.astype(np.float32)) and len(channels) == 7
    assert [p.name for p in tmp_path.iterdir()] == ["a.exr"]


@pytest.mark.parametrize("full", ["the system's folder for temporary files", "all"])
def test_exr_needs_room_in_one_place_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, full: str) -> None:
    """OpenEXR raises RuntimeError on a full disk; the picture was lost though its own disk had room."""
    import OpenEXR

    write = OpenEXR.File.write

    def written(file: object, path: str) -> None:
        if full == "all" or not Path(path).is_relative_to(tmp_path / "pictures"):
            raise RuntimeError("Failed to write pixel data: No space left on device")
        write(file, path)

    monkeypatch.setattr(OpenEXR.File, "write", written)
    (tmp_path / "pictures").mkdir()
    if full == "all":
        with pytest.raises(OSError, match="No space left"):
            image().save(tmp_path / "pictures" / "a.exr")
    else:
        image().save(tmp_path / "pictures" / "a.exr")
    assert [p.name for p in (tmp_path / "pictures").iterdir()] == ["a.exr"] * (full != "all")


def test_exr_without_its_package_is_refused_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    for call in (check_picture_path, image().save):
        with pytest.raises(ValueError, match=r"output: expected the package OpenEXR .*\[exr\]"):
            call(tmp_path / "a.exr")
    assert not list(tmp_path.iterdir())


@cases("error", [OSError("disk full"), KeyboardInterrupt()])
@cases("existed", [False, True])
def test_a_failure_midway_leaves_what_was_there(tmp_path: Path, error: BaseException, existed: bool) -> None:
    path = tmp_path / "a.npy"
    if existed:
        path.write_bytes(b"old")

    def half(file: Any) -> None:
        file.write(b"half")
        file.flush()
        raise error

    with pytest.raises(type(error)):
        write_atomically(path, half)
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == ([("a.npy", b"old")] if existed else [])


@pytest.mark.skipif(os.name != "posix", reason="permission bits are POSIX's")
@pytest.mark.parametrize("mask", [0o022, 0o077])
def test_permissions_are_those_of_any_new_file(tmp_path: Path, mask: int) -> None:
    before = os.umask(mask)
    try:
        image().save(tmp_path / "a.png")
        (tmp_path / "plain").write_bytes(b"")
        assert os.umask(mask) == mask
    finally:
        os.umask(before)
    assert (tmp_path / "a.png").stat().st_mode == (tmp_path / "plain").stat().st_mode


@cases("name", ["a.jpg", "a", "a.png.txt", ".png", "png"])
def test_unknown_suffixes(tmp_path: Path, name: str) -> None:
    for call in (check_picture_path, image().save):
        with pytest.raises(ValueError, match=r"output: expected a \.png, \.exr or \.npy file, got .*" + name):
            call(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_missing_folders_and_folders_in_the_place_of_files(tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").write_bytes(b"")
    for call in (check_picture_path, image().save):
        with pytest.raises(ValueError, match=r"output: .*existing folder.*none"):
            call(tmp_path / "none" / "a.png")
        with pytest.raises(ValueError, match=r"output: .*existing folder"):
            call(tmp_path / "file" / "a.png")
        with pytest.raises(ValueError, match=r"output: expected a file, got the folder.*folder\.png"):
            call(tmp_path / "folder.png")


def test_float32_gets_the_codes_that_float64_gets() -> None:
    """Radiance takes a faster way: at every step, beside it, and at numbers of every size and sign."""
    steps = srgb_steps().astype(np.float32)
    bits = np.random.default_rng(3).integers(0, 1 << 32, 200_000, np.uint32)
    special = np.array([0.0, -0.0, -1.0, 1.0, 7.0, np.inf, -np.inf, 1e-45, 0.0031308], np.float32)
    sides = [np.nextafter(steps, np.float32(far)) for far in (-np.inf, np.inf)]
    even = np.linspace(0.0, 1.0, 99_999, dtype=np.float32)
    values = np.concatenate([steps, *sides, bits.view(np.float32), even, special])
    values = values[~np.isnan(values)]
    assert np.array_equal(srgb(values), srgb(values.astype(np.float64)))


def test_codes_begin_at_their_steps() -> None:
    steps = srgb_steps()
    assert (srgb(steps) == np.arange(1, 256)).all() and (srgb(np.nextafter(steps, 0.0)) == np.arange(255)).all()
