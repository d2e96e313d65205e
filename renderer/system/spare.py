"""Memory of large answers, written again once nobody holds it.

New memory comes in pages that the system clears first: a sixth of the time of coherent rays on two threads.
"""

import sys
from collections.abc import Sequence
from threading import RLock
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Bytes of answers that are kept. Smaller ones come from memory that the allocator keeps anyway; and a process never
# grows by more than the most, of all answers together.
_LEAST, _MOST = 1 << 20, 1 << 26
# The arrays of each answer, the latest last. The first of each is given to nobody; others with no more references than
# it are free. A handler of a signal may ask for arrays meanwhile.
_kept: list[tuple[NDArray[Any], ...]] = []
_lock = RLock()


def empty_arrays(count: int, dtypes: Sequence[np.dtype[Any]]) -> list[NDArray[Any]]:
    """Uninitialised arrays (count,) of these types. Once no reference to any of them is left, they may be given out
    again.
    """
    size = count * sum(dtype.itemsize for dtype in dtypes)
    if not _LEAST <= size <= _MOST:
        return [np.empty(count, dtype) for dtype in dtypes]
    with _lock:
        for k, answer in enumerate(_kept):
            if _is_like(answer, count, dtypes) and _is_free(answer):
                _kept.append(_kept.pop(k))
                return list(answer[1:])  # references, so that the next call sees that they are held
        arrays = [np.empty(count, dtype) for dtype in dtypes]
        _kept.append((np.empty(0), *arrays))
        while sum(array.nbytes for answer in _kept for array in answer) > _MOST:
            del _kept[0]
        return arrays


def _is_like(answer: tuple[NDArray[Any], ...], count: int, dtypes: Sequence[np.dtype[Any]]) -> bool:
    return [array.dtype for array in answer[1:]] == list(dtypes) and len(answer[1]) == count


def _is_free(answer: tuple[NDArray[Any], ...]) -> bool:
    own, *references = [sys.getrefcount(array) for array in answer]
    # rule: answers-not-held
    return max(references) <= own
