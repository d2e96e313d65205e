"""One rung: our pictures under both rules for offsets, against those of its references, and the reasons of pixels."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.picture.image import Image, srgb
from validation.gates import Gate
from validation.job import Job
from validation.pictures import check, verdict
from validation.pictures.check import Pair
from validation.pictures.compare import Picture, fragile_pixels
from validation.pictures.explain.pixels import Rule
from validation.pictures.files import write_png
from validation.pictures.one_ray import Offset, picture
from validation.pictures.plan import RungTask
from validation.pictures.shifted_film import shifted

_RULES: dict[Rule, Offset] = {"matched": "mitsuba", "own": "bounded"}
# Colours of the map of pixels: none, then ``verdict.MAPPED`` in order. Only the last two are faults.
_COLORS = np.array(
    [(0, 0, 0), (90, 160, 250), (130, 130, 230), (60, 200, 180), (240, 200, 70), (190, 110, 240), (255, 40, 40),
     (255, 120, 40)],
    np.uint8,
)  # fmt: skip
# The brightness of a picture behind its map.
_DIMMED = 0.3


class Drawn(NamedTuple):
    """Our pictures of a rung: by rule for offsets, the same under the media of normals, and the fragile pixels."""

    images: dict[Rule, Image]
    normal: dict[Rule, Picture]
    fragile: NDArray[np.bool_]


def draw(name: str, task: RungTask, job: Job) -> Drawn:
    """Draw a rung."""
    scene, size = task.rung.scene, task.resolution
    job.step(f"pictures: {name}, {task.rung.name}, ours")
    images = {rule: picture(scene, size, offset) for rule, offset in _RULES.items()}
    normal = {rule: picture(scene, size, offset, media="normal").radiance for rule, offset in _RULES.items()}
    # They bound the largest error on the suite's own scenes alone.
    fragile = np.zeros(size[::-1], np.bool_)
    if job.own:
        fragile = fragile_pixels(lambda offset, shift: picture(shifted(scene, shift), size, offset).radiance)
    return Drawn(images, normal, fragile)


def check_rung(
    name: str,
    task: RungTask,
    job: Job,
    drawn: Drawn,
    theirs: Mapping[Any, Any],
    judged: dict[str, Any] | None,
) -> tuple[dict[str, Any], list[Gate]]:
    """Compare one rung under both rules with its references' pictures."""
    subject = f"{name}, {task.rung.name}"
    reason = "a step without a reference proves nothing"
    found = [Gate("images", subject, "references", len(task.references), "at least", 1.0, reason)]
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
        record["verdict"] = _kept(subject, judged, drawn.images["own"], job)
    return record, found


def _path_gates(against: str, ours: Picture, theirs: Mapping[Any, Any], task: RungTask) -> list[Gate]:
    """The native integrator records no rays: what it draws otherwise than reference B nobody has explained."""
    path, whitted = (theirs[task.rung.name, key][0] for key in ("path", "whitted"))
    value = float((verdict.differs(ours, path) & verdict.differs(path, whitted)).sum())
    reason = "the Whitted reference draws the same scene, and its rays were followed step by step"
    return [Gate("images", against, "pixels that differ without a reason", value, "at most", 0.0, reason)]


def _kept(subject: str, judged: dict[str, Any], own: Image, job: Job) -> dict[str, Any]:
    """A verdict for the record, with its map as a picture: the reasons over our own, dimmed."""
    name = re.sub(r"\W+", "-", subject) + "-reasons.png"
    grey = (_DIMMED * srgb(own.radiance).mean(axis=2, keepdims=True)).astype(np.uint8)
    reasons = judged["map"][..., None]
    write_png(job.folder / name, np.where(reasons == 0, grey, _COLORS[judged["map"]]))
    red = any(not gate.passed for gate in verdict.gates(subject, judged))
    colors = {reason: "#{:02x}{:02x}{:02x}".format(*_COLORS[1 + k]) for k, reason in enumerate(verdict.MAPPED)}
    kept = {key: value for key, value in judged.items() if key != "map"}
    return kept | {"file": name, "red": red, "colors": colors}


def _rung_record(task: RungTask, own: Image, comparisons: list[dict[str, Any]]) -> dict[str, Any]:
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
