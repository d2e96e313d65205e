"""The sections of the suite: their names and modules, and the choice of those that a run executes."""

from collections.abc import Collection
from typing import Literal, NamedTuple


class Section(NamedTuple):
    """A section's module has ``steps(job) -> int`` and ``run(job) -> (record, gates)``.

    ``judges`` is the kind of user file that the section can judge, given by ``--scene`` or ``--mesh``; None for
    neither.
    """

    name: str
    module: str
    judges: Literal["scene", "mesh"] | None = None


# In the report's order.
SECTIONS = (
    Section("images", "validation.pictures.section", "scene"),
    Section("hits", "validation.hits.section", "mesh"),
    Section("queries", "validation.queries.section"),
    Section("studies", "validation.studies.section"),
    Section("promises", "validation.promises.section"),
    Section("stability", "validation.stability.section"),
    Section("random", "validation.random.section"),
    Section("efficiency", "validation.efficiency.section"),
)
NAMES = tuple(section.name for section in SECTIONS)


def choose(only: Collection[str], given: Collection[str]) -> tuple[list[Section], dict[str, str]]:
    """The sections that run, and why each of the others does not.

    ``only`` holds names of sections; ``given`` holds the kinds of a user's files, "scene" or "mesh", and is empty where
    the suite judges its own.
    """
    reasons = {section.name: _reason(section, only, given) for section in SECTIONS}
    left_out = {name: reason for name, reason in reasons.items() if reason}
    return [section for section in SECTIONS if section.name not in left_out], left_out


def _reason(section: Section, only: Collection[str], given: Collection[str]) -> str | None:
    """Why a section is left out; None where it runs."""
    if section.name not in only:
        return "not named by --only"
    if not given or section.judges in given:
        return None
    if section.judges is None:
        return "it judges input of the suite alone, and this run has files of yours"
    return f"no file was given by --{section.judges}"
