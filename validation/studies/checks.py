"""Checks that count answers which are not as they must be."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

# How many answers there are, and how many of them are wrong.
Asked = tuple[int, int]


class Check(NamedTuple):
    """A law, and the public names that it judges."""

    ask: Callable[[], Asked]
    judged: tuple[str, ...]


def counted(same: Any) -> Asked:
    """The answers, and those that are not the same."""
    right = np.asarray(same)
    return right.size, int((~right).sum())


def row_of(name: str, check: Check) -> dict[str, Any]:
    """A row of the report: answers, and how many are not as they must be."""
    asked, wrong = check.ask()
    says = " ".join((check.ask.__doc__ or "").split())
    return {"subject": name, "says": says, "asked": asked, "wrong": wrong, "judged": check.judged}
