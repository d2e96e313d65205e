"""Tasks in several processes at once: what Python computes itself takes one processor in each."""

import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children, connection, get_context, parent_process
from pickle import dumps, loads
from types import TracebackType
from typing import Self, TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")


class Workers:
    """So many processes, which the first tasks start; with one it is this one. Used in a ``with`` statement, after
    which none is left.
    """

    def __init__(self, processes: int = 1) -> None:
        self._processes, self._pool = processes, None if processes == 1 else _pool(processes)
        self._others = active_children()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            if error is not None:
                for child in active_children():
                    if child not in self._others:
                        child.kill()
            self._pool.shutdown()

    def each(self, work: Callable[[Task], Result], tasks: Sequence[Task], step: Callable[[Task], None]) -> list[Result]:
        """``work(task)`` of each task, in their order; ``step`` is called with each as it begins.

        Raises what ``work`` raises, and ``ChildProcessError`` where a process ends.
        """
        if self._pool is None:
            return [_one(work, task, step) for task in tasks]
        try:
            return self._all(self._pool, work, tasks, step)
        except BrokenProcessPool as error:
            raise ChildProcessError(f"a process for {work.__qualname__} ended before its task did") from error

    def _all(
        self, pool: ProcessPoolExecutor, work: Callable[[Task], Result], tasks: Sequence[Task],
        step: Callable[[Task], None],
    ) -> list[Result]:  # fmt: skip
        """No task is handed over before a process is free for it, so that ``step`` tells which have begun."""
        waiting = list(enumerate(tasks))[::-1]
        running: dict[Future[Result], int] = {}
        results: dict[int, Result] = {}
        while waiting or running:
            while waiting and len(running) < self._processes:
                index, task = waiting.pop()
                step(task)
                running[pool.submit(_sent, work, task)] = index
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                results[running.pop(future)] = future.result()
        return [results[index] for index in range(len(tasks))]


def _one(work: Callable[[Task], Result], task: Task, step: Callable[[Task], None]) -> Result:
    step(task)
    return work(task)


def _sent(work: Callable[[Task], Result], task: Task) -> Result:
    """``work(task)`` in a child. An error that cannot be sent becomes one of words: the pool would lose it."""
    try:
        return work(task)
    except Exception as error:
        try:
            loads(dumps(error))
        except Exception:
            raise RuntimeError(f"{type(error).__name__}: {error}") from None
        raise


def _pool(processes: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(processes, mp_context=get_context("spawn"), initializer=_begin)


def _begin() -> None:
    """In the child: Ctrl-C, which the terminal sends to it too, ends it without a word; so does its parent's end."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None  # it was spawned
    connection.wait([parent.sentinel])
    os._exit(1)
