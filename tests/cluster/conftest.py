"""A local cluster of two worker processes, one for all tests of a module that kill none of them."""

from collections.abc import Iterator
from typing import Any

import pytest

from renderer.cluster import connected


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with connected(workers=2) as client:
        yield client
