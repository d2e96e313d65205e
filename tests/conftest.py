"""Settings that all tests share."""

import signal
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import settings

from renderer.system.threads import available_threads
from validation import timing

# The same examples on every machine; no deadline, because a first call compiles.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.load_profile("fixed")

# No test judges a time that was measured, so none waits for other contenders' threads to come to rest.
timing.REST = 0.0

# A job in the background inherits SIGINT ignored, and would hand that on to the processes that tests interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_xdist_auto_num_workers() -> int:
    """Twice as many as processors: many tests wait for processes of their own."""
    return 2 * available_threads()


@pytest.fixture
def mitsuba() -> ModuleType:
    """Mitsuba in its scalar variant. On one processor its reader of EXR would wait for ever for a second thread."""
    import drjit
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    drjit.set_thread_count(max(2, drjit.thread_count()))
    return mitsuba


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the meshes of the scene whose fields are varied."""
    from varied import write_meshes

    folder = tmp_path_factory.mktemp("varied")
    write_meshes(folder)
    return folder
