"""Functions that tests ask the same again and again."""

from collections.abc import Callable, Hashable
from typing import Any


def remembered(function: Callable[..., Any], key: Callable[..., Hashable]) -> Callable[..., Any]:
    """``function``, called once for arguments of the same ``key``."""
    known: dict[Hashable, Any] = {}

    def once(*arguments: Any, **options: Any) -> Any:
        asked = key(*arguments, **options)
        if asked not in known:
            known[asked] = function(*arguments, **options)
        return known[asked]

    return once
