"""The types of arguments as callers give them."""

from collections.abc import Sequence
from typing import Any

import numpy.typing

# Lists of lists too, which mypy takes for a ``numpy.typing.ArrayLike`` only where no list mixes int and float rows.
ArrayLike = Sequence[Any] | numpy.typing.ArrayLike
