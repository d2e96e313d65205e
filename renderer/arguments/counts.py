"""Arguments that are whole numbers: of Python or NumPy, and not True or False."""

from math import inf
from numbers import Integral
from typing import Any


def is_count(value: object, least: int = 0, most: float = inf) -> bool:
    """Whether it is an integer from ``least`` to ``most``."""
    return isinstance(value, Integral) and not isinstance(value, bool) and least <= int(value) <= most


def count_argument(argument: str, value: Any, least: int = 0, most: float = inf, alternative: str = "") -> int:
    """An integer from ``least`` to ``most``. Raises ``ValueError`` that names the argument for anything else.

    alternative  ends the error's text where the argument takes something else too, such as " or None"
    """
    if not is_count(value, least, most):
        expected = f"an integer >= {least}" if most == inf else f"an integer from {least} to {most}"
        raise ValueError(f"{argument}: expected {expected}{alternative}, got {value!r}")
    return int(value)
