"""A client of Dask whose calls a test hears of, or stops; and what answers in the place of a cluster."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any


class Watched:
    """``client``, with ``before(name)`` called whenever its ``submit`` or ``scatter`` is taken."""

    def __init__(self, client: Any, before: Callable[[str], object]) -> None:
        self._client, self._before = client, before

    def __getattr__(self, name: str) -> Any:
        if name in ("submit", "scatter"):
            self._before(name)
        return getattr(self._client, name)


def results_here(_client: object, function: Callable[..., Any], tasks: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
    """What ``renderer.cluster.tasks.results`` gives, computed in this process."""
    for task in tasks:
        yield task.name, function(task.shared, *task.arguments)
