"""The long work of view factors: rays of rows, and exact pairs. Each row and each pair is independent of the others."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from renderer.studies.factors.pairs import exact_pairs
from renderer.studies.factors.rows import Known, RowHits, Tracing, Update, trace_rows
from renderer.system.terminal import progress_bar

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Work(Protocol):
    """The worker: this process at once, or part by part. The bits are the same."""

    def rows(self, name: str, tracing: Tracing, rows: Integers, known: Known) -> RowHits:
        """As ``trace_rows``; ``name`` is that of this step of the computation."""

    def pairs(self, tracing: Tracing, faces: Integers) -> tuple[Floats, Flags]:
        """As ``face_pairs``."""


class AtOnce:
    """``Work`` in this process at once."""

    def rows(self, name: str, tracing: Tracing, rows: Integers, known: Known) -> RowHits:
        """As ``trace_rows``."""
        with progress_bar(len(rows), "surface", tracing.progress) as update:
            return trace_rows(tracing, rows, known, update)

    def pairs(self, tracing: Tracing, faces: Integers) -> tuple[Floats, Flags]:
        """As ``face_pairs``."""
        with progress_bar(len(faces), "pair", tracing.progress) as update:
            return face_pairs(tracing, faces, update)


def face_pairs(tracing: Tracing, faces: Integers, update: Update = None) -> tuple[Floats, Flags]:
    """The exchange (k,) of pairs of faces (k, 2), the lower first, and which of them are known.

    Of both sides if all faces send from both.
    """
    return exact_pairs(tracing.built, faces, tracing.threads, update, both=tracing.surfaces.two_sided)
