"""The settings for reading a mesh file, and what is left out of it on the way."""

from __future__ import annotations

import os
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from renderer.errors import MeshError
from renderer.mesh.mesh import Mesh, Repairs
from renderer.mesh.texture_image import TextureImage

# So many names of what is left out stand in a note.
_NAMED = 4


@dataclass
class Reading:
    """One reading of a file.

    repair : whether faces that name a missing vertex, or one that is not finite, are left out.
    folder : where the file lies; None for bytes.
    repairs : what was left out so, one record per mesh of the file.
    notes : what else was left out or read otherwise than it stands, in words.
    """

    repair: bool = False
    folder: Path | None = None
    repairs: list[Repairs] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _images: dict[TextureImage, TextureImage | None] = field(default_factory=dict)

    def note(self, text: str, names: Iterable[object] = ()) -> None:
        """Note something once, with the names of what is meant."""
        distinct = list(dict.fromkeys(map(str, names)))
        listed = ", ".join(name[:40] for name in distinct[:_NAMED]) + (" …" if len(distinct) > _NAMED else "")
        text = f"{text} {listed}".strip()
        if text not in self.notes:
            self.notes.append(text)

    def mesh(self, vertices: Any, faces: Any, **attributes: Any) -> Mesh:
        """``Mesh(...)``, or ``Mesh.repaired(...)`` whose record is kept."""
        if not self.repair:
            return Mesh(vertices, faces, **attributes)
        mesh, made = Mesh.repaired(vertices, faces, **attributes)
        self.repairs.append(made)
        return mesh

    def file(self, name: str, near: Path | None = None) -> Path | None:
        """The file that is meant by a name in the file: in ``near`` or its folder, as it stands or without its folders.

        Backslashes divide folders too. None if there is none.
        """
        plain = name.replace("\\", "/")
        folders = [folder for folder in (near, self.folder) if folder is not None]
        places = [folder / each for each in (name, plain, plain.rpartition("/")[2]) if each for folder in folders]
        return next((place for place in places if os.path.isfile(place)), None)

    def image_file(self, name: str, near: Path | None = None) -> TextureImage | None:
        """The image in a file that is named so; None, which is noted, where there is none that can be read."""
        found = self.file(name, near)
        if found is None:
            self.note("left out: images that are not there:", [name])
            return None
        return self.image(TextureImage(found))

    def image(self, image: TextureImage) -> TextureImage | None:
        """The image, the same object for equal ones; None, which is noted, if it cannot be read."""
        if image not in self._images:
            try:
                self._images[image] = image if image.size else None
            except MeshError as error:
                self.note(f"left out: image {error}")
                self._images[image] = None
        return self._images[image]

    def kept(self, ends: Any) -> list[int]:
        """Where parts end that end at the faces ``ends`` as given, once the last mesh's bad faces are left out."""
        found = np.asarray(ends, np.int64)
        return (np.searchsorted(self.repairs[-1].kept_faces, found) if self.repairs else found).tolist()

    def cut(self, wrong: Any, number: str) -> None:
        """Note the polygons that keep a fan although it does not cover them once, each by its ``number``."""
        if len(wrong):
            self.note(f"polygons that cross themselves or are far from flat are cut as fans, by {number}:", wrong)

    def no_polygon(self) -> None:
        """Note that a face has too few corners."""
        self.note("left out: faces of fewer than three corners")

    @property
    def said(self) -> str:
        """All that was left out or read otherwise than it stands; nothing where all was read."""
        return "; ".join([*([str(self._total)] if self._total else []), *self.notes])

    @property
    def _total(self) -> Repairs | None:
        """All meshes' repairs as if they were one mesh's, of which only the counts mean something; None for none."""
        if not any(self.repairs):
            return None
        parts = ((r.dropped_faces, r.bad_vertices, r.kept_faces, r.bad_normals) for r in self.repairs)
        return Repairs(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def in_utf8(content: bytes) -> bytes:
    """The content of a text, of which UTF-16 is known by its byte order mark."""
    if content[:2] not in (BOM_UTF16_LE, BOM_UTF16_BE):
        return content
    return content.decode("utf-16", "replace").encode()
