"""The section on pictures: ours against Mitsuba's, scene by scene and rung by rung, primary hits first, then radiance.

We render each rung of ``ladder`` under two rules for the start of spawned rays, Mitsuba's ("matched") and ours ("own"),
and compare it with every reference that can judge it. A rung that none can judge fails a gate. On any scene each pixel
that differs must have a reason (``verdict``); on the suite's own, thresholds bound the pictures too.
"""

import re
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.picture.image import Image, srgb
from renderer.picture.render import render
from renderer.scene.scene import UNLIMITED_RAYS, Scene, load_scene
from validation.gates import Gate
from validation.job import Job, Task
from validation.pictures import aovs, check, ladder, monte_carlo, placement, unseen, verdict
from validation.pictures.check import Pair, Rule
from validation.pictures.compare import Picture, fragile_pixels
from validation.pictures.explain.media import open_glass
from validation.pictures.files import write_png
from validation.pictures.ladder import Rung
from validation.pictures.shifted_film import shifted
from validation.references.mitsuba import camera as mitsuba_camera
from validation.references.mitsuba import path as mitsuba_path
from validation.references.mitsuba import whitted as mitsuba_whitted
from validation.references.mitsuba.scene import in_float32
from validation.scenes import SCENE_CASES

WHITTED = "Whitted recursion over Mitsuba's scene, BSDFs and rays (scalar_rgb)"
AOVS = "Mitsuba's primary hits (scalar_rgb)"

# Colours of the map of pixels: none, then ``verdict.MAPPED`` in order. Only the last two are faults.
_COLORS = np.array(
    [
        (24, 26, 32),
        (90, 160, 250),
        (70, 90, 140),
        (60, 200, 180),
        (240, 200, 70),
        (190, 110, 240),
        (255, 40, 40),
        (255, 120, 40),
    ],
    np.uint8,
)
# SSIM's window.
_SMALLEST = 11
_Offset = Literal["bounded", "mitsuba"] | float
_RULES: dict[Rule, _Offset] = {"matched": "mitsuba", "own": "bounded"}


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


class _Task(NamedTuple):
    """A rung, its picture's width and height, the references that judge it, and the others with the reason why not."""

    rung: Rung
    resolution: tuple[int, int]
    references: tuple[Reference, ...]
    left_out: dict[str, str]

    @property
    def explained(self) -> bool:
        """Whether a reference's rays can be walked."""
        return any(reference.key == "whitted" for reference in self.references)


class _Plan(NamedTuple):
    """The tasks of a scene, whether random paths judge it, why rungs are left out, and why Mitsuba cannot hold it."""

    tasks: list[_Task]
    paths: bool
    left_out: dict[str, str]
    fault: str | None

    @property
    def steps(self) -> int:
        judged = sum(task.explained for task in self.tasks)
        return (self.fault is None) + self.paths + judged + sum(1 + len(task.references) for task in self.tasks)


