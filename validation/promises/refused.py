"""Whether something is refused as invalid."""

from collections.abc import Callable
from typing import Any


def refuses(ask: Callable[..., Any], *given: Any, **options: Any) -> bool:
    """Whether a call raises ``ValueError``."""
    try:
        ask(*given, **options)
    except ValueError:
        return True
    return False
