"""Whether something is refused as invalid, and what is said then."""

from collections.abc import Callable
from typing import Any


def refused(ask: Callable[..., Any], *given: Any, **options: Any) -> str | None:
    """The message of a call's ``ValueError``; None where it is answered."""
    try:
        ask(*given, **options)
    except ValueError as error:
        return str(error)
    return None


def refuses(ask: Callable[..., Any], *given: Any, **options: Any) -> bool:
    """Whether a call raises ``ValueError``."""
    return refused(ask, *given, **options) is not None
