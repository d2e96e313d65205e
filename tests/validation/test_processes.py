"""Tasks in several processes: results in order, faults and ends of processes told, none left behind."""

import os
import signal
import subprocess
import sys
import time
from multiprocessing import active_children

import pytest

from renderer.system import child
from validation.processes import Workers


def square(number):
    return number * number, os.getpid()


def fail(number):
    raise KeyError(number)


class UnsendableError(Exception):
    """An error that pickle writes and cannot read."""

    def __init__(self, number, text):
        super().__init__(f"{text} {number}")


def fail_unsendably(number):
    raise UnsendableError(number, "the true words of")


def crash(number):
    os.kill(os.getpid(), signal.SIGKILL)


def wait_for_long(folder):
    (folder / str(os.getpid())).touch()
    time.sleep(600)


@pytest.mark.parametrize("processes", [1, 2])
def test_results_come_in_the_order_of_the_tasks(processes):
    begun = []
    with Workers(processes) as workers:
        found = workers.each(square, list(range(7)), begun.append)
    assert [value for value, _ in found] == [0, 1, 4, 9, 16, 25, 36]
    assert begun == list(range(7))
    others = {process for _, process in found} - {os.getpid()}
    assert bool(others) == (processes > 1) and len(others) <= processes


@pytest.mark.parametrize("processes", [1, 2])
def test_an_error_is_raised_here(processes):
    with pytest.raises(KeyError, match="3"), Workers(processes) as workers:
        workers.each(fail, [3], lambda task: None)
    assert not active_children()


def test_an_error_that_cannot_be_sent_is_told_in_words():
    with pytest.raises(RuntimeError, match="UnsendableError: the true words of 3"), Workers(2) as workers:
        workers.each(fail_unsendably, [3], lambda task: None)


def test_the_end_of_a_process_is_an_error():
    with pytest.raises(ChildProcessError, match="a process for crash ended"), Workers(2) as workers:
        workers.each(crash, [1, 2], lambda task: None)
    assert not active_children()


# Two tasks that do not end by themselves.
_SCRIPT = """
import sys
from pathlib import Path
sys.path.insert(0, {home!r})
from test_processes import Workers, wait_for_long
if __name__ == "__main__":
    with Workers(2) as workers:
        workers.each(wait_for_long, [Path({folder!r})] * 2, lambda task: None)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_no_process_outlives_its_parent(tmp_path, number):
    script = tmp_path / "script.py"
    script.write_text(_SCRIPT.format(home=os.path.dirname(__file__), folder=str(tmp_path)), encoding="utf-8")
    parent = subprocess.Popen([sys.executable, script], env=child.environment(), stderr=subprocess.DEVNULL,
                              preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))  # fmt: skip
    try:
        while len(begun := [int(name.name) for name in tmp_path.iterdir() if name.name.isdigit()]) < 2:
            assert parent.poll() is None
            time.sleep(0.05)
        parent.send_signal(number)
        assert parent.wait(60) != 0
        while any(_runs(process) for process in begun):
            time.sleep(0.05)
    finally:
        parent.kill()


def _runs(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    with open(f"/proc/{process}/stat", encoding="utf-8") as file:
        return file.read().rpartition(")")[2].split()[0] != "Z"
