"""Files that cannot be written: each is there whole, or nothing is changed and the error names the path."""

import builtins
import errno
import io
import os
import shutil
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, chdir, contextmanager
from functools import cache
from pathlib import Path
from random import Random
from typing import Any
from unittest.mock import patch

import numpy as np

from fuzz.values import Kind
from renderer import Image, load_mesh, load_scene
from renderer.mesh.load import save_ply
from renderer.mesh.ply import format_ply
from renderer.mesh.shapes import box
from renderer.scene.scene import write_scene
from renderer.system import files

Values = dict[str, Any]


def _tree(folder: Path) -> dict[str, Any]:
    """All that a folder holds: what files say and where links lead."""
    return {
        str(p.relative_to(folder)): ("link", os.readlink(p)) if p.is_symlink() else p.is_dir() or p.read_bytes()
        for p in sorted(folder.rglob("*"))
    }


PLACES = [
    *("plain", "plain", "old", "old", "missing folder", "a folder", "link to a file", "dangling link"),
    *("link into a missing folder", "loop", "link in a linked folder", "a file as folder", "link of a link"),
]  # fmt: skip
NAMES = [
    *("a", "a", " a b ", "-o", "ü", "e\u0301", "日本", "a\nb", "a\tb", "a'b\"c", "back\\slash", "\udc80", "a\0b"),
    *(".", "..", ""),
    *("%s{}", "~", "$HOME", "*?", ".hidden", "x" * 90, "x" * 240, "x" * 250, "x" * 251, "x" * 252, "x" * 300),
    *("x" * 5000, "ü" * 60, "ü" * 120, "日" * 83, "\u202e", "\x7f"),
]  # fmt: skip
SUFFIXES = {"png": ".png", "npy": ".npy", "exr": ".exr", "ply": ".ply", "scene": ".toml"}
FAILURES = [*[None] * 6, "replace", "open", "write", "close"]
ERRORS = [errno.ENOSPC, errno.EIO, errno.EACCES, errno.EXDEV, "interrupt", "memory"]


class _Failing(io.RawIOBase):
    """A file that takes ``room`` bytes, and fails when more come or, with ``at_close``, when it is closed."""

    def __init__(self, file: Any, room: int, at_close: bool, fault: BaseException) -> None:
        self._file, self._room, self._at_close, self._fault = file, room, at_close, fault

    def writable(self) -> bool:
        return True

    def write(self, content: Any) -> int:
        self._room -= len(memoryview(content).cast("B"))
        if self._room < 0 and not self._at_close:
            raise self._fault
        return int(self._file.write(content))

    def close(self) -> None:
        if not self._file.closed:
            self._file.close()
            super().close()
            if self._at_close:
                raise self._fault


@contextmanager
def failing(how: str | None, error: Any, room: int) -> Iterator[None]:
    """Within, renaming, opening, writing or closing a file fails as a disk makes it."""
    faults: dict[Any, BaseException] = {"interrupt": KeyboardInterrupt(), "memory": MemoryError()}
    fault = faults[error] if error in faults else OSError(error, os.strerror(error))

    def refuse(*_: Any, **__: Any) -> None:
        raise fault

    def opened(*arguments: Any) -> _Failing:
        return _Failing(builtins.open(*arguments), room, how == "close", fault)

    with ExitStack() as stack:
        if how == "replace":
            stack.enter_context(patch.object(files.os, "replace", refuse))
        elif how is not None:
            stack.enter_context(patch.object(files, "open", refuse if how == "open" else opened, create=True))
        yield


def make_output(seed: int, index: int) -> Values:
    rng = Random(f"output {seed} {index}")
    what = rng.choice(list(SUFFIXES))
    suffix = SUFFIXES[what] if rng.random() < 0.9 else rng.choice(["", ".PNG", ".jpg", ".", ".ply", ".toml "])
    return {
        "what": what,
        "place": rng.choice(PLACES),
        "name": ("a" if rng.random() < 0.5 else rng.choice(NAMES)) + suffix,
        "how": rng.choice(FAILURES),
        "error": rng.choice(ERRORS),
        "room": rng.choice([0, 1, 50, 200]),
        "as": rng.choice(["path", "text", "relative", "with dots"]),
    }


