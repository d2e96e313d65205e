"""The rows of a long run in parts of equal size on disk, so that a killed run goes on where it stopped.

When all parts are there, the result is made of them and the folder removed. The rows of a part need not follow each
other in the result: an order says which row of it each place of the parts is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from renderer.checkpoints.folder import RunFolder, remove_parts
from renderer.system.files import write_atomically
from renderer.system.terminal import progress_bar

# The number and the values of a part.
Computed = Generator[tuple[int, NDArray[Any]], None, None]
# Of a result that is written at once, where its rows are not in the order of the parts.
_MOST_BYTES = 1 << 26


@dataclass(frozen=True)
class Plan:
    """The shape of a run's result, its parts, and all that it depends on.

    rows       rows of the result: points of a study, or rows of pixels
    size       rows of a part; the last part may have fewer
    width      values of a row; 0: the result has one dimension
    dtype      of the values, as NumPy spells it
    made_of    all that the values depend on: numbers, texts, and digests of arrays
    """

    rows: int
    size: int
    width: int
    dtype: str
    made_of: Mapping[str, Any]

    @property
    def parts(self) -> int:
        """The number of parts; one without rows where the result has none."""
        return max(1, -(-self.rows // self.size))

    def span(self, part: int) -> tuple[int, int]:
        """The places of a part: begin and end."""
        return part * self.size, min(self.rows, (part + 1) * self.size)

    def length(self, part: int) -> int:
        """The number of rows of a part."""
        begin, end = self.span(part)
        return end - begin

    def shape(self, rows: int) -> tuple[int, ...]:
        """The shape of so many rows."""
        return (rows, self.width) if self.width else (rows,)


class Parts:
    """The folder of a run under way."""

    def __init__(self, folder: Path, plan: Plan, order: NDArray[np.int64] | None = None) -> None:
        """Begin a run, or go on with a killed run of the same plan.

        order  (rows,) the row of the result at each place of the parts; None: the same. ``made_of`` of the plan must
               depend on it

        Raises ``ValueError`` if the folder is that of another plan, and says what differs.
        """
        self.folder, self.plan, self.order = folder, plan, order
        self._files = RunFolder(folder, asdict(plan))

    def missing(self) -> list[int]:
        """The parts that are still to be computed."""
        return [part for part in range(self.plan.parts) if self._files.read(_name(part)) is None]

    def complete(self, compute: Callable[[list[int]], Computed], unit: str, progress: bool) -> None:
        """Compute the missing parts and write each when it is done; what is written stays, whatever ends the rest.

        compute   yields number and values of each of the given parts, in any order
        unit      the name of a row in the progress bar
        """
        missing = self.missing()
        with progress_bar(self.plan.rows, unit, progress) as update, closing(compute(missing)) as computed:
            if update is not None:
                update(self.plan.rows - sum(map(self.plan.length, missing)))
            for part, values in computed:
                self.write(part, values)
                if update is not None:
                    update(self.plan.length(part))

    def rows(self, part: int) -> slice | NDArray[np.int64]:
        """The rows of the result that a part has."""
        here = slice(*self.plan.span(part))
        return here if self.order is None else self.order[here]

    def write(self, part: int, values: NDArray[Any]) -> None:
        """Keep a part; of the shape and type of the plan."""
        assert values.shape == self.plan.shape(self.plan.length(part)) and values.dtype == self.plan.dtype
        self._files.write(_name(part), np.ascontiguousarray(values).tobytes())

    def read(self, part: int) -> NDArray[Any]:
        """The values of a part. Raises ``OSError`` if it is absent."""
        values = np.frombuffer(self._files.whole(_name(part)), self.plan.dtype)
        return values.reshape(self.plan.shape(self.plan.length(part)))

    def join(self, path: Path) -> None:
        """Write the result as ``.npy``, block by block. Raises ``OSError`` if a part is absent."""
        write_atomically(path, self._join)

    def joined(self) -> NDArray[Any]:
        """The result in memory."""
        values = np.empty(self.plan.shape(self.plan.rows), self.plan.dtype)
        for part in range(self.plan.parts):
            values[self.rows(part)] = self.read(part)
        return values

    def count(self, value: float) -> int:
        """The number of values of the result that equal this one."""
        return sum(int(np.count_nonzero(self.read(part) == value)) for part in range(self.plan.parts))

    def remove(self) -> None:
        """Remove the folder."""
        remove_parts(self.folder)

    def _join(self, file: BinaryIO) -> None:
        header = {"descr": np.dtype(self.plan.dtype).str, "fortran_order": False,
                  "shape": self.plan.shape(self.plan.rows)}  # fmt: skip
        np.lib.format.write_array_header_1_0(file, header)
        blocks = map(self.read, range(self.plan.parts)) if self.order is None else self._reordered(self.order)
        for values in blocks:
            file.write(values.tobytes())

    def _reordered(self, order: NDArray[np.int64]) -> Iterator[NDArray[Any]]:
        """The result in blocks of little memory; all parts are read for each block."""
        row = max(1, self.plan.width) * np.dtype(self.plan.dtype).itemsize
        most = max(1, _MOST_BYTES // row)
        for first in range(0, self.plan.rows, most):
            values = np.empty(self.plan.shape(min(most, self.plan.rows - first)), self.plan.dtype)
            for part in range(self.plan.parts):
                rows = order[slice(*self.plan.span(part))] - first
                here = (rows >= 0) & (rows < len(values))
                if here.any():
                    values[rows[here]] = self.read(part)[here]
            yield values


def _name(part: int) -> str:
    return f"{part:08d}"


def digest_of(*arrays: NDArray[Any]) -> str:
    """A digest of arrays: of their shapes, types and bytes."""
    found = hashlib.sha256()
    for array in arrays:
        found.update(f"{array.shape} {array.dtype.str};".encode())
        found.update(np.ascontiguousarray(array).data)
    return found.hexdigest()
