"""Knobs of a picture: samples, max_depth and min_weight, each error against its seconds.

The reference is our own picture at a higher setting. What is measured here is truncation and sampling, and no
correctness: a mistake of the renderer is in both pictures. The image cases judge that against Mitsuba.

One knob moves at a time. The others stand at the base: one sample, ``DEEP`` bounces, no least weight. A picture is
compared twice: with the picture whose own knob alone is converged (``rmse``: what this knob costs), and with the one
where all are (``rmse_all``: what a user sees; one sample's error is then in every depth's).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from renderer.picture.image import Image
from renderer.picture.render import render
from renderer.scene.scene import Scene, load_scene
from validation.scenes import Case
from validation.tradeoff import front, median_seconds, slope

Settings = dict[str, Any]

# Four bounces beyond the deepest that is measured. Between glass bodies rays double, so that much deeper takes minutes.
DEEP = 12
BASE: Settings = {"samples": 1, "max_depth": DEEP, "min_weight": 0.0}
KNOBS: dict[str, tuple[float, ...]] = {
    "samples": (1, 4, 9, 16, 25, 64),
    "max_depth": tuple(range(9)),
    "min_weight": (0.0, 1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3),
}


@dataclass(frozen=True)
class Effort:
    """Pixels a side of the pictures, ``samples`` of the converged one (a square number), timed ``runs``."""

    cases: tuple[Case, ...]
    size: int
    samples: int
    runs: int


def run(effort: Effort, step: Callable[[str], None]) -> dict[str, object]:
    """Measure; see ``validation.benchmark.parameters.study`` for the record."""
    scenes = []
    for case in effort.cases:
        step(f"knobs: pictures of {case.name}")
        scenes.append({"name": case.name} | measure(load_scene(case.path), effort))
    return {
        "reference": "our own picture at a higher setting: this measures truncation and sampling, not correctness",
        "base": BASE,
        "size": effort.size,
        "runs": effort.runs,
        "scenes": scenes,
    }


def measure(scene: Scene, effort: Effort) -> dict[str, object]:
    """All knobs on one scene."""
    draw = partial(render, scene, resolution=(effort.size, effort.size))
    base, converged = draw(**BASE), draw(**BASE | {"samples": effort.samples})
    # A quarter of the samples and twice the bounces: how far the references may themselves be from converged.
    coarser, deeper = draw(**BASE | {"samples": effort.samples // 4}), draw(**BASE | {"max_depth": 2 * DEEP})
    settings = {(knob, value): BASE | {knob: value} for knob, values in KNOBS.items() for value in values}
    images = {key: draw(**chosen) for key, chosen in settings.items()}
    clocks = {_name(*key): partial(_render_seconds, draw, chosen) for key, chosen in settings.items()}
    seconds = median_seconds(clocks, effort.runs, unseen=0)
    points: list[dict[str, Any]] = []
    for (knob, value), image in images.items():
        rmse, largest = difference(image, converged if knob == "samples" else base)
        rmse_all, largest_all = difference(image, converged)
        points.append(
            {"name": _name(knob, value), "knob": knob, "value": value, "seconds": seconds[_name(knob, value)]}
            | {"rays": int(image.rays.sum()), "rmse": rmse, "max_error": largest}
            | {"rmse_all": rmse_all, "max_error_all": largest_all}
        )
    return {
        "reference": {"samples": effort.samples, "max_depth": DEEP, "min_weight": 0.0}
        | {"rmse_to_quarter_samples": difference(coarser, converged)[0]}
        | {"rmse_to_twice_the_depth": difference(base, deeper)[0]},
        "knobs": {knob: _knob([p for p in points if p["knob"] == knob]) for knob in KNOBS},
        "front": [points[i]["name"] for i in front([(p["seconds"], p["rmse_all"]) for p in points])],
    }


def difference(image: Image, reference: Image) -> tuple[float, float]:
    """RMSE and the largest absolute difference of linear radiance, over all pixels and channels, not clipped."""
    error = np.subtract(image.radiance, reference.radiance, dtype=np.float64)
    return float(np.sqrt(np.square(error).mean())), float(np.abs(error).max())


def _knob(points: list[dict[str, Any]]) -> dict[str, object]:
    seconds, values, rmse = ([p[key] for p in points] for key in ("seconds", "value", "rmse"))
    return {
        "points": points,
        "front": [points[i]["name"] for i in front(list(zip(seconds, rmse, strict=True)))],
        "slope_seconds": slope(seconds, rmse),
        "slope_value": slope(values, rmse),
    }


def _name(knob: str, value: float) -> str:
    return f"{knob} {value:g}"


def _render_seconds(draw: Callable[..., Image], settings: Settings) -> float:
    """Tracing alone: every setting builds the same tree."""
    return draw(**settings).render_seconds
