"""What one run of the suite is asked for, and where its sections say how far they are."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from validation.thresholds import Thresholds


@dataclass(frozen=True)
class Job:
    """Given to every section.

    quick       fewer rays and smaller pictures
    thresholds  where the gates stand
    folder      an existing folder for pictures
    step        called with the name of each step as it begins; a section's ``steps(job)`` says how many there will be
    scenes      scene files of a user, to be judged instead of the suite's own
    meshes      mesh files of a user, to be judged instead of the suite's own
    """

    quick: bool
    thresholds: Thresholds
    folder: Path
    step: Callable[[str], None]
    scenes: tuple[Path, ...] = ()
    meshes: tuple[Path, ...] = ()

    @property
    def own(self) -> bool:
        """Whether the suite judges what it brings along, and not a user's files."""
        return not (self.scenes or self.meshes)
