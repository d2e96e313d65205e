"""Parameters of a picture: samples, max_depth and min_weight, each error against its seconds.

The reference is our own picture at a higher setting. This measures truncation and sampling, not correctness: a mistake
of the renderer is in both pictures. The section on pictures judges correctness against Mitsuba.

One parameter changes at a time. The others keep the base: one sample, ``DEEP`` bounces, no least weight. A picture is
compared twice: with the picture of which this parameter alone is converged (``rmse``: this parameter's error), and with
the one of which all are (``rmse_all``: the error that a user gets; it includes one sample's error at every depth).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from renderer.picture.image import Image
from renderer.picture.render import render
from renderer.scene.scene import Scene, load_scene
from validation.error_curves import front, slope
from validation.scenes import Case
from validation.timing import median_seconds

Settings = dict[str, Any]

# Four bounces beyond the deepest measured one. Rays double between glass bodies, so much deeper takes minutes.
DEEP = 12
BASE: Settings = {"samples": 1, "max_depth": DEEP, "min_weight": 0.0}
PARAMETERS: dict[str, tuple[float, ...]] = {
    "samples": (1, 4, 9, 16, 25, 64),
    "max_depth": tuple(range(9)),
    "min_weight": (0.0, 1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3),
}


@dataclass(frozen=True)
class PictureStudyEffort:
    """The scenes, pixels a side, samples of the converged picture (a square number), and ``runs`` of the clock."""

    cases: tuple[Case, ...]
    size: int
    samples: int
    runs: int


def run(effort: PictureStudyEffort, step: Callable[[str], None]) -> dict[str, object]:
    """Measure; see ``validation.benchmark.parameters.study`` for the record."""
    scenes = []
    for case in effort.cases:
        step(f"parameters: pictures of {case.name}")
        scenes.append({"name": case.name} | measure(load_scene(case.path), effort))
    return {
        "reference": "our own picture at a higher setting: this measures truncation and sampling, not correctness",
        "base": BASE,
        "size": effort.size,
        "runs": effort.runs,
        "scenes": scenes,
    }


def measure(scene: Scene, effort: PictureStudyEffort) -> dict[str, object]:
    """Measure all parameters on one scene."""
    draw = partial(render, scene, resolution=(effort.size, effort.size))
    base, converged = draw(**BASE), draw(**BASE | {"samples": effort.samples})
    # A quarter of the samples and twice the bounces show how far the references may be from converged.
    coarser, deeper = draw(**BASE | {"samples": effort.samples // 4}), draw(**BASE | {"max_depth": 2 * DEEP})
    settings = {(name, value): BASE | {name: value} for name, values in PARAMETERS.items() for value in values}
    images = {key: draw(**chosen) for key, chosen in settings.items()}
    clocks = {_label(*key): partial(_render_seconds, draw, chosen) for key, chosen in settings.items()}
    seconds = median_seconds(clocks, effort.runs, unseen=0)
    points: list[dict[str, Any]] = []
    for (name, value), image in images.items():
        rmse, largest = difference(image, converged if name == "samples" else base)
        rmse_all, largest_all = difference(image, converged)
        points.append(
            {"name": _label(name, value), "knob": name, "value": value, "seconds": seconds[_label(name, value)]}
            | {"rays": int(image.rays.sum()), "rmse": rmse, "max_error": largest}
            | {"rmse_all": rmse_all, "max_error_all": largest_all}
        )
    return {
        "reference": {"samples": effort.samples, "max_depth": DEEP, "min_weight": 0.0}
        | {"rmse_to_quarter_samples": difference(coarser, converged)[0]}
        | {"rmse_to_twice_the_depth": difference(base, deeper)[0]},
        "knobs": {name: _curve([p for p in points if p["knob"] == name]) for name in PARAMETERS},
        "front": [points[i]["name"] for i in front([(p["seconds"], p["rmse_all"]) for p in points])],
    }


def difference(image: Image, reference: Image) -> tuple[float, float]:
    """RMSE and the largest absolute difference of linear radiance, over all pixels and channels, not clipped."""
    error = np.subtract(image.radiance, reference.radiance, dtype=np.float64)
    return float(np.sqrt(np.square(error).mean())), float(np.abs(error).max())


def _curve(points: list[dict[str, Any]]) -> dict[str, object]:
    """The record of one parameter: its points, their front and the slopes."""
    seconds, values, rmse = ([p[key] for p in points] for key in ("seconds", "value", "rmse"))
    return {
        "points": points,
        "front": [points[i]["name"] for i in front(list(zip(seconds, rmse, strict=True)))],
        "slope_seconds": slope(seconds, rmse),
        "slope_value": slope(values, rmse),
    }


def _label(name: str, value: float) -> str:
    return f"{name} {value:g}"


def _render_seconds(draw: Callable[..., Image], settings: Settings) -> float:
    """Seconds of tracing alone, because every setting builds the same tree."""
    return draw(**settings).render_seconds
