"""Chunks on threads: all of them once, exceptions out, no more work after one, and safe for several callers."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from cases import cases

from renderer.system import threads as parallel
from renderer.system.threads import available_threads, checked_threads, for_chunks

pytestmark = pytest.mark.judges("Octree", "PreparedScene.picture", "octree-render render --threads", "render")


@cases("threads", [1, 2, 5])
@cases("count, size", [(0, 4), (1, 4), (4, 4), (5, 4), (1000, 7), (3, 100)])
def test_every_item_is_worked_on_once(count, size, threads):
    times = np.zeros(count, int)
    ends = []

    def work(begin, end):
        assert 0 <= begin < end <= count and end - begin <= size
        times[begin:end] += 1

    for_chunks(work, count, size, threads, ends.append)
    assert (times == 1).all() and sum(ends) == count and len(ends) == -(-count // size)


@cases("threads", [1, 2, 5])
@cases("error", [ZeroDivisionError, KeyboardInterrupt, SystemExit])
def test_an_exception_comes_out_and_stops_the_rest(error, threads):
    done = []

    def work(begin, end):
        if begin == 10:
            raise error("chunk 10")
        time.sleep(0.001)
        done.append(begin)

    with pytest.raises(error, match="chunk 10"):
        for_chunks(work, 1000, 1, threads)
    # Those before it in order, and one running on each other thread.
    assert len(done) <= 10 + 2 * threads
    after = len(done)
    time.sleep(0.02)
    assert len(done) == after
    # The pool lives on.
    for_chunks(lambda begin, end: done.append(begin), 20, 1, threads)
    assert len(done) == after + 20


def test_an_exception_in_finished_of_one_thread_stops_the_others():
    # The thread that runs on is the one whose result is waited for first.
    done, failed = [], threading.Event()

    def work(begin, end):
        time.sleep(0.001)
        done.append(begin)

    def finished(items):
        if not failed.is_set() and threading.current_thread() is not first[0]:
            failed.set()
            raise ZeroDivisionError("finished")

    first = [None]

    def note_first(begin, end):
        if first[0] is None:
            first[0] = threading.current_thread()
        work(begin, end)

    with pytest.raises(ZeroDivisionError):
        for_chunks(note_first, 500, 1, 2, finished)
    assert len(done) < 100


def test_ctrl_c_in_the_caller_stops_within_a_chunk():
    done = []

    def work(begin, end):
        if begin == 5:
            os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.005)
        done.append(begin)

    with pytest.raises(KeyboardInterrupt):
        for_chunks(work, 400, 1, 2)
    # The main thread sees the signal when it next wakes.
    assert len(done) < 100
    after = len(done)
    time.sleep(0.03)
    assert len(done) == after


@pytest.mark.parametrize("threads", [2, 3])
def test_concurrent_callers_do_not_disturb_one_another(threads):
    def call(number):
        out = np.zeros(500, int)

        def work(begin, end):
            out[begin:end] = number
            if number % 5 == 4 and begin == 40:
                raise ValueError(f"caller {number}")

        try:
            for_chunks(work, 500, 10, threads)
        except ValueError as error:
            return str(error) == f"caller {number}"
        return number % 5 != 4 and (out == number).all()

    with ThreadPoolExecutor(8) as callers:
        assert all(callers.map(call, range(60)))


def test_threads(monkeypatch):
    """All processors by default: five here, as a machine may have but one."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {3, 4, 9, 11, 12}, raising=False)
    assert available_threads() == checked_threads(None) == 5 and checked_threads(3) == 3
    for bad in (0, -1, 1.5, "2"):
        with pytest.raises(ValueError, match="threads: expected an integer >= 1 or None, got"):
            checked_threads(bad)


@pytest.mark.parametrize("threads", [1, 3])
def test_long_work_tells_that_it_goes_on_and_may_be_stopped_there(threads):
    told, ended = [], []

    def work(begin, end):
        for _ in range(10**6):
            yield
        ended.append(begin)

    def finished(items):
        told.append(items)
        if len(told) == 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        for_chunks(work, 4, 1, threads, finished)
    assert told == [0] * 20
    assert not ended


def test_there_is_one_pool_however_many_threads_are_asked_for():
    def helpers():
        return sum(thread.name.startswith("renderer") for thread in threading.enumerate())

    for threads in (2, 3, 5, 8, 700, 7, 2):
        for_chunks(lambda begin, end: time.sleep(0.001), 1000, 1, threads)
    assert 1 <= helpers() <= max(16, 4 * available_threads())


