"""A seeded defect."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from validation.defects.changes import Change, Wrapped
from validation.defects.inject import PACKAGE

Group = Literal["hits", "queries", "scenes", "studies", "factors", "lit", "pictures"]


@dataclass(frozen=True)
class Defect:
    """One change of the renderer that the checks of its group must notice."""

    group: Group
    name: str
    change: Change

    @cached_property
    def compiles(self) -> bool:
        """Whether kernels are compiled anew for it, which takes most of its time."""
        return not isinstance(self.change, Wrapped) and self.change.altered(PACKAGE).compiled
