"""The folder of a long run: what the run is of, and the parts of it that are done.

A folder beside the result has ``manifest.json``, which says what is computed from what, and a file for each finished
part: its bytes, then the SHA-256 of the manifest, the name of the part and the bytes. Files are written beside and
renamed, so a part is whole or absent. A damaged part and one of another run count as absent.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from renderer.system.files import write_atomically

_MANIFEST = "manifest.json"
_DIGEST_BYTES = 32


class RunFolder:
    """The folder of a run under way."""

    def __init__(self, folder: Path, manifest: Mapping[str, Any]) -> None:
        """Begin a run, or go on with a killed run of the same manifest: all that its parts depend on, in types of JSON.

        Raises ``ValueError`` if the folder is that of another run, and says what differs.
        """
        self.folder = folder
        self._manifest = json.dumps(manifest, indent=1, sort_keys=True).encode()
        path = folder / _MANIFEST
        if not path.exists():
            folder.mkdir(parents=True, exist_ok=True)
            write_atomically(path, lambda file: file.write(self._manifest))
            return
        differing = _differing(_read_manifest(path), json.loads(self._manifest))
        if differing:
            raise ValueError(
                f"{folder}: expected the parts of this run, got those of another, whose {', '.join(differing)} "
                "differ; remove the folder to begin anew"
            )

    def write(self, name: str, content: bytes) -> None:
        """Keep a part."""
        write_atomically(self._path(name), lambda file: file.write(content + self._digest(name, content)))

    def read(self, name: str) -> bytes | None:
        """The bytes of a part; None if it is absent or damaged."""
        try:
            kept = self._path(name).read_bytes()
        except FileNotFoundError:
            return None
        content, digest = kept[:-_DIGEST_BYTES], kept[-_DIGEST_BYTES:]
        return content if self._digest(name, content) == digest else None

    def whole(self, name: str) -> bytes:
        """The bytes of a part. Raises ``OSError`` if it is absent."""
        content = self.read(name)
        if content is None:
            raise OSError(f"{self._path(name)}: expected a whole part of the run, got none")
        return content

    def _digest(self, name: str, content: bytes) -> bytes:
        found = hashlib.sha256(self._manifest)
        found.update(f"{name};".encode())
        found.update(content)
        return found.digest()

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.part"


@contextmanager
def naming_parts(folder: Path) -> Iterator[None]:
    """A context in which Ctrl-C says that the same command goes on from the parts in ``folder``, if these are left."""
    try:
        yield
    except KeyboardInterrupt:
        if folder.is_dir():
            raise KeyboardInterrupt(f"the same command goes on from {folder}") from None
        raise


def remove_parts(folder: Path) -> None:
    """Remove the folder of a run, or what is left of it."""
    with suppress(FileNotFoundError):
        shutil.rmtree(folder)


def _read_manifest(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, UnicodeDecodeError):
        found = None
    if not isinstance(found, dict):
        raise ValueError(f"{path}: expected the manifest of a run, got something else; remove its folder")
    return found


def _differing(stored: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """The names of what is not the same in two manifests, those of ``made_of`` by their own names."""
    flat = [dict(m) | (m["made_of"] if isinstance(m.get("made_of"), dict) else {}) for m in (stored, wanted)]
    names = [n for n in sorted(flat[0].keys() | flat[1].keys()) if n != "made_of"]
    return [n.replace("_", " ") for n in names if flat[0].get(n) != flat[1].get(n)]
