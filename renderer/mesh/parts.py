"""Named parts of a mesh: the runs of faces that groups of a file, nodes of a scene or joined meshes have."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Part(NamedTuple):
    """A part of a mesh.

    Attributes
    ----------
    name : str
        As the file or the mesh has it; may be empty.
    faces : slice
        Its faces: ``mesh.faces[part.faces]``, ``values[part.faces]``.
    """

    name: str
    faces: slice


def parts_of(names: Iterable[str], counts: Sequence[int]) -> tuple[Part, ...]:
    """Parts that follow each other, of so many faces each."""
    ends = np.cumsum(counts, dtype=np.int64).tolist()
    return tuple(Part(name, slice(end - count, end)) for name, count, end in zip(names, counts, ends, strict=True))


def runs_of(names: Sequence[str], ends: Sequence[int]) -> tuple[Part, ...]:
    """Parts that end at some faces, without empty ones; neighbours of one name are one. None if no part has a name."""
    merged: list[Part] = []
    begin = 0
    for name, end in zip(names, ends, strict=True):
        if end > begin and merged and merged[-1].name == name:
            merged[-1] = Part(name, slice(merged[-1].faces.start, end))
        elif end > begin:
            merged.append(Part(name, slice(begin, end)))
        begin = max(begin, end)
    return tuple(merged) if any(part.name for part in merged) else ()


def part_numbers(parts: Sequence[Part], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """The part of each face (...) as an index of ``parts``; -1 stays."""
    ends = np.array([part.faces.stop for part in parts], np.int64)
    return np.where(faces >= 0, np.searchsorted(ends, faces, side="right"), -1)
