"""The argument ``leaving`` of queries: faces, with or without a side, or the hits that rays go on from."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments.arrays import real_argument
from renderer.errors import expect
from renderer.results.hits import Hits, Passage
from renderer.trace.batch import Leaving, check_faces
from renderer.trace.starts.record import ABOVE, BARYCENTRIC, KNOWN, THROUGH


def check_leaving(
    leaving: ArrayLike | Hits | Passage, side: ArrayLike | None, shape: tuple[int, ...], most: int
) -> Leaving:
    """What rays of some dimensions leave, checked; ``most`` is the number of faces of the mesh.

    Raises ``ValueError`` naming the argument and the row.
    """
    if isinstance(leaving, Hits | Passage):
        return _by_hits(leaving, side, shape, most)
    faces = check_faces("leaving", leaving, shape, most)
    return Leaving(faces, _codes(_sides(side, shape)), np.empty((0, 3)))


def _by_hits(leaving: Hits | Passage, side: ArrayLike | None, shape: tuple[int, ...], most: int) -> Leaving:
    expect(side is None, "side", "None, as the hits say it", repr(side)[:40])
    expect(leaving.face.shape == shape, "leaving", f"hits of shape {shape}", f"shape {leaving.face.shape}")
    faces = check_faces("leaving", leaving.face, shape, most)
    anchors = np.zeros((len(faces), 3))
    anchors[:, 0], anchors[:, 1] = leaving.u.reshape(-1), leaving.v.reshape(-1)
    if isinstance(leaving, Passage):
        anchors[:, 2] = leaving.pile.reshape(-1)
    sides = np.zeros(1, np.int64) if leaving.side is None else leaving.side.reshape(-1)
    codes = _codes(sides) | BARYCENTRIC
    return Leaving(faces, codes | THROUGH if isinstance(leaving, Passage) else codes, anchors)


def _sides(side: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.int64]:
    """The side of each face that a ray starts on: 1, -1, or 0 where it is not known; one for all or one a ray."""
    if side is None:
        return np.zeros(1, np.int64)
    array = real_argument("side", side)
    whole = array.dtype.kind in "iu" and (array.ndim == 0 or array.shape == shape)
    expect(whole, "side", f"an integer or integers of shape {shape}", f"{array.dtype} of shape {array.shape}")
    rows: NDArray[np.int64] = array.reshape(-1).astype(np.int64)
    good = np.abs(rows) <= 1
    if not good.all():
        row = int((~good).argmax())
        expect(False, "side", "1, -1 or 0", f"{rows[row]} in row {row}")
    return rows


def _codes(sides: NDArray[np.int64]) -> NDArray[np.int64]:
    codes: NDArray[np.int64] = KNOWN * (sides != 0) + ABOVE * (sides > 0)
    return codes