AFTER_THE_END = """
import threading, atexit, sys
import numpy as np
from renderer import Octree
from renderer.mesh.shapes import icosphere
rays = np.random.default_rng(1).normal(size=(40_000, 3)) * 3
octree = Octree.from_mesh(icosphere(3), threads=2)
def ask():
    print(int(octree.closest_hit(rays, -rays).hit.sum()), Octree.from_mesh(icosphere(5), threads=2).stats.faces)
def late():
    threading.main_thread().join()
    ask()
{how}
"""


@pytest.mark.parametrize("how", ["threading.Thread(target=late).start()", "ask(); atexit.register(ask)"])
def test_queries_work_after_the_main_thread_has_ended(how):
    done = subprocess.run(
        [sys.executable, "-P", "-c", AFTER_THE_END.format(how=how)],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert set(done.stdout.splitlines()) == {"40000 20480"}
    assert "Error" not in done.stderr


@pytest.mark.parametrize("submitted", [0, 1, 2])
def test_control_c_while_threads_start_stops_those_that_did(monkeypatch, submitted):
    """A thread that nobody stops would go on for hours, and the process with it."""
    begun, released = threading.Event(), threading.Event()
    sound, count = ThreadPoolExecutor.submit, [0]

    def submit(pool, work):
        future = sound(pool, work)
        if count[0] == submitted:
            assert begun.wait(10)
            raise KeyboardInterrupt
        count[0] += 1
        return future

    def work(begin, end):
        begun.set()
        while not released.wait(0.001):
            yield

    monkeypatch.setattr(ThreadPoolExecutor, "submit", submit)
    with pytest.raises(KeyboardInterrupt):
        for_chunks(work, 100, 1, 5)
    monkeypatch.undo()
    # Whoever is still at it holds a thread of the pool: all of them are free again.
    together = threading.Barrier(4)

    def meet(begin, end):
        together.wait(timeout=10)

    for_chunks(meet, 4, 1, 4)
    released.set()


INTERRUPTED = """
import signal, threading
from renderer.system.threads import for_chunks
def handler(number, frame):
    raise {error}
signal.signal(signal.SIGINT, handler)
start = threading.Thread.start
def interrupted(self):
    start(self)
    if self.name.startswith("renderer"):
        signal.raise_signal(signal.SIGINT)
threading.Thread.start = interrupted
try:
    for_chunks(lambda begin, end: None, 100, 1, 4)
except {error}:
    threading.Thread.start = start
    for_chunks(lambda begin, end: print(begin), 1, 1, 4)
"""


@cases("error", ["KeyboardInterrupt", "TimeoutError", "SystemExit", "RuntimeError"])
def test_a_signal_while_a_thread_starts_leaves_none_that_the_interpreter_waits_for(error):
    """The thread was on no list, so nobody woke it, and the process said that it was interrupted and never ended."""
    command = [sys.executable, "-c", INTERRUPTED.format(error=error)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "0\n"


@pytest.mark.parametrize("error", [KeyboardInterrupt, TimeoutError, SystemExit])
def test_no_helper_is_left_at_work_whatever_a_signal_raises(monkeypatch, error):
    """A second signal comes while the helpers of the first are waited for: they write to the caller's memory."""
    at_work, sound, slept = [], parallel.time.sleep, []

    def work(begin, end):
        at_work.append(begin)
        if threading.current_thread() is threading.main_thread():
            while len(at_work) < 2:
                sound(0.001)
            raise ZeroDivisionError
        sound(0.05)
        at_work.clear()

    def sleep(seconds):
        slept.append(seconds)
        if len(slept) == 2:
            raise error
        sound(seconds)

    monkeypatch.setattr(parallel.time, "sleep", sleep)
    with pytest.raises(error):
        for_chunks(work, 2, 1, 2)
    assert len(slept) > 2 and not at_work


DAEMON_LIVES_ON = """
import threading, time
import numpy as np
from renderer import BruteForce, Octree
from renderer.mesh.shapes import icosphere
rays = np.random.default_rng(1).normal(size=(40_000, 3)) * 3
octree = Octree.from_mesh(icosphere(3), threads=2)
expected, done = octree.closest_hit(rays, -rays), threading.Event()
def daemon():
    threading.main_thread().join()
    hits = octree.closest_hit(rays, -rays)
    print((hits.t == expected.t).all(), Octree.from_mesh(icosphere(5), threads=2).stats.faces)
    done.set()
threading.Thread(target=daemon, daemon=True).start()
threading.Thread(target=done.wait, args=(60,)).start()
"""


def test_a_daemon_that_outlives_the_main_thread_gets_right_answers():
    done = subprocess.run(
        [sys.executable, "-P", "-c", DAEMON_LIVES_ON], capture_output=True, text=True, check=True, timeout=120
    )
    assert done.stdout == "True 20480\n", done.stderr