def steps(job: Job) -> int:
    """Number of calls of ``job.step`` in ``run``: those of the suite's own, the others by the scenes' plans."""
    return job.own * (1 + unseen.steps()) + sum(
        plan_pictures(load_scene(path), effort).steps for _, _, path, effort in scenes_of(job)
    )


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Check every scene; writes PNGs into ``job.folder`` and returns a record for JSON and the gates."""
    records: list[dict[str, Any]] = []
    found: list[Gate] = []
    for name, shows, path, effort in scenes_of(job):
        record, passed = check_scene(name, shows, load_scene(path), effort, job)
        records.append(record)
        found += passed
    result: dict[str, Any] = {"scenes": records, "costs": costs_of(records)}
    if job.own:
        result["unseen"], passed = unseen.check_unseen(job)
        found += passed
        job.step("pictures: the main scene, 9 samples a pixel")
        result["hero"] = _hero(job)
    return result, found


def check_scene(
    name: str, shows: str, scene: Scene, effort: PictureEffort, job: Job
) -> tuple[dict[str, Any], list[Gate]]:
    """Check one scene; returns its record for JSON and the gates.

    A rung that no reference can judge fails a gate; the record lists each rung or reference that is left out with its
    reason. Pictures have one ray a pixel and no smallest weight, which no reference has. All draw the meshes as float32
    holds them.
    """
    objects, found = placement.check(name, scene)
    scene = in_float32(scene)
    plan = plan_pictures(scene, effort)
    record: dict[str, Any] = {
        "name": name,
        "shows": shows,
        "max_depth": scene.render.max_depth,
        "faces": sum(len(instance.mesh.faces) for instance in scene.instances),
        "left_out": plan.left_out,
        "fault": plan.fault,
        "objects": objects,
    }
    drawn = {task.rung.name: _draw(name, task, job) for task in plan.tasks}
    record["media"] = _announced(name, scene, drawn[plan.tasks[-1].rung.name], job)
    theirs = _theirs(name, scene, plan, job)
    if plan.fault is None:
        record["aovs"], passed = _check_aovs(name, scene, plan.tasks[-1].resolution, job, theirs[AOVS])
        found += passed
    verdicts = _verdicts(name, plan, drawn, theirs, job)
    record["rungs"] = []
    for task in plan.tasks:
        rung, passed = _check_rung(name, task, job, drawn[task.rung.name], theirs, verdicts.get(task.rung.name))
        record["rungs"].append(rung)
        found += passed
    if plan.paths:
        record["paths"], passed = theirs[monte_carlo.PATHS]
        found += passed
    return record, found


def _theirs(name: str, scene: Scene, plan: _Plan, job: Job) -> dict[Any, Any]:
    """What references make of a scene, which takes long: of each rung and reference, (rung's name, reference's key),
    the picture and its seconds; of AOVS the same; of random paths the verdict. What takes longest comes first.
    """
    tasks: dict[Any, Task] = {}
    if plan.paths:
        whole = partial(monte_carlo.run, scene, name, job.quick, job.own)
        tasks[monte_carlo.PATHS] = Task(f"monte carlo: {name}, random paths", whole)
    for task in reversed(plan.tasks):
        for reference in task.references:
            subject = f"pictures: {name}, {task.rung.name}, {reference.key}"
            depth = task.rung.scene.render.max_depth
            make = partial(reference.picture, task.rung.scene, *task.resolution, max_depth=depth)
            tasks[task.rung.name, reference.key] = Task(subject, partial(_timed, make))
    if plan.fault is None:
        hits = partial(mitsuba_whitted.aovs, scene, *plan.tasks[-1].resolution)
        tasks[AOVS] = Task(f"pictures: {name}, AOVs", partial(_timed, hits))
    return dict(zip(tasks, job.each([*tasks.values()]), strict=True))


def _timed(make: Callable[[], Any]) -> tuple[Any, float]:
    """What is made, and the seconds that it took."""
    began = time.perf_counter()
    return make(), time.perf_counter() - began


def scenes_of(job: Job) -> list[tuple[str, str, Path, PictureEffort]]:
    """Names, descriptions, files and efforts of a user's scenes, or else of the suite's own."""
    size, lower = (192, 128) if job.quick else (512, 256)
    if not job.own:
        stems = Counter(path.stem for path in job.scenes)
        names = [path.stem if stems[path.stem] == 1 else str(path) for path in job.scenes]
        return [
            (name, str(path), path, PictureEffort(size, lower)) for name, path in zip(names, job.scenes, strict=True)
        ]
    return [
        (case.name, case.shows, case.path, PictureEffort(size, lower if case.every_rung else None))
        for case in SCENE_CASES
    ]


def plan_pictures(scene: Scene, effort: PictureEffort) -> _Plan:
    """The rungs and comparisons of a scene, and those that it does not need, with reasons."""
    rungs, left_out = ladder.rungs(scene)
    if effort.lower is None:
        left_out = {rung.name: "climbed on another scene" for rung in rungs[:-1]} | left_out
        rungs = rungs[-1:]
    fault = mitsuba_whitted.can_judge(scene)
    tasks = []
    for rung in rungs:
        faults = {reference.name: fault or reference.can_judge(rung.scene) for reference in REFERENCES}
        judging = tuple(reference for reference in REFERENCES if faults[reference.name] is None)
        size = effort.size if rung is rungs[-1] else effort.lower
        reasons = {reference: reason for reference, reason in faults.items() if reason is not None}
        tasks.append(_Task(rung, _resolution(scene, size or effort.size), judging, reasons))
    chance = None if effort.paths else "not asked for"
    chance = fault or chance or monte_carlo.can_judge(scene)
    if chance is not None:
        left_out |= {"random paths": chance}
    return _Plan(tasks, chance is None, left_out, fault)


def _resolution(scene: Scene, size: int) -> tuple[int, int]:
    """Width and height in the scene's own aspect ratio, with the longer side ``size``."""
    width, height = scene.render.resolution
    scale = size / max(width, height)
    return max(_SMALLEST, round(width * scale)), max(_SMALLEST, round(height * scale))


