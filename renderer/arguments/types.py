"""The types of arguments as callers give them."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy.typing

# Lists of lists too, which mypy takes for a ``numpy.typing.ArrayLike`` only where no list mixes int and float rows.
ArrayLike = Sequence[Any] | numpy.typing.ArrayLike

# How boxes of the octree are cut: in the middle, or by the surface area heuristic. The second takes up to a fifth
# longer to build, and saves rays among walls a fifth to a third of their steps.
Split = Literal["midpoint", "sah"]
SPLIT: Split = "sah"
