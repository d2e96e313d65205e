"""The argument ``leaving`` of queries: faces, with or without a side, or the hits that rays go on from."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.results.hits import Hits, Passage
from renderer.trace.batch import Leaving, check_faces, whole_numbers
from renderer.trace.starts.record import ABOVE, BARYCENTRIC, KNOWN, THROUGH


def shapes_of_starts(leaving: ArrayLike | Hits | Passage, side: ArrayLike | None) -> dict[str, tuple[int, ...]]:
    """The shapes of ``leaving`` and ``side``, with which those of the rays are broadcast.

    Raises ``ValueError`` naming the argument.
    """
    if isinstance(leaving, Hits | Passage):
        expect(side is None, "side", "None, as the hits say it", repr(side)[:40])
        return {"leaving": leaving.face.shape}
    shapes = {"leaving": real_argument("leaving", leaving).shape}
    return shapes if side is None else {**shapes, "side": real_argument("side", side).shape}


def check_leaving(
    leaving: ArrayLike | Hits | Passage, side: ArrayLike | None, shape: tuple[int, ...], most: int
) -> Leaving:
    """The faces that rays of some shape leave, checked; ``most`` is the number of faces of the mesh.

    Raises ``ValueError`` naming the argument and the row.
    """
    if isinstance(leaving, Hits | Passage):
        return _by_hits(leaving, shape, most)
    faces = check_faces("leaving", leaving, shape, most)
    return Leaving(faces, _codes(_sides(side, shape)), np.empty((0, 3)))


def _by_hits(leaving: Hits | Passage, shape: tuple[int, ...], most: int) -> Leaving:
    def rows(values: NDArray[Any]) -> NDArray[Any]:
        return np.broadcast_to(values, shape).reshape(-1)

    faces = check_faces("leaving", leaving.face, shape, most)
    anchors = np.zeros((len(faces), 3))
    anchors[:, 0], anchors[:, 1] = rows(leaving.u), rows(leaving.v)
    if isinstance(leaving, Passage):
        anchors[:, 2] = rows(leaving.pile)
    sides = np.zeros(1, np.int64) if leaving.side is None else rows(leaving.side)
    codes = _codes(sides) | BARYCENTRIC
    return Leaving(faces, codes | THROUGH if isinstance(leaving, Passage) else codes, anchors)


def _sides(side: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.int64]:
    """The side of each face that a ray starts on: 1, -1, or 0 where it is not known; one for all or one a ray."""
    if side is None:
        return np.zeros(1, np.int64)
    rows: NDArray[np.int64] = whole_numbers("side", side, shape).reshape(-1).astype(np.int64)
    good = np.abs(rows) <= 1
    if not good.all():
        row = int((~good).argmax())
        expect(False, "side", "1, -1 or 0", f"{rows[row]} in row {row}")
    return rows


def _codes(sides: NDArray[np.int64]) -> NDArray[np.int64]:
    codes: NDArray[np.int64] = KNOWN * (sides != 0) + ABOVE * (sides > 0)
    return codes
