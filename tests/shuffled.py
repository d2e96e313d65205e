"""A plugin of pytest (``-p shuffled``): tests in an order that the variable SHUFFLED seeds, as many processors as
PROCESSORS says, if it is set.
"""

import os
import random

import pytest


def pytest_configure() -> None:
    """Before anything is imported that asks for processors."""
    if "PROCESSORS" in os.environ:
        count = int(os.environ["PROCESSORS"])
        os.cpu_count = lambda: count
        os.sched_getaffinity = lambda pid: set(range(count))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The same order in each process, as pytest-xdist needs."""
    random.Random(os.environ["SHUFFLED"]).shuffle(items)
