"""Tasks in several processes at once: what Python computes itself takes one processor in each."""

import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children, connection, get_context, parent_process
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")


def each(
    work: Callable[[Task], Result], tasks: Sequence[Task], processes: int, step: Callable[[Task], None]
) -> list[Result]:
    """``work(task)`` of each task, in their order; ``step`` is called with each as it begins.

    With one process it is this one. Raises what ``work`` raises, and ``RuntimeError`` where a process ends; no process
    is left behind.
    """
    if processes == 1:
        return [_one(work, task, step) for task in tasks]
    others = active_children()
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn"), initializer=_begin) as pool:
        try:
            return _all(work, tasks, pool, processes, step)
        except BaseException as error:
            for child in active_children():
                if child not in others:
                    child.kill()
            if isinstance(error, BrokenProcessPool):
                raise RuntimeError(f"a process for {work.__name__} ended before its task did") from error
            raise


def _one(work: Callable[[Task], Result], task: Task, step: Callable[[Task], None]) -> Result:
    step(task)
    return work(task)


def _all(
    work: Callable[[Task], Result], tasks: Sequence[Task], pool: ProcessPoolExecutor, processes: int,
    step: Callable[[Task], None],
) -> list[Result]:  # fmt: skip
    """No task is handed over before a process is free for it, so that ``step`` tells which have begun."""
    waiting = list(enumerate(tasks))[::-1]
    running: dict[Future[Result], int] = {}
    results: dict[int, Result] = {}
    while waiting or running:
        while waiting and len(running) < processes:
            index, task = waiting.pop()
            step(task)
            running[pool.submit(work, task)] = index
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            results[running.pop(future)] = future.result()
    return [results[index] for index in range(len(tasks))]


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