def _check_aovs(
    name: str, scene: Scene, resolution: tuple[int, int], job: Job, made: tuple[Any, float]
) -> tuple[dict[str, Any], list[Gate]]:
    """Compare the camera's rays with those of Mitsuba's own sensor, and then their hits, which Mitsuba has ``made``."""
    shift = mitsuba_camera.largest_distance(scene.camera, max(resolution))
    limit, reason = job.thresholds.pictures.camera_pixels, "our primary rays are Mitsuba's; both pictures use ours"
    camera = Gate("images", f"{name}, camera", "pixels between rays", shift, "at most", limit, reason)
    theirs, seconds = made
    ours = render(scene, resolution=resolution, samples=1, max_depth=0)
    record, found, off = aovs.compare(name, scene, ours, theirs, job.thresholds.aovs)
    if not job.own:
        found = [verdict.primary_gate(f"{name}, AOVs", scene, ours, off)]
    told = {"reference_name": AOVS, "reference_seconds": seconds, "size": list(resolution), "camera_pixels": shift}
    return told | record, [camera, *found]


class _Drawn(NamedTuple):
    """Our pictures of a rung: by rule for offsets, the same under the media of normals, and the fragile pixels."""

    images: dict[Rule, Image]
    normal: dict[Rule, Picture]
    fragile: NDArray[np.bool_]


def _draw(name: str, task: _Task, job: Job) -> _Drawn:
    scene, size = task.rung.scene, task.resolution
    job.step(f"pictures: {name}, {task.rung.name}, ours")
    images = {rule: _ours(scene, size, offset) for rule, offset in _RULES.items()}
    normal = {rule: _ours(scene, size, offset, media="normal").radiance for rule, offset in _RULES.items()}
    # They bound the largest error on the suite's own scenes alone.
    fragile = np.zeros(size[::-1], np.bool_)
    if job.own:
        fragile = fragile_pixels(lambda offset, shift: _ours(shifted(scene, shift), size, offset).radiance)
    return _Drawn(images, normal, fragile)


def _announced(name: str, scene: Scene, drawn: _Drawn, job: Job) -> list[str]:
    """What is said of the scene before references see it: where the rule for media decides."""
    share = float(verdict.differs(drawn.images["own"].radiance, drawn.normal["own"]).mean())
    lines = [f"glass {mesh} is open at {edges:,} edges" for mesh, edges in open_glass(scene).items()]
    if share > 0.0:
        lines.append(f"{100.0 * share:.2g} % of the picture depends on the rule for media: a stack, or the normal")
    for line in lines:
        job.say(f"{name}: {line}")
    return lines


def _verdicts(
    name: str, plan: _Plan, drawn: Mapping[str, _Drawn], theirs: Mapping[Any, Any], job: Job
) -> dict[str, dict[str, Any]]:
    """The verdict on each rung that reference B judges, by the rung's name."""
    tasks = {}
    for task in reversed(plan.tasks):
        if task.explained:
            key, ours = task.rung.name, drawn[task.rung.name]
            pictures = verdict.Pictures(ours.normal, ours.images["own"].radiance, theirs[key, "whitted"][0])
            tasks[key] = Task(
                f"pictures: {name}, {key}, why pixels differ", partial(verdict.judge, task.rung.scene, pictures)
            )
    return dict(zip(tasks, job.each([*tasks.values()]), strict=True))


