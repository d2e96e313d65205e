"""Compressed rows: the entries of all rows one after the other, and where each row begins."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def firsts_of(lengths: ArrayLike) -> NDArray[np.int64]:
    """The places (n + 1,) where rows of these lengths (n,) begin, and the end of the last."""
    return np.concatenate([[0], np.cumsum(np.asarray(lengths, np.int64))])
