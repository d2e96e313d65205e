"""Exposure: a picture made brighter or darker by stops, before its colours are encoded."""

import numpy as np
from numpy.typing import NDArray

# Of either sign; 2^100 and 2^-100 are normal numbers of float32.
MAX_STOPS = 100.0


def exposed(radiance: NDArray[np.float32], stops: float) -> NDArray[np.float32]:
    """Linear radiance times 2^``stops``; 0 stops change no bit. The largest float32 stands for anything brighter."""
    if stops == 0.0:
        return radiance
    with np.errstate(over="ignore"):
        return np.minimum(radiance * np.float32(2.0**stops), np.finfo(np.float32).max)