def _lay(base: Path, place: str, name: str) -> Path:
    """Put into ``base`` what makes ``place``; returns the path to be written."""
    path = base / name
    (base / "sub").mkdir()
    (base / "other").write_bytes(b"other")
    links = {
        "link to a file": "other", "dangling link": "sub/new", "link into a missing folder": "missing/new",
        "loop": name, "link of a link": "second",
    }  # fmt: skip
    if place == "missing folder":
        return base / "missing" / name
    if place == "a file as folder":
        return base / "other" / name
    if place == "a folder":
        path.mkdir()
    elif place == "old":
        path.write_bytes(b"old")
    elif place == "link in a linked folder":
        (base / "linked").symlink_to("sub")
        (base / "sub" / name).symlink_to("../other")
        return base / "linked" / name
    elif place in links:
        (base / "second").symlink_to("sub/new")
        path.symlink_to(links[place])
    return path


@cache
def picture() -> Image:
    values = np.random.default_rng(3).random((8, 8, 3)).astype(np.float32)
    ones = np.ones((8, 8))
    return Image(values, ones, values, ones.astype(np.int32), ones.astype(np.int32), 0.0, 0.0)


def _write(what: str, path: Any, mesh_file: Path) -> None:
    if what == "ply":
        save_ply(box(), path)
    elif what == "scene":
        write_scene(mesh_file, path)
    else:
        picture().save(path)


@cache
def _whole(what: str) -> bytes:
    """What a picture's or a mesh's file must hold."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a.{what}"
        _write(what, path, path)
        return path.read_bytes()


def expect_whole(what: str, path: Path, mesh_file: Path) -> None:
    """What was asked for stands at ``path``, where whoever asked finds it."""
    if what != "scene":
        # A name such as .PNG or .exr says what is in the file.
        content = _whole(path.suffix.lower()[1:] if what != "ply" else "ply")
        assert path.read_bytes() == content, "another content than was written"
        return
    (entry,) = tomllib.loads(path.read_text(encoding="utf-8"))["objects"]
    found = path.parent / entry["mesh"]
    assert found.exists() and found.samefile(mesh_file), f"a scene whose mesh is not found: {entry['mesh']}"
    if path.suffix == ".toml":
        assert len(load_scene(path).instances[0].mesh.faces) == len(load_mesh(mesh_file).faces)


def expect_named(error: BaseException, path: Any) -> None:
    """One line that names the path, as it is or as ``repr`` writes it."""
    text = str(error)
    if "embedded null byte" in text or (isinstance(error, RuntimeError) and "Symlink loop" in text):
        return  # Known: see tests/boundary/test_fuzz.py.
    assert isinstance(error, ValueError | OSError), repr(error)
    assert "\n" not in text, f"more than one line: {text!r}"
    names = [name for p in (path, Path(path)) for name in (str(p), repr(str(p))[1:-1])]
    assert any(name in text for name in names), f"the path is not named: {text!r}"


def check_output(folder: Path, given: Values, index: int) -> str:
    base = Path(tempfile.mkdtemp(dir=folder))
    mesh_file = folder / "box.ply"
    try:
        mesh_file.write_bytes(format_ply(box()))
        try:
            path = _lay(base, given["place"], given["name"])
        except (OSError, ValueError):
            # No such name here; what it leads to is tried all the same.
            path = base / given["name"]
        with chdir(base):
            return _check_write(base, path, mesh_file, given)
    finally:
        shutil.rmtree(base)


def _spelled(path: Path, base: Path, how: str) -> Any:
    """The path as one may write it."""
    relative = os.path.relpath(path, base) if how == "relative" and "\0" not in str(path) else str(path)
    dots = f"{base}/sub/../{path.relative_to(base)}" if how == "with dots" else relative
    return path if how == "path" else dots


def _check_write(base: Path, path: Path, mesh_file: Path, given: Values) -> str:
    before = _tree(base)
    spelled = _spelled(path, base, given["as"])
    injected = {"interrupt": KeyboardInterrupt, "memory": MemoryError}.get(given["error"])
    try:
        with failing(given["how"], given["error"], given["room"]):
            _write(given["what"], spelled, mesh_file)
    except BaseException as error:
        after = _tree(base)
        assert after == before, f"left by a failure: {sorted(set(after) ^ set(before))}"
        if injected is None or not isinstance(error, injected):
            expect_named(error, spelled)
        return "refused"
    assert given["how"] is None or (given["how"] == "write" and given["room"] > 1), "a failure that is not told"
    expect_whole(given["what"], Path(spelled), mesh_file)
    after = _tree(base)
    target = str(Path(os.path.realpath(spelled)).relative_to(os.path.realpath(base)))
    others = [{k: v for k, v in tree.items() if k != target} for tree in (before, after)]
    assert others[0] == others[1], "more was changed than one file"
    return "written"


KINDS = {"output": Kind(make_output, check_output)}


def prepare_kinds() -> None:
    """Import what writes pictures before a clock starts."""
    for what in ("png", "npy", "exr", "ply"):
        _whole(what)
