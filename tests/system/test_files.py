"""Files that are written: whole or not at all, where links lead, refused before the work, kept after it."""

import errno
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pytest
from cases import cases

from renderer import load_scene, render
from renderer.cli import render as rendering
from renderer.cli.main import main
from renderer.picture.image import PLANES, Image
from renderer.system import files
from renderer.system.files import are_apart, check_writable, write_atomically

STAIRS = Path(__file__).parents[2] / "scenes" / "stairs.toml"


def test_a_folder_is_no_place_for_a_file(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError, match=re.escape(str(tmp_path))):
        check_writable(tmp_path)


@pytest.mark.parametrize("letter", ["a", "\u65e5", "\U0001f600"])
def test_a_name_may_be_as_long_as_the_file_system_has_it(tmp_path: Path, letter: str) -> None:
    """The temporary name beside one of many letters of three or four bytes was too long."""
    path = tmp_path / (letter * (255 // len(letter.encode())))
    check_writable(path)
    write_atomically(path, lambda file: file.write(b"1"))
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    with pytest.raises(OSError, match="name too long"):
        check_writable(path.with_name(path.name + letter))


def test_files_are_apart_unless_links_lead_to_one(tmp_path: Path) -> None:
    a, b, link, loop = (tmp_path / name for name in ("a", "b", "link", "loop"))
    link.symlink_to(a)
    loop.symlink_to(loop)
    assert are_apart([a, b, loop]) and are_apart([a], [b, b, loop]) and are_apart([])
    assert not are_apart([a, f"{tmp_path}/./a"]) and not are_apart([a, link])
    assert not are_apart([b, a], [link]) and not are_apart([loop], [loop])


_WRITER = """
import sys, time
from renderer.system.files import write_atomically

def write(file):
    file.write(b"half")
    file.flush()
    print("writing", flush=True)
    sys.stdin.readline()  # for ever, or until it is to go on

write_atomically(sys.argv[1], write)
"""


def writing(path: Path) -> subprocess.Popen[bytes]:
    """A process in the middle of a file."""
    writer = subprocess.Popen([sys.executable, "-c", _WRITER, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert writer.stdout is not None and writer.stdout.readline() == b"writing\n"
    return writer


def test_what_killed_writers_left_goes_with_the_next_write_and_what_others_write_stays(tmp_path: Path) -> None:
    path, other = tmp_path / "o.ply", tmp_path / "o.ply.npy"
    with writing(path) as living, writing(path) as killed, writing(other) as also:
        for writer in (killed, also):
            writer.kill()
            writer.wait()
        before = {p.name for p in tmp_path.iterdir()}
        assert len(before) == 3 and {name[:7] for name in before} == {".o.ply."}
        keep = tmp_path / ".o.ply.notes"
        keep.write_bytes(b"a user's")
        write_atomically(path, lambda file: file.write(b"new"))
        mine, theirs = ({p for p in tmp_path.glob(pattern)} for pattern in (".o.ply.*", ".o.ply.npy.*"))
        assert len(theirs) == 1 and len(mine - theirs - {keep}) == 1 and path.read_bytes() == b"new"
        assert living.stdin is not None
        living.stdin.write(b"\n")
        living.stdin.close()
        assert living.wait() == 0 and path.read_bytes() == b"half"
    write_atomically(other, lambda file: file.write(b"other"))
    assert {p.name for p in tmp_path.iterdir()} == {path.name, other.name, keep.name}


def test_a_file_that_is_taken_for_left_before_it_is_locked_is_begun_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process may look between the two."""
    sound, locked = files.fcntl.flock, list[int]()

    def look_first(descriptor: int, how: int) -> None:
        locked.append(how)
        if len(locked) == 1:
            files._remove_left(tmp_path / "a.bin")
            assert not list(tmp_path.iterdir())
        sound(descriptor, how)

    monkeypatch.setattr(files.fcntl, "flock", look_first)
    write_atomically(tmp_path / "a.bin", lambda file: file.write(b"new"))
    assert [p.read_bytes() for p in tmp_path.iterdir()] == [b"new"] and len(locked) == 3


@pytest.mark.parametrize("locks", ["refused", "absent"])
def test_without_locks_files_are_written_and_nothing_is_found_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, locks: str
) -> None:
    """On some network file systems, and on Windows."""

    def refuse(*arguments: Any) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    if locks == "refused":
        monkeypatch.setattr(files.fcntl, "flock", refuse)
    else:
        monkeypatch.setattr(files, "fcntl", None)
    left = tmp_path / ".a.bin.0123456789ab"
    left.write_bytes(b"half")
    write_atomically(tmp_path / "a.bin", lambda file: file.write(b"new"))
    assert left.exists() and (tmp_path / "a.bin").read_bytes() == b"new"


def test_whether_a_folder_can_be_written_is_found_out_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """Root may write everywhere, so the refusal is faked."""

    def refuse(*arguments: Any, **options: Any) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(files.Path, "touch", refuse)
    monkeypatch.setattr(rendering, "_save", lambda *a: pytest.fail("rendered in vain"))
    with pytest.raises(PermissionError, match="Permission denied"):
        check_writable(tmp_path / "a.png")
    assert main(["render", str(STAIRS), "-o", str(tmp_path / "a.png"), "--resolution", "8x8"]) == 2
    assert capsys.readouterr().err == f"octree-render: [Errno 13] Permission denied: '{tmp_path / 'a.png'}'\n"
    assert not list(tmp_path.iterdir())


def test_a_picture_that_cannot_be_written_is_kept_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """The disk is full when the picture is ready."""
    full, spare = tmp_path / "full", tmp_path / "spare"
    full.mkdir()
    spare.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(spare))
    sound = Image.save

    def save(image: Image, path: Path) -> None:
        if Path(path).parent == full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        sound(image, path)

    monkeypatch.setattr(Image, "save", save)
    assert main(["render", str(STAIRS), "-o", str(full / "a.npy"), "--resolution", "8x8", "--quiet"]) == 2
    (kept,) = spare.rglob("a.npy")
    said = capsys.readouterr().err
    assert f"No space left on device: '{full / 'a.npy'}'; the picture is kept as {kept}" in said
    np.testing.assert_array_equal(np.load(kept), render(load_scene(STAIRS), resolution=(8, 8)).radiance)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full device")
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_full_standard_output_is_named(unbuffered: str) -> None:
    command = [sys.executable, "-m", "renderer", "info", str(STAIRS)]
    with open("/dev/full", "w", encoding="utf-8") as full:
        ended = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, text=True, cwd=STAIRS.parents[1], timeout=100,
            env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
        )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (
        2,
        "octree-render: [Errno 28] No space left on device: 'standard output'\n",
    )


def test_an_array_on_a_full_disk_is_named_with_the_likely_reason(tmp_path: Path) -> None:
    def write(file: BinaryIO) -> None:
        raise OSError("1228800 requested and 262112 written")  # of NumPy, which keeps no error number

    with pytest.raises(
        OSError, match=re.escape(f"{tmp_path / 'a.npy'}: 1228800 requested and 262112 written; is there")
    ):
        write_atomically(tmp_path / "a.npy", write)


@pytest.mark.judges("Image", "render")
@cases("planes", [(), ("rays",), ("depth", "face"), ("normal",), PLANES])
def test_planes_that_are_not_kept_have_no_pixels_and_others_the_same(tmp_path: Path, planes: tuple[str, ...]) -> None:
    scene = load_scene(STAIRS)
    whole, image = render(scene, resolution=(20, 16)), render(scene, resolution=(20, 16), planes=planes)
    for name in PLANES:
        kept = name in planes or name == "radiance"
        array = getattr(image, name)
        np.testing.assert_array_equal(array, getattr(whole, name) if kept else getattr(whole, name)[:0, :0])
    for suffix in ("png", "npy"):
        image.save(tmp_path / f"a.{suffix}")


@pytest.mark.judges("render")
@cases("planes", ["depth", ["color"], ["depth", 3], np.array(4), None])
def test_unknown_planes_are_refused(planes: Any) -> None:
    with pytest.raises(ValueError, match=r"^planes: expected some of radiance, depth, normal, face, rays, got "):
        render(load_scene(STAIRS), resolution=(4, 4), planes=planes)


def test_a_file_keeps_its_mode(tmp_path: Path) -> None:
    path = tmp_path / "private.bin"
    path.touch()
    path.chmod(0o600)
    write_atomically(path, lambda file: file.write(b"new"))
    assert (path.stat().st_mode & 0o777, path.read_bytes()) == (0o600, b"new")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_write_protected_file_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Renaming over it would succeed. Root may write to any file, so the system's answer is given here."""
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    monkeypatch.setattr(os, "access", lambda file, mode: False)
    for write in (check_writable, lambda path: write_atomically(path, lambda file: file.write(b"new"))):
        with pytest.raises(PermissionError, match=re.escape(str(path))):
            write(path)
    assert path.read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["a.png"]


def test_a_pipe_is_written_to_and_stays(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    write_atomically(tmp_path / "pipe", lambda file: file.write(b"new"))
    assert os.read(reader, 9) == b"new"
    assert (tmp_path / "pipe").is_fifo()
    os.close(reader)


@cases("name", ["a.obj", "a.ply", "a.stl", "a.glb", "a.toml"])
def test_a_device_without_an_end_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(ValueError, match=rf"{name}: cannot be read: expected a file, got a device"):
        load_scene(tmp_path / name)


def test_an_error_tells_a_terminal_nothing(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "a.ply").write_bytes(
        b"ply\nformat ascii 1.0\nelement vert\x1b]0;PWN\x07ex 1\nproperty float x\nend_header\n"
    )
    assert main(["info", str(tmp_path / "a.ply")]) == 2
    said = capsys.readouterr().err
    assert "\\x1b" in said
    assert said.rstrip("\n").isprintable()


def test_a_private_file_is_private_while_it_is_written(tmp_path: Path) -> None:
    path, modes = tmp_path / "private.bin", []
    path.touch()
    path.chmod(0o600)
    write_atomically(path, lambda file: modes.append(os.fstat(file.fileno()).st_mode & 0o777))
    assert modes == [0o600]
