"""Memory of large answers, used again when nobody holds them: new pages take the system as long as a part of the rays.

Each array has a block of its own, so that who keeps one of an answer's arrays keeps no other alive.
"""

from collections import deque
from contextlib import suppress
from sys import getrefcount
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Smaller arrays are at hand in ``malloc``, which takes larger ones from the system each time.
_LEAST = 1 << 17
# The most bytes of all blocks that are kept, in use or not: two answers for a million rays and a half.
MOST = 1 << 27
# A block serves arrays of at least so much of it, because who holds such an array holds the block.
_LEAST_SHARE = 0.5

_blocks: deque[NDArray[np.uint8]] = deque()
_held = [np.empty(0, np.uint8)]
_UNUSED = getrefcount(_held[0])


def recycled(count: int, dtype: Any = np.float64) -> NDArray[Any]:
    """``np.empty(count, dtype)``, perhaps in the memory of an earlier one that nobody holds any more."""
    size = count * np.dtype(dtype).itemsize
    if not _LEAST <= size <= MOST:
        return np.empty(count, dtype)
    block = _unused(size)
    array: NDArray[Any] = block[:size].view(dtype)
    # Only now, when the array counts as its user, may another thread find the block.
    _blocks.append(block)
    _forget_oldest()
    return array


def _unused(size: int) -> NDArray[np.uint8]:
    """A block of ``size`` bytes or some more, which is in ``_blocks`` no longer."""
    with suppress(IndexError):  # other threads may have taken the rest
        for _ in range(len(_blocks)):
            held = [_blocks.popleft()]
            if getrefcount(held[0]) == _UNUSED:
                if not _is_as_made(held[0]):
                    continue
                if _LEAST_SHARE * held[0].nbytes <= size <= held[0].nbytes:
                    return held[0]
            _blocks.append(held[0])
    return np.empty(size, np.uint8)


def _is_as_made(block: NDArray[np.uint8]) -> bool:
    """Whether nobody has changed a block, which is the ``base`` of arrays in it."""
    return block.flags.writeable and block.ndim == 1 and block.dtype == np.uint8


def _forget_oldest() -> None:
    excess = sum(block.nbytes for block in list(_blocks)) - MOST
    with suppress(IndexError):
        while excess > 0:
            excess -= _blocks.popleft().nbytes
