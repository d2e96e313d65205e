"""The connection to a cluster: one that runs, or a local one of a worker process for each processor."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from renderer.errors import expect, extra_hint
from renderer.system.threads import checked_threads

# To wait for a scheduler's answer.
SECONDS = 10


@contextmanager
def connected(address: str | None = None, *, workers: int | None = None) -> Iterator[Any]:
    """A ``distributed.Client`` of a running cluster, or of a local one that ends with the ``with`` block.

    Parameters
    ----------
    address : str, optional
        The scheduler's address, such as ``"tcp://host:8786"``. By default a local cluster is started.
    workers : int, optional
        The processes of a local cluster, of one thread each. By default one for each processor.

    Yields
    ------
    distributed.Client

    Raises
    ------
    ImportError
        If the extra ``cluster`` is not installed.
    ValueError
        If `address` is no address, or if `workers` are given for a cluster that runs already.
    OSError
        If no scheduler answers.

    Examples
    --------
    >>> from renderer.cluster import connected
    >>> with connected(workers=1) as client:
    ...     len(client.scheduler_info()["workers"])
    1
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise ImportError(f"a cluster needs the package distributed; {extra_hint('cluster')}") from error
    if address is not None:
        expect(workers is None, "workers", "None, as the cluster has its own", repr(workers))
        with Client(_checked_address(address), timeout=SECONDS) as client:
            yield client
        return
    count = checked_threads(workers)
    with (
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
            preload=["renderer.cluster.local_worker"],
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def _checked_address(address: object) -> str:
    """An address as Dask reads it. Raises ``ValueError`` for what is none, which Dask would first wait for."""
    from distributed.comm import get_address_host, parse_address, unparse_address

    expected = "a scheduler's, such as 'tcp://host:8786'"
    expect(isinstance(address, str), "address", expected, type(address).__name__)
    try:
        whole: str = unparse_address(*parse_address(address))
        get_address_host(whole)
    except ValueError as error:
        raise ValueError(f"address: expected {expected}, got {address!r}: {error}") from None
    return whole
