"""``--cluster``: the option, the cluster that it names, and pictures on it."""

import argparse
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from renderer.errors import expect
from renderer.system.terminal import say

_CLUSTER = (
    "run on the Dask cluster of the scheduler at ADDRESS; without ADDRESS, or with 'local', on a local cluster with a "
    "worker for each processor"
)


def add_cluster(command: argparse.ArgumentParser) -> None:
    """Add the option to a command."""
    command.add_argument("--cluster", nargs="?", const="local", metavar="ADDRESS", help=_CLUSTER)


@contextmanager
def on_cluster(options: argparse.Namespace) -> Iterator[Any]:
    """The client of the cluster that ``options`` name; says where its dashboard is.

    ``options.threads`` are the workers of a local one.
    """
    from renderer.cluster import connected

    local = options.cluster == "local"
    with (
        connected(None if local else options.cluster, workers=options.threads if local else None) as client,
        _without_logs(),
    ):
        if not options.quiet:
            say(f"dashboard: {client.dashboard_link}", flush=True)
        yield client


def render_on_cluster(scene: Any, asked: dict[str, Any], options: argparse.Namespace) -> tuple[Any, Any]:
    """The run of a picture whose arguments are ``asked``, when all its parts are there, and the picture."""
    import time

    from renderer.checkpoints.folder import naming_parts
    from renderer.checkpoints.study import folder_of
    from renderer.cluster import render_on

    own = options.cluster == "local" or options.threads is None
    expect(own, "--threads", "none, as the cluster has its own", str(options.threads))
    folder, began = folder_of(options.output), time.perf_counter()
    with naming_parts(folder), on_cluster(options) as client:
        run = render_on(client, scene, folder, progress=not options.quiet, **asked)
    return run, run.image(time.perf_counter() - began)


@contextmanager
def _without_logs() -> Iterator[None]:
    """Keep Dask's log of workers that died to itself: what matters comes as an error, on one line."""
    handlers = logging.getLogger("distributed").handlers
    levels = [handler.level for handler in handlers]
    for handler in handlers:
        handler.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for handler, level in zip(handlers, levels, strict=True):
            handler.setLevel(level)
