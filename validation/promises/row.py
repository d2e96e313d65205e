"""A row of the section: a promise, how often it was checked, how often it was broken, and who judged."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def row(promise: str, judge: str, kept: NDArray[np.bool_]) -> dict[str, Any]:
    """The row of a promise that was kept where ``kept`` says so; one that was never checked was broken.

    An empty array has any type, as that of an empty list does: where no ray hits, a judge of hits has none to judge.
    """
    broken = int(np.count_nonzero(~kept)) if kept.size else 1
    return {"promise": promise, "judge": judge, "asked": int(kept.size), "broken": broken}


def figure(promise: str, judge: str, quantity: str, value: float, most: float) -> dict[str, Any]:
    """The row of a promise that a quantity, which becomes that of its gate, is at most so much."""
    return row(promise, judge, np.array([value <= most])) | {"figure": [quantity, value, most]}
