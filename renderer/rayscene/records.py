"""The records of a scene's instances, object by object, while objects come and go."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.rayscene.built import Members, new_records

Floats = NDArray[np.float64]


class Records:
    """Records (n, INSTANCE_WORDS) of instances, in the order of their objects.

    Those that were added are joined, and those of removed objects taken out, many at once: all takes time in proportion
    to what is added and removed.

    count  the number of instances, without those of removed objects
    """

    def __init__(self, members: Members, array: Floats) -> None:
        self._rows = {m.id: members.rows(m) for m in members}
        self._array, self._added, self._end, self.count = array, list[Floats](), len(array), len(array)

    def add(self, object: int, own: Floats) -> None:
        """Append the records of a new object."""
        self._rows[object] = slice(self._end, self._end + len(own))
        self._added.append(own)
        self._end, self.count = self._end + len(own), self.count + len(own)

    def extend(self, object: int, own: Floats) -> None:
        """Append records to those of an object."""
        kept = self._kept()
        self._renew({**kept, object: np.concatenate([kept[object], own])})

    def remove(self, object: int) -> None:
        """Forget the records of an object."""
        rows = self._rows.pop(object)
        self.count -= rows.stop - rows.start
        if self._end > 2 * self.count:
            self.compact()

    def rows(self, object: int) -> slice:
        """The rows of an object's records in ``array``, until the next removal or ``compact``."""
        return self._rows[object]

    @property
    def array(self) -> Floats:
        """All records, and some of removed objects."""
        if self._added:
            self._array, self._added = np.concatenate([self._array, *self._added]), []
        return self._array

    @array.setter
    def array(self, array: Floats) -> None:
        self._array = array

    def compact(self) -> None:
        """Take the records of removed objects out of ``array``."""
        if self._end > self.count:
            self._renew(self._kept())

    def _kept(self) -> dict[int, Floats]:
        """The records of each object."""
        array = self.array
        return {object: array[rows] for object, rows in self._rows.items()}

    def _renew(self, kept: dict[int, Floats]) -> None:
        self._array, self._end, self.count = new_records(0), 0, 0
        for object, own in kept.items():
            self.add(object, own)
