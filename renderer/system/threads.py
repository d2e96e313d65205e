"""Chunks of independent work on a pool of threads, for kernels that release the GIL.

Safe for concurrent callers, which Numba's ``prange`` on its default layer is not. Ctrl-C stops between chunks.
"""

import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import thread as pools
from functools import cache
from numbers import Integral
from threading import Lock, current_thread

from renderer.errors import expect

# The pool's threads: at least so many, and so many per processor. More would not change results.
_LEAST_POOL, _PER_PROCESSOR = 16, 4
# How the errors of a pool begin whose interpreter ends, or whose system has no more threads.
_NO_THREADS = ("cannot schedule new futures", "can't start new thread")
# Seconds between checks of helpers that have been told to stop, which take milliseconds to do so.
_MOMENT = 0.0005


def available_threads() -> int:
    """Processors that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def checked_threads(threads: int | None) -> int:
    """``threads``, or all available processors for None."""
    if threads is None:
        return available_threads()
    good = isinstance(threads, Integral) and not isinstance(threads, bool) and threads >= 1
    expect(good, "threads", "an integer >= 1 or None", repr(threads))
    return int(threads)


@cache
def _pool() -> ThreadPoolExecutor:
    """The only pool. It starts a thread only where none is idle, so it has no more than were ever busy at once."""
    return ThreadPoolExecutor(max(_LEAST_POOL, _PER_PROCESSOR * available_threads()), thread_name_prefix="renderer")


if hasattr(os, "register_at_fork"):
    # A forked child has the pool but none of its threads.
    os.register_at_fork(after_in_child=_pool.cache_clear)


def for_chunks(
    work: Callable[[int, int], Iterator[None] | None],
    count: int,
    size: int,
    threads: int,
    finished: Callable[[int], object] | None = None,
) -> None:
    """Call ``work(begin, end)`` for every chunk of ``range(count)``, on up to ``threads`` threads.

    Chunks must write to places of their own; then the result does not depend on the threads that run them. Long work is
    a generator that yields where it can be stopped. ``finished(items)`` is called after each chunk, and with 0 where
    one yields, by one thread at a time. On an exception, Ctrl-C included, no further chunk starts, the running ones end
    or stop, and it is raised here. ``work`` must not call ``for_chunks``: it might wait for itself.
    """
    begins = iter(range(0, count, size))
    taking, shared = Lock(), _Shared()

    def tell(items: int) -> None:
        if finished is not None:
            with taking:
                finished(items)

    def take_chunks(helps: bool = False) -> None:
        while not (shared.stopped or (helps and shared.is_left())):
            with taking:
                begin = next(begins, None)
            if begin is None:
                return
            end = min(begin + size, count)
            try:
                for _ in work(begin, end) or ():
                    if shared.stopped:
                        return
                    if helps and shared.is_left():
                        raise RuntimeError("the interpreter ends while a daemon's work is under way")
                    tell(0)
                tell(end - begin)
            except BaseException:
                shared.stopped = True
                raise

    def help_out() -> None:
        with taking:
            if shared.stopped:
                return
            shared.helpers.append(None)
        try:
            take_chunks(helps=True)
        finally:
            shared.helpers.pop()

    running: list[Future[None]] = []
    try:
        # The caller's own thread takes chunks too, so the work starts without waiting for another to wake up.
        _start(help_out, min(threads, -(-count // size)) - 1, running)
        take_chunks()
        for future in running:
            # A helper that has not begun, because other calls keep the pool busy, has nothing left to take.
            if not future.cancel():
                future.result()
    finally:
        _stop_helpers(shared, taking)


class _Shared:
    """The state that the threads of one call share: whether all shall stop, and an entry for each helper at work.

    A daemon's helpers leave it when the interpreter ends, which waits for all threads of pools. A chunk that they had
    begun is an error then; a daemon that lives on, beside other threads, works alone.
    """

    def __init__(self) -> None:
        self.stopped = False
        self.helpers: list[None] = []
        self._daemon = current_thread().daemon

    def is_left(self) -> bool:
        """Whether helpers leave a daemon alone."""
        # The flag by which pools refuse new work then. It is private: without it Ctrl-C waits for a daemon's helpers.
        return self._daemon and getattr(pools, "_shutdown", False)


def _stop_helpers(shared: _Shared, taking: Lock) -> None:
    """Return when no helper is at work any more, whatever signals raise here: they write to memory of the caller's.

    By plain flags: interrupted at the wrong moment, an ``Event`` keeps its lock for good, and a future just submitted
    is lost.
    """
    interrupted: BaseException | None = None
    while True:
        try:
            shared.stopped = True
            with taking:
                pass  # a helper that begins from here on sees it
            while shared.helpers:
                time.sleep(_MOMENT)
            break
        except BaseException as error:  # of Ctrl-C, a time limit, or another handler's
            interrupted = error
    if interrupted is not None:
        raise interrupted


def _start(work: Callable[[], None], count: int, running: list[Future[None]]) -> None:
    """Begin ``work`` on ``count`` threads of the pool, or on fewer: the caller does what is left.

    Adds to ``running`` one by one, so that a signal between two of them loses none.
    """
    pool = _pool()
    for _ in range(count):
        try:
            running.append(pool.submit(work))
        except BaseException as error:
            if isinstance(error, RuntimeError) and str(error).startswith(_NO_THREADS):
                return
            # Of a signal. A thread that started just now may be on no list, and the interpreter would wait for it
            # forever.
            pool.shutdown(wait=False)
            _pool.cache_clear()
            raise
