"""FLIP: how visible a difference is to a viewer who flips between two pictures (Andersson et al. 2020, LDR-FLIP).

It filters both pictures by the eye's contrast sensitivity, so it measures errors of colour over an area where SSIM
measures structure. The package flip-evaluator is NVIDIA's own code.
"""

from typing import Any

import flip_evaluator
import numpy as np
from numpy.typing import NDArray

# The paper's viewer: 0.7 m from a display 3840 pixels and 0.7 m wide.
_PIXELS_PER_DEGREE = 67.0


def flip_map(ours: NDArray[np.floating[Any]], reference: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """FLIP of each pixel, (h, w) float32, from 0 (equal) to 1; both pictures are (h, w, 3) sRGB in [0, 1].

    Each pixel is computed alone, so the map has the same bits in every run. The package's own mean is a sum in float32:
    take the mean of the map instead.
    """
    pictures = (np.ascontiguousarray(picture, np.float32) for picture in (reference, ours))
    error, _, _ = flip_evaluator.evaluate(
        *pictures, "LDR", applyMagma=False, computeMeanError=False, parameters={"ppd": _PIXELS_PER_DEGREE}
    )
    return np.asarray(error, np.float32)[..., 0]
