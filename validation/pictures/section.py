"""The section on pictures: ours against Mitsuba's, scene by scene and rung by rung, primary hits first, then radiance.

We render each rung of ``ladder`` under two rules for the start of spawned rays, Mitsuba's ("matched") and ours ("own"),
and compare it with every reference that can judge it. A rung that none can judge fails a gate. On any scene each pixel
that differs must have a reason (``verdict``); on the suite's own, thresholds bound the pictures too.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from renderer.picture.image import srgb
from renderer.picture.render import render
from renderer.scene.camera import Camera, PinholeCamera, ThinLensCamera
from renderer.scene.scene import Scene, load_scene
from validation.gates import Gate
from validation.job import Job, Task
from validation.pictures import aovs, monte_carlo, placement, textured, unseen, verdict
from validation.pictures.explain.media import open_glass
from validation.pictures.files import write_png
from validation.pictures.one_ray import picture
from validation.pictures.plan import PictureEffort, Plan, plan_pictures
from validation.pictures.rung import Drawn, check_rung, draw
from validation.references.mitsuba import camera as mitsuba_camera
from validation.references.mitsuba import whitted as mitsuba_whitted
from validation.references.mitsuba.scene import in_float32
from validation.references.mitsuba.textures import without_mip_maps
from validation.scenes import SCENE_CASES

AOVS = "Mitsuba's primary hits (scalar_rgb)"
# Kinds that no scene of the suite has.
_PLACE: dict[str, Any] = {"eye": (1.0, 2.0, 5.0), "target": (0.2, 0.5, 0.0), "up": (0.1, 1.0, 0.0)}
_FILM = (96, 64)
_CAMERAS = (
    PinholeCamera(**_PLACE, width=96, height=64, fx=100.0, fy=100.0, cx=30.0, cy=40.0),
    ThinLensCamera(**_PLACE, fov=37.0, aperture=0.3, focus=4.0),
)


def steps(job: Job) -> int:
    """Number of calls of ``job.step`` in ``run``: those of the suite's own, the others by the scenes' plans."""
    return job.own * (1 + unseen.steps()) + sum(
        plan_pictures(without_mip_maps(scene), effort).steps for _, _, scene, effort in scenes_of(job)
    )


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Check every scene; writes PNGs into ``job.folder`` and returns a record for JSON and the gates."""
    records: list[dict[str, Any]] = []
    found: list[Gate] = []
    for name, shows, scene, effort in scenes_of(job):
        record, passed = check_scene(name, shows, scene, effort, job)
        records.append(record)
        found += passed
    result: dict[str, Any] = {"scenes": records, "costs": costs_of(records)}
    if job.own:
        found += check_cameras(job)
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
    holds them, and textures without mip maps.
    """
    objects, found = placement.check(name, scene)
    whole, scene = scene, without_mip_maps(in_float32(scene))
    plan = plan_pictures(scene, effort)
    if scene.materials != whole.materials:
        plan.left_out["mip maps"] = "Mitsuba's bitmap has none; these textures are drawn with the filter linear"
        job.say(f"{name}: mip maps are not judged: {plan.left_out['mip maps']}")
    if plan.fault is not None:
        job.say(f"{name}: pictures are not judged: {plan.fault}")
    record: dict[str, Any] = {
        "name": name,
        "shows": shows,
        "max_depth": scene.render.max_depth,
        "faces": sum(len(instance.mesh.faces) for instance in scene.instances),
        "left_out": plan.left_out,
        "fault": plan.fault,
        "objects": objects,
    }
    drawn = {task.rung.name: draw(name, task, job) for task in plan.tasks}
    record["media"] = _announced(name, scene, drawn[plan.tasks[-1].rung.name], job)
    theirs = _theirs(name, scene, plan, job)
    if plan.fault is None:
        record["aovs"], passed = _check_aovs(name, scene, plan.tasks[-1].resolution, job, theirs[AOVS])
        found += passed
    verdicts = _verdicts(name, plan, drawn, theirs, job)
    record["rungs"] = []
    for task in plan.tasks:
        rung, passed = check_rung(name, task, job, drawn[task.rung.name], theirs, verdicts.get(task.rung.name))
        record["rungs"].append(rung)
        found += passed
    if plan.paths:
        record["paths"], passed = theirs[monte_carlo.PATHS]
        found += passed
    return record, found


def check_cameras(job: Job) -> list[Gate]:
    """Compare the rays of cameras that no scene of the suite has with those of Mitsuba's sensors."""
    return [_camera_gate(camera.type, camera, _FILM, job) for camera in _CAMERAS]


