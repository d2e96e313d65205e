"""Transforms of instances, checked and written to their records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.octree import LARGEST
from renderer.rayscene.placing import STEEPEST, place
from renderer.trace.instances import INSTANCE_WORDS, OBJECT
from renderer.trace.layout import SCALE

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_IDENTITY = np.eye(4)[:3]


def as_transforms(transforms: ArrayLike | None) -> Floats:
    """Transforms as (k, 3, 4) float64; the identity for None."""
    given = _IDENTITY if transforms is None else real_argument("transforms", transforms)
    fits = given.ndim in (2, 3) and given.shape[-2:] in ((3, 4), (4, 4))
    expect(fits, "transforms", "shape (3, 4), (4, 4), (k, 3, 4) or (k, 4, 4)", f"shape {given.shape}")
    with np.errstate(over="ignore", invalid="ignore"):  # what float64 cannot hold is rejected just below
        matrices = np.array(given, np.float64).reshape(-1, *given.shape[-2:])
    good = np.isfinite(matrices).all(axis=(1, 2))
    if matrices.shape[1] == 4:
        good &= (matrices[:, 3] == [0.0, 0.0, 0.0, 1.0]).all(axis=1)
    if not good.all():
        row = int((~good).argmax())
        expect(False, "transforms", "finite matrices, the last row 0 0 0 1", f"{matrices[row].tolist()} in row {row}")
    return np.ascontiguousarray(matrices[:, :3])


def place_records(object_: Ints, records: Floats, matrices: Floats) -> None:
    """Write the records of instances of an object. Raises ``ValueError`` naming one that cannot be placed."""
    bad = _place(object_, records, matrices, 0)
    if bad >= 0:
        scale = float(object_.view(np.float64)[SCALE])
        factors = f"factors of the mesh's lengths from {scale / STEEPEST:.3g} to {scale * STEEPEST:.3g}"
        expected = f"matrices that can be inverted, with coordinates up to {LARGEST:.3g} and {factors}"
        expect(False, "transforms", expected, f"{matrices[bad].tolist()} for instance {bad}")


def can_be_inverted(object_: Ints, matrices: Floats) -> NDArray[np.bool_]:
    """Whether ``place_records`` takes each of the matrices, (k,)."""
    records, good = np.zeros((len(matrices), INSTANCE_WORDS)), np.ones(len(matrices), np.bool_)
    bad = -1
    while (bad := _place(object_, records, matrices, bad + 1)) >= 0:
        good[bad] = False
    return good


def _place(object_: Ints, records: Floats, matrices: Floats, begin: int) -> int:
    words = records.view(np.int64)
    words[:, OBJECT] = object_.ctypes.data
    bad: int = place(matrices, records, words, begin, len(records))
    return bad
