"""The job of one run: its options, thresholds and folder, and the callback by which sections report progress."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from validation.processes import Workers
from validation.thresholds import Thresholds


class Task(NamedTuple):
    """One step of a section: what a progress bar shows, and a call whose result can be sent to another process."""

    name: str
    do: Callable[[], Any]


def _done(task: Task) -> Any:
    return task.do()


@dataclass(frozen=True)
class Job:
    """The input of every section.

    quick       fewer rays and smaller pictures
    thresholds  the gates' thresholds
    folder      an existing folder for pictures
    step        called with the name of each step as it begins; a section's ``steps(job)`` is the number of calls
    scenes      a user's scene files, to be judged instead of the suite's own
    meshes      a user's mesh files, to be judged instead of the suite's own
    seed        of what the section of random scenes draws
    say         called with a line that a user should read before the report
    workers     the processes for tasks whose time is at most reported, as a cost
    """

    quick: bool
    thresholds: Thresholds
    folder: Path
    step: Callable[[str], None]
    scenes: tuple[Path, ...] = ()
    meshes: tuple[Path, ...] = ()
    seed: int = 1
    workers: Workers = field(default_factory=Workers)
    say: Callable[[str], None] = lambda _: None

    @property
    def own(self) -> bool:
        """Whether the run judges the suite's own scenes and meshes and not a user's files."""
        return not (self.scenes or self.meshes)

    def each(self, tasks: Sequence[Task]) -> list[Any]:
        """The results of tasks, in their order, several at once in the job's processes; a step for each."""
        return self.workers.each(_done, tasks, lambda task: self.step(task.name))
