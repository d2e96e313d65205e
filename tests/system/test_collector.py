"""The garbage collector's rest ends as it began, whatever happens in it."""

import gc
import os
from collections.abc import Iterator

import pytest

from renderer.collector import resting


@pytest.fixture(autouse=True)
def awake() -> Iterator[None]:
    thresholds = gc.get_threshold()
    yield
    gc.enable()
    gc.unfreeze()
    assert gc.get_threshold() == thresholds


def test_what_another_thread_turns_off_stays_off() -> None:
    with resting():
        gc.disable()
    assert not gc.isenabled()


def test_an_interrupt_at_its_end_leaves_nothing_frozen(monkeypatch: pytest.MonkeyPatch) -> None:
    freeze = gc.freeze

    def interrupted() -> None:
        freeze()
        raise KeyboardInterrupt

    monkeypatch.setattr(gc, "freeze", interrupted)
    with pytest.raises(KeyboardInterrupt), resting():
        assert gc.get_threshold()[0] == 0
    assert gc.get_freeze_count() == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_child_collects_though_it_was_forked_meanwhile() -> None:
    with resting():
        child = os.fork()
        if child == 0:
            os._exit(int(gc.get_threshold()[0] == 0))
    assert os.waitpid(child, 0)[1] == 0
