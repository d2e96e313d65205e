"""Chunks of independent work on a pool of threads, for kernels that release the GIL.

Safe for concurrent callers, which Numba's ``prange`` on its default layer is not. Ctrl-C stops between chunks.
"""

import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from threading import Lock

from renderer.arguments.counts import count_argument

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
    return available_threads() if threads is None else count_argument("threads", threads, 1, alternative=" or None")


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
    chunks, running = _Chunks(work, count, size, finished), list[Future[None]]()
    try:
        # The caller's own thread takes chunks too, so the work starts without waiting for another to wake up.
        _start(chunks.help, min(threads, -(-count // size)) - 1, running)
        chunks.take()
        for future in running:
            # A helper that has not begun, because other calls keep the pool busy, has nothing left to take.
            if not future.cancel():
                future.result()
    finally:
        chunks.stop()


class _Chunks:
    """The chunks of one call, which several threads take; by plain flags, as no signal can lose these."""

    def __init__(
        self,
        work: Callable[[int, int], Iterator[None] | None],
        count: int,
        size: int,
        finished: Callable[[int], object] | None,
    ) -> None:
        self._work, self._count, self._size, self._finished = work, count, size, finished
        self._begins = iter(range(0, count, size))
        self._lock = Lock()
        self._stopped = False
        self._helpers: list[None] = []  # an entry for each at work

    def take(self) -> None:
        """Work on chunks until none is left or all shall stop."""
        while not self._stopped:
            with self._lock:
                begin = next(self._begins, None)
            if begin is None:
                return
            end = min(begin + self._size, self._count)
            try:
                for _ in self._work(begin, end) or ():
                    if self._stopped:
                        return
                    self._tell(0)
                self._tell(end - begin)
            except BaseException:
                self._stopped = True
                raise

    def help(self) -> None:
        """``take`` on a thread that ``stop`` waits for."""
        with self._lock:
            if self._stopped:
                return
            self._helpers.append(None)
        try:
            self.take()
        finally:
            self._helpers.pop()

    def stop(self) -> None:
        """Return when no helper is at work any more, whatever signals raise here: they write to the caller's memory.

        Interrupted at the wrong moment, an ``Event`` keeps its lock for good, and a future just submitted is lost.
        """
        interrupted: BaseException | None = None
        while True:
            try:
                self._stopped = True
                with self._lock:
                    pass  # a helper that begins from here on sees it
                while self._helpers:
                    time.sleep(_MOMENT)
                break
            except BaseException as error:  # of Ctrl-C, a time limit, or another handler's
                interrupted = error
        if interrupted is not None:
            raise interrupted

    def _tell(self, items: int) -> None:
        if self._finished is not None:
            with self._lock:
                self._finished(items)


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
