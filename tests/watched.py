"""A client of Dask whose calls a test hears of, or stops."""

from collections.abc import Callable
from typing import Any


class Watched:
    """``client``, with ``before(name)`` called whenever its ``submit`` or ``scatter`` is taken."""

    def __init__(self, client: Any, before: Callable[[str], object]) -> None:
        self._client, self._before = client, before

    def __getattr__(self, name: str) -> Any:
        if name in ("submit", "scatter"):
            self._before(name)
        return getattr(self._client, name)
