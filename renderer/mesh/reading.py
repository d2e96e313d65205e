"""How a mesh file is read, and what is left out of it on the way."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from renderer.mesh.mesh import Mesh, Repairs

# So many names of what is left out stand in a note.
_NAMED = 4


@dataclass
class Reading:
    """One reading of a file.

    repair : whether faces that name a missing vertex, or one that is not finite, are left out.
    repairs : what was left out so, one record per mesh of the file.
    notes : what else was left out or read otherwise than it stands, in words.
    """

    repair: bool = False
    repairs: list[Repairs] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

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