def _theirs(name: str, scene: Scene, plan: Plan, job: Job) -> dict[Any, Any]:
    """The references' results on a scene: of each rung and reference, (rung's name, reference's key), the picture and
    its seconds; of AOVS the same; of random paths the verdict. The longest tasks come first.
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
    """The result of ``make``, and the seconds that it took."""
    began = time.perf_counter()
    return make(), time.perf_counter() - began


def scenes_of(job: Job) -> Iterator[tuple[str, str, Scene, PictureEffort]]:
    """Names, descriptions and efforts of a user's scenes, or else of the suite's own."""
    size, lower = (192, 128) if job.quick else (512, 256)
    if not job.own:
        stems = Counter(path.stem for path in job.scenes)
        names = [path.stem if stems[path.stem] == 1 else str(path) for path in job.scenes]
        for name, path in zip(names, job.scenes, strict=True):
            yield name, str(path), load_scene(path), PictureEffort(size, lower)
        return
    for case in SCENE_CASES:
        yield case.name, case.shows, load_scene(case.path), PictureEffort(size, lower if case.every_rung else None)
    for row in textured.rows():
        yield *row, PictureEffort(lower, paths=False)


def _check_aovs(
    name: str, scene: Scene, resolution: tuple[int, int], job: Job, made: tuple[Any, float]
) -> tuple[dict[str, Any], list[Gate]]:
    """Compare the camera's rays with those of Mitsuba's own sensor, and then their hits, which Mitsuba has ``made``."""
    cameras = [] if mitsuba_camera.can_judge(scene.camera) else [_camera_gate(name, scene.camera, resolution, job)]
    theirs, seconds = made
    # Behind holes of masks rays start anew, by the same rule.
    ours = picture(scene, resolution, "mitsuba", max_depth=0)
    record, found, off = aovs.compare(name, scene, ours, theirs, job.thresholds.aovs)
    if not job.own:
        found = [verdict.primary_gate(f"{name}, AOVs", scene, ours, off)]
    told = {"reference_name": AOVS, "reference_seconds": seconds, "size": list(resolution)}
    if cameras:
        told["camera_pixels"] = cameras[0].value
    return told | record, [*cameras, *found]


def _camera_gate(name: str, camera: Camera, resolution: tuple[int, int], job: Job) -> Gate:
    """The distance of our rays from those of Mitsuba's sensor."""
    shift, limit = mitsuba_camera.largest_distance(camera, resolution), job.thresholds.pictures.camera_pixels
    reason, kind = "our camera rays are those of Mitsuba's sensor; both pictures use ours", type(camera).__name__
    judged = (kind, f"{kind}.rows")
    return Gate("images", f"{name}, camera", "distance of camera rays, pixels", shift, "at most", limit, reason, judged)


def _announced(name: str, scene: Scene, drawn: Drawn, job: Job) -> list[str]:
    """Lines about a scene before references see it: where the rule for media decides."""
    share = float(verdict.differs(drawn.images["own"].radiance, drawn.normal["own"]).mean())
    lines = [f"glass {mesh} is open at {edges:,} edges" for mesh, edges in open_glass(scene).items()]
    if share > 0.0:
        lines.append(f"{100.0 * share:.2g} % of the picture depends on the rule for media: a stack, or the normal")
    for line in lines:
        job.say(f"{name}: {line}")
    return lines


def _verdicts(
    name: str, plan: Plan, drawn: Mapping[str, Drawn], theirs: Mapping[Any, Any], job: Job
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