def _check_rung(
    name: str,
    task: _Task,
    job: Job,
    drawn: _Drawn,
    theirs: Mapping[Any, Any],
    judged: dict[str, Any] | None,
) -> tuple[dict[str, Any], list[Gate]]:
    """Compare one rung under both rules with its references' pictures."""
    subject = f"{name}, {task.rung.name}"
    reason = "a rung that nobody judges is not passed"
    found = [Gate("images", subject, "references that judge it", len(task.references), "at least", 1.0, reason)]
    comparisons = []
    for reference in task.references:
        radiance, seconds = theirs[task.rung.name, reference.key]
        made = {"reference": reference.key, "reference_name": reference.name, "reference_seconds": seconds}
        for rule, image in drawn.images.items():
            # The report shows our own rule, which users get, beside the first reference.
            shown = rule == "own" and reference is task.references[0]
            against = f"{subject} against {reference.key}, {rule} offset"
            gates = _path_gates(against, drawn.normal[rule], theirs, task) if reference.key == "path" else []
            record, passed = check.check(
                against, Pair(image, rule, radiance, drawn.fragile), job, shown=shown, verdict=gates
            )
            comparisons.append(made | {"offset": rule} | record)
            found += passed
    record = _rung_record(task, drawn.images["own"], comparisons)
    if judged is not None:
        found += verdict.gates(subject, judged)
        record["verdict"] = _kept(subject, judged, job)
    return record, found


def _path_gates(against: str, ours: Picture, theirs: Mapping[Any, Any], task: _Task) -> list[Gate]:
    """The native integrator records no rays: what it draws otherwise than reference B nobody has explained."""
    path, whitted = (theirs[task.rung.name, key][0] for key in ("path", "whitted"))
    value = float((verdict.differs(ours, path) & verdict.differs(path, whitted)).sum())
    reason = "reference B draws the same, and the rays of its pixels were walked"
    return [Gate("images", against, "pixels that differ without a reason", value, "at most", 0.0, reason)]


def _kept(subject: str, judged: dict[str, Any], job: Job) -> dict[str, Any]:
    """A verdict for the record, with its map as a picture."""
    name = re.sub(r"\W+", "-", subject) + "-reasons.png"
    write_png(job.folder / name, _COLORS[judged["map"]])
    red = any(not gate.passed for gate in verdict.gates(subject, judged))
    colors = {reason: "#{:02x}{:02x}{:02x}".format(*_COLORS[1 + k]) for k, reason in enumerate(verdict.MAPPED)}
    kept = {key: value for key, value in judged.items() if key != "map"}
    return kept | {"file": name, "red": red, "colors": colors}


def _rung_record(task: _Task, own: Image, comparisons: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "name": task.rung.name,
        "adds": task.rung.adds,
        "size": list(task.resolution),
        "rays": int(own.rays.sum()),
        "ours_seconds": own.render_seconds,
        "build_seconds": own.build_seconds,
        "comparisons": comparisons,
        "left_out": task.left_out,
    }


def _ours(
    scene: Scene, resolution: tuple[int, int], offset: _Offset, media: Literal["stack", "normal"] = "stack"
) -> Image:
    return render(
        scene, resolution=resolution, samples=1, min_weight=0.0, max_rays=UNLIMITED_RAYS, offset=offset, media=media
    )


def costs_of(scenes: list[dict[str, Any]]) -> dict[str, float]:
    """Seconds spent in each reference; both rules share one picture of it."""
    spent: dict[str, float] = {}
    for scene in scenes:
        made = [scene["aovs"]] if "aovs" in scene else []
        for rung in scene["rungs"]:
            made += [comparison for comparison in rung["comparisons"] if comparison["offset"] == "own"]
        costs = [(one["reference_name"], one["reference_seconds"]) for one in made]
        costs.append((placement.NAME, scene["objects"]["seconds"]))
        costs += scene.get("paths", {"costs": {}})["costs"].items()
        for name, seconds in costs:
            spent[name] = spent.get(name, 0.0) + seconds
    return spent


def _hero(job: Job) -> dict[str, Any]:
    """Render the main scene for the head of the report."""
    image = render(load_scene(SCENE_CASES[0].path), resolution=(960, 540), samples=9)
    write_png(job.folder / "hero.png", srgb(image.radiance))
    return {"file": "hero.png", "seconds": image.render_seconds, "rays": int(image.rays.sum()), "samples": 9}
