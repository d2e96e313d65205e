"""The plan of a scene: its rungs, their sizes, and who judges them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from renderer.scene.scene import Scene, checked_settings
from validation.pictures import ladder, monte_carlo
from validation.pictures.compare import Picture
from validation.pictures.ladder import Rung
from validation.references.mitsuba import path as mitsuba_path
from validation.references.mitsuba import whitted as mitsuba_whitted

WHITTED = "Whitted recursion over Mitsuba's scene, BSDFs and rays (scalar_rgb)"
# SSIM's window.
_SMALLEST = 11


class Reference(NamedTuple):
    """Another renderer: a short name for files, a name for people, why it cannot judge a scene, its picture."""

    key: str
    name: str
    can_judge: Callable[[Scene], str | None]
    picture: Callable[..., Picture]


REFERENCES = (
    Reference("whitted", WHITTED, lambda _: None, mitsuba_whitted.whitted),
    Reference("path", mitsuba_path.NAME, mitsuba_path.can_judge, mitsuba_path.path),
)


@dataclass(frozen=True)
class PictureEffort:
    """Picture sizes of one scene: the longer side, in pixels.

    size    of the scene as it is
    lower   of the ladder's rungs below it; None leaves those out
    paths   whether random paths judge glass too, in a picture of their own size
    """

    size: int
    lower: int | None = None
    paths: bool = True


class RungTask(NamedTuple):
    """A rung, its picture's width and height, the references that judge it, and the others with the reason why not."""

    rung: Rung
    resolution: tuple[int, int]
    references: tuple[Reference, ...]
    left_out: dict[str, str]

    @property
    def explained(self) -> bool:
        """Whether a reference's rays can be walked."""
        return any(reference.key == "whitted" for reference in self.references)


class Plan(NamedTuple):
    """The tasks of a scene, whether random paths judge it, why rungs are left out, and why Mitsuba cannot hold it."""

    tasks: list[RungTask]
    paths: bool
    left_out: dict[str, str]
    fault: str | None

    @property
    def steps(self) -> int:
        judged = sum(task.explained for task in self.tasks)
        return (self.fault is None) + self.paths + judged + sum(1 + len(task.references) for task in self.tasks)


def plan_pictures(scene: Scene, effort: PictureEffort) -> Plan:
    """The rungs and comparisons of a scene, and those that it does not need, with reasons."""
    rungs, left_out = ladder.rungs(scene)
    if effort.lower is None:
        left_out = {rung.name: "another scene has this step" for rung in rungs[:-1]} | left_out
        rungs = rungs[-1:]
    fault = mitsuba_whitted.can_judge(scene)
    tasks = []
    for rung in rungs:
        faults = {reference.name: fault or reference.can_judge(rung.scene) for reference in REFERENCES}
        judging = tuple(reference for reference in REFERENCES if faults[reference.name] is None)
        size = effort.size if rung is rungs[-1] else effort.lower
        reasons = {reference: reason for reference, reason in faults.items() if reason is not None}
        tasks.append(RungTask(rung, _resolution(scene, size or effort.size), judging, reasons))
    chance = None if effort.paths else "not asked for"
    chance = fault or chance or monte_carlo.can_judge(scene)
    if chance is not None:
        left_out |= {"random paths": chance}
    return Plan(tasks, chance is None, left_out, fault)


def _resolution(scene: Scene, size: int) -> tuple[int, int]:
    """Width and height in the scene's own aspect ratio, with the longer side ``size``."""
    width, height = checked_settings(scene.render, {}, scene.camera).resolution
    scale = size / max(width, height)
    return max(_SMALLEST, round(width * scale)), max(_SMALLEST, round(height * scale))
