"""Tasks on a cluster: few at a time, results as they come, and again what was lost with a worker.

Data that tasks share are sent to all workers once. If a worker dies, Dask repeats its tasks, but data that no other
worker has are lost: they are sent again from here. After a scheduler came back, all are sent again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any

from renderer.cluster import clients
from renderer.errors import expect

Results = Generator[tuple[Any, Any], None, None]

# Tasks under way for each thread of the cluster: one that is computed, one that has arrived and waits.
_AHEAD = 2
# Times that a task that raises is tried again, and times that lost data are sent again.
_RETRIES = 5
# Seconds between looks at the cluster while nothing comes.
_MOMENT = 0.5


@dataclass(frozen=True, eq=False)
class Task:
    """A call of the tasks' function: ``function(shared, *arguments)``.

    name     what the caller knows it by
    shared   the data that it shares with others, which have a ``digest``; equal ones are sent once
    """

    name: Any
    shared: Any
    arguments: tuple[Any, ...]


def results(client: Any, function: Callable[..., Any], tasks: Iterable[Task]) -> Results:
    """Name and result of each task, as they come. ``tasks`` are read as needed.

    Raises what a task raises repeatedly, and ``OSError`` if the scheduler is gone or no worker is left for 10 seconds.
    Whatever ends it, tasks under way are cancelled.
    """
    expect(hasattr(client, "nthreads"), "client", "a distributed.Client", type(client).__name__)
    waiting, crew = iter(tasks), _Crew(client, function)
    try:
        while True:
            crew.look()
            for task in islice(waiting, crew.room()):
                crew.submit(task)
            if not crew.under_way:
                return
            yield from crew.finished()
    finally:
        crew.dismiss()


class _Crew:
    """The workers of a client, with what was sent to them and is under way."""

    def __init__(self, client: Any, function: Callable[..., Any]) -> None:
        self._client, self._function = client, function
        self.under_way: dict[Any, Task] = {}
        self._sent: dict[str, Any] = {}
        self._times_sent: dict[str, int] = {}
        self._threads, self._looked = 0, float("-inf")

    def look(self) -> None:
        """Now and then count the threads of the cluster; wait for the first worker, up to a limit."""
        if self._client.status == "running" and time.monotonic() < self._looked + _MOMENT:
            return
        patience = time.monotonic() + clients.SECONDS
        while not (threads := self._count()):
            if self._client.status == "closed" or time.monotonic() > patience:
                raise OSError(self._missing())
            time.sleep(_MOMENT / 10.0)
        self._threads, self._looked = threads, time.monotonic()

    def room(self) -> int:
        """The number of tasks that may begin now."""
        return max(0, _AHEAD * self._threads - len(self.under_way))

    def submit(self, task: Task) -> None:
        """Queue a task, after its data unless workers have them."""
        sent = self._sent.get(task.shared.digest)
        if sent is None or sent.status != "finished":
            sent = self._send(task.shared)
        future = self._client.submit(self._function, sent, *task.arguments, pure=False, retries=_RETRIES)
        self.under_way[future] = task

    def finished(self) -> Iterator[tuple[Any, Any]]:
        """Wait a moment and yield the results of finished tasks; lost tasks start again."""
        from distributed import wait

        # Of tasks that were cancelled, no scheduler, or nothing within the moment: each future's status says more.
        with suppress(CancelledError, OSError, ValueError):
            wait(list(self.under_way), timeout=_MOMENT, return_when="FIRST_COMPLETED")
        for future in [future for future in self.under_way if future.status != "pending"]:
            task = self.under_way.pop(future)
            done, result = self._result(future)
            if done:
                self._times_sent.clear()
                yield task.name, result
            else:
                self._looked = float("-inf")
                self.look()
                self.submit(task)
        self._forget()

    def dismiss(self) -> None:
        """Release tasks and data, so that Dask cancels and drops them.

        Explicitly, as the traceback of an error may hold them for longer.
        """
        for future in [*self.under_way, *self._sent.values()]:
            with suppress(Exception):  # of a client that is closed
                future.release()
        self.under_way.clear()
        self._sent.clear()

    def _result(self, future: Any) -> tuple[bool, Any]:
        """Whether there is a result, and the result; a lost task has none. Raises what the task raised."""
        from distributed import KilledWorker

        raised = future.status == "error"
        if future.status != "finished" and not raised:
            return False, None
        try:
            return True, future.result(timeout=clients.SECONDS)
        except KilledWorker as error:
            ended = f"ended {error.allowed_failures + 1} workers, one after the other"
            raise OSError(f"a part {ended}; is their memory too small for it?") from None
        except (CancelledError, OSError):  # its worker died after all, or the scheduler
            if raised:
                raise
            return False, None

    def _send(self, shared: Any) -> Any:
        """Send data to all workers, again if workers die meanwhile."""
        while True:
            times = self._times_sent[shared.digest] = self._times_sent.get(shared.digest, 0) + 1
            if times > 1 + _RETRIES:
                lost = f"lost what it was sent {times - 1} times, before any result came"
                raise OSError(f"the cluster at {self._address()} {lost}")
            try:
                # In a list, as the parts of a tuple would be sent one by one. By reference where a worker is this
                # process, so never written.
                [sent] = self._client.scatter([shared], broadcast=True, hash=False, timeout=clients.SECONDS)
            except (CancelledError, OSError):  # workers or the scheduler died meanwhile
                self._looked = float("-inf")
                self.look()
            else:
                self._sent[shared.digest] = sent
                return sent

    def _forget(self) -> None:
        """Let workers drop data that no task needs, except the latest."""
        needed = {task.shared.digest for task in self.under_way.values()}
        for digest in list(self._sent)[:-1]:
            if digest not in needed:
                del self._sent[digest]

    def _count(self) -> int:
        """The threads of all workers; 0 without workers or scheduler."""
        if self._client.status != "running":
            return 0
        with suppress(OSError):  # that it ends just now
            return sum(self._client.nthreads().values())
        return 0

    def _missing(self) -> str:
        what = "has no worker" if self._client.status == "running" else "does not answer"
        return f"the scheduler at {self._address()} {what}, for {clients.SECONDS} seconds"

    def _address(self) -> str:
        return str(self._client.scheduler.address) if self._client.scheduler is not None else "its address"
