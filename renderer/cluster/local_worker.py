"""The start of a worker process of a local cluster: Ctrl-C, which a terminal sends to all, is left to its parent.

Dask imports this module in each of them, and calls ``dask_setup``.
"""

import logging
import signal
from threading import current_thread, main_thread
from typing import Any


def dask_setup(worker: Any) -> None:
    """Ignore SIGINT in this process, and do not tell of each task that its end cancels."""
    if current_thread() is main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.getLogger("distributed.worker.state_machine").setLevel(logging.ERROR)
