"""The materials that an OBJ file names, as MTL files beside it describe them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.material import MeshMaterial
from renderer.mesh.mtl import parse_mtl
from renderer.mesh.reading import Reading, in_utf8
from renderer.system.files import read_whole


@dataclass
class Looks:
    """The statements of an OBJ file about materials.

    libraries : names of MTL files, of each statement ``mtllib``.
    uses : the first polygon that each ``usemtl`` holds for, and the material's name.
    """

    libraries: list[str] = field(default_factory=list)
    uses: list[tuple[int, str]] = field(default_factory=list)

    def read(self, keyword: str, rest: str, polygons: int) -> None:
        """Keep one statement, behind so many polygons."""
        if keyword == "mtllib":
            self.libraries.append(rest)
        else:
            self.uses.append((polygons, rest))


def materials_of(
    looks: Looks, polygons: NDArray[np.int64], reading: Reading
) -> tuple[tuple[MeshMaterial, ...], NDArray[np.int32] | None]:
    """The materials of triangles, in the order of their first use, and the row of each triangle's.

    ``polygons`` has the polygon of each triangle. What no file describes is noted.
    """
    known = _described(looks, reading)
    # rule: last-use-before
    use = np.searchsorted([first for first, _ in looks.uses], polygons, side="right") - 1
    used = [looks.uses[k][1] for k in np.flatnonzero(np.bincount(use + 1)[1:]).tolist()]
    missing = [name or "without a name" for name in used if name not in known]
    if missing:
        reading.note("left out: materials that no file describes:", missing)
    rows: dict[str, int] = {}
    for name in used:
        if name in known:
            rows.setdefault(name, len(rows))
    if not rows:
        return (), None
    row_of_use = np.array([*(rows.get(name, -1) for _, name in looks.uses), -1], np.int32)
    return tuple(known[name] for name in rows), row_of_use[use]


def _described(looks: Looks, reading: Reading) -> dict[str, MeshMaterial]:
    """All materials in the MTL files; of two with one name the first."""
    found: dict[str, MeshMaterial] = {}
    for library in dict.fromkeys(looks.libraries):
        # A statement may name several files, or one whose name has blanks.
        for name in [library] if reading.file(library) else library.split():
            path = reading.file(name)
            if path is None:
                reading.note("left out: material files that are not there:", [name])
            else:
                found = _in_file(path, name, reading) | found
    return found


def _in_file(path: Path, name: str, reading: Reading) -> dict[str, MeshMaterial]:
    try:
        content = in_utf8(read_whole(path))
    except OSError as error:
        reading.note(f"left out: material file {name}: {error.strerror or error}")
        return {}
    materials, left_out = parse_mtl(content, partial(reading.image_file, near=path.parent))
    if left_out:
        reading.note(f"left out of {name}:", left_out)
    return materials
