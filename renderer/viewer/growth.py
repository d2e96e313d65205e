"""The error that is left in the picture of a camera at rest."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.viewer.passes import Pass


class Growth:
    """The colours of one view's picture so far, band by band."""

    def __init__(self) -> None:
        self._colors: dict[int, NDArray[np.uint8]] = {}
        self._squares = 0.0
        self._values = 0

    def add(self, wanted: Pass, colors: NDArray[np.uint8]) -> dict[str, Any] | None:
        """Take the colours of a full picture or a band, (h, w, 3); what is told of a finer picture, after its last.

        Its error is estimated by the root mean square of what four times the samples changed, in 255ths: where errors
        halve with them, as those of edges do or better, what changed is at least what is left.
        """
        first = wanted.band[0] if wanted.band else 0
        if not (wanted.last or wanted.band):
            return None
        if wanted.refines:
            change = colors.astype(np.int32) - self._colors[first]
            self._squares += float((change * change).sum())
            self._values += change.size
        self._colors[first] = colors
        if not (wanted.refines and wanted.last):
            return None
        error, self._squares, self._values = (self._squares / self._values) ** 0.5, 0.0, 0
        return {"type": "refined", "samples": wanted.samples, "error": error}
