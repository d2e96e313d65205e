"""Pictures: error against seconds, ours and Mitsuba's, over samples, depth and the least weight; the error's causes.

Mitsuba's converged film, in which no code of ours takes part, is the truth for samples; see
``validation.references.mitsuba.sampling``. The truth for depth and least weight is the same renderer's own picture at a
deeper setting, which measures truncation and not correctness: the picture gates judge that.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.picture.render import render
from renderer.scene.scene import UNLIMITED_RAYS, Scene
from validation.error_curves import front, slope
from validation.pictures.compare import compare
from validation.references.mitsuba import path as mitsuba_path
from validation.references.mitsuba import scene as mitsuba_scene
from validation.references.mitsuba.sampling import Film, Sampler
from validation.timing import RUNS, median_seconds, spending

Picture = NDArray[Any]
Point = dict[str, Any]

METRICS = ("rmse", "flip", "dissimilarity")
FILM = "Mitsuba's film"

DEEP = 16
# Beyond six bounces the measured view of the mirrors shows nothing new.
DEPTH = 8
SAMPLES = (1, 4, 9, 16, 25, 64)
DEPTHS = (0, 1, 2, 3, 4, 6, 8)
# The mirrors reflect 0.85 to 0.94: a lower weight stops no visible ray.
WEIGHTS = (0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95)
# A square number four times the largest that is judged: its own error is at most a third of that one's.
CONVERGED = 256
# The depth whose truncation the split of the error reports.
SHALLOW = 3


@dataclass(frozen=True)
class PictureTimingEffort:
    """Pixels a side, Mitsuba's timed numbers of samples, samples of the converged pictures, and ``runs`` of the clock.

    The converged picture is the mean of two with ``truth`` stratified samples each, a square number.
    """

    size: int
    theirs: tuple[int, ...]
    truth: int
    runs: int


QUICK = PictureTimingEffort(size=32, theirs=(1, 4, 16), truth=144, runs=1)
FULL = PictureTimingEffort(size=64, theirs=(1, 4, 16, 64), truth=400, runs=3)


class Drawn(NamedTuple):
    """Linear radiance (size, size, 3), and the seconds spent tracing it, without building a tree."""

    radiance: Picture
    seconds: float


class Bench:
    """One scene with its renderers; adds the seconds spent in Mitsuba's film to ``costs``."""

    def __init__(self, scene: Scene, effort: PictureTimingEffort, costs: dict[str, float]) -> None:
        self.scene, self.effort = scene, effort
        self._film, self._costs = Film(scene, effort.size), costs

    def ours(self, samples: int = 1, max_depth: int = DEPTH, min_weight: float = 0.0, **settings: Any) -> Drawn:
        """Our picture; ``settings`` are those of ``render``."""
        settings |= {"samples": samples, "max_depth": max_depth, "min_weight": min_weight, "max_rays": UNLIMITED_RAYS}
        image = render(self.scene, resolution=(self.effort.size, self.effort.size), **settings)
        return Drawn(image.radiance, image.render_seconds)

    def theirs(self, samples: int, max_depth: int = DEPTH, sampler: Sampler = "independent", seed: int = 0) -> Drawn:
        """Mitsuba's picture, see ``Film.render``."""
        began = time.perf_counter()
        radiance = self._film.render(samples, max_depth=max_depth, sampler=sampler, seed=seed)
        seconds = time.perf_counter() - began
        self._costs[FILM] = self._costs.get(FILM, 0.0) + seconds
        return Drawn(radiance, seconds)


def run(
    scene: Scene, name: str, effort: PictureTimingEffort, costs: dict[str, float]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The records of the curves and of the split; adds the seconds spent in each reference to ``costs``."""
    bench = Bench(scene, effort, costs)
    halves = [bench.theirs(effort.truth, sampler="stratified", seed=seed).radiance for seed in (1, 2)]
    curves = [*_sampling(bench, (halves[0] + halves[1]) / 2.0), *_truncation(bench)]
    sampled = [{**p, "name": f"{c['who']}, {p['value']} samples"} for c in curves if c["knob"] == "samples"
               for p in c["points"]]  # fmt: skip
    record = {
        "scene": name,
        "size": effort.size,
        "max_depth": DEPTH,
        "deep": DEEP,
        "runs": effort.runs,
        "truth_samples": 2 * effort.truth,
        # The mean of two independent pictures errs by half their difference.
        "truth_rmse": _rmse(halves[0], halves[1]) / 2.0,
        "curves": curves,
        "fronts": {m: [sampled[i]["name"] for i in front([(p["seconds"], p[m]) for p in sampled])] for m in METRICS},
    }
    return record, _split(bench, costs)


def _sampling(bench: Bench, truth: Picture) -> list[dict[str, Any]]:
    ours = {value: partial(bench.ours, samples=value) for value in SAMPLES}
    theirs = {value: partial(bench.theirs, value) for value in bench.effort.theirs}
    curves = [
        _curve("ours", "samples", ours, truth, bench.effort.runs),
        _curve("Mitsuba", "samples", theirs, truth, bench.effort.runs),
    ]
    return [curve | _slopes(curve) for curve in curves]


def _truncation(bench: Bench) -> list[dict[str, Any]]:
    deep = bench.ours(max_depth=DEEP).radiance
    theirs_deep = bench.theirs(1, DEEP, "centre").radiance
    depths = {value: partial(bench.ours, max_depth=value) for value in DEPTHS}
    theirs = {value: partial(bench.theirs, 1, value, "centre") for value in DEPTHS}
    weights = {value: partial(bench.ours, max_depth=DEEP, min_weight=value) for value in WEIGHTS}
    runs = bench.effort.runs
    return [
        _curve("ours", "max_depth", depths, deep, runs),
        _curve("Mitsuba", "max_depth", theirs, theirs_deep, runs),
        _curve("ours", "min_weight", weights, deep, runs),
    ]


def _curve(
    who: str, parameter: str, draws: Mapping[Any, Callable[[], Drawn]], truth: Picture, runs: int
) -> dict[str, Any]:
    """Seconds and errors of every setting."""
    pictures = {value: draw().radiance for value, draw in draws.items()}
    seconds = median_seconds({str(value): partial(_seconds, draw) for value, draw in draws.items()}, runs, unseen=0)
    points = [{"value": v, "seconds": seconds[str(v)]} | _errors(picture, truth) for v, picture in pictures.items()]
    return {"who": who, "knob": parameter, "points": points}


def _slopes(curve: dict[str, Any]) -> dict[str, Any]:
    """Exponents of the errors in the number of samples and in the seconds."""
    points = curve["points"]
    return {
        f"slope_{key}": {m: slope([p[key] for p in points], [p[m] for p in points]) for m in METRICS}
        for key in ("value", "seconds")
    }


def _seconds(draw: Callable[[], Drawn]) -> float:
    return draw().seconds


def _errors(picture: Picture, truth: Picture) -> Point:
    found = compare(picture, truth)
    # Rounding may lift an SSIM above 1.
    return {"rmse": found.rmse, "flip": found.flip, "dissimilarity": max(0.0, 1.0 - found.ssim)}


def _rmse(a: Picture, b: Picture) -> float:
    return float(np.sqrt(np.square(np.subtract(a, b, dtype=np.float64)).mean()))


def _split(bench: Bench, costs: dict[str, float]) -> dict[str, Any]:
    """The error of a picture of one sample a pixel and ``SHALLOW`` bounces, split into its causes.

    Each cause is measured with the others equal on both sides: its RMSE, and the factor by which the seconds rise where
    the parameter halves it.
    """
    converged, deep = bench.ours(samples=CONVERGED).radiance, bench.ours(max_depth=DEEP).radiance
    runs = RUNS if bench.effort.runs > 1 else 1
    sampling = _costed([partial(bench.ours, samples=n) for n in SAMPLES], converged, runs)
    truncation = _costed([partial(bench.ours, max_depth=d) for d in range(SHALLOW, DEPTH + 1)], deep, runs)
    size = bench.effort.size
    rays = mitsuba_scene.camera_rays(bench.scene, size, size, 1)[0]
    judge = spending(costs, mitsuba_path.NAME, partial(mitsuba_path.path, max_depth=DEPTH, rays=rays))
    theirs = judge(bench.scene, size, size)
    return {
        "size": size,
        "parts": [
            {"name": "sampling", "rmse": sampling[0][1], "halved": _halved(sampling),
             "how": f"1 sample against our own {CONVERGED}, depth {DEPTH}"},
            {"name": "truncation", "rmse": truncation[0][1], "halved": _halved(truncation),
             "how": f"depth {SHALLOW} against our own {DEEP}, 1 sample"},
            {"name": "arithmetic", "rmse": _rmse(bench.ours(offset="mitsuba").radiance, theirs), "halved": None,
             "how": f"float64 against Mitsuba's float32: the same primary rays, offset rule and depth {DEPTH}"},
        ],
    }  # fmt: skip


def _costed(draws: Sequence[Callable[[], Drawn]], truth: Picture, runs: int) -> list[tuple[float, float]]:
    """Median seconds of ``runs`` and RMSE of each setting."""
    seconds = median_seconds({str(i): partial(_seconds, draw) for i, draw in enumerate(draws)}, runs, unseen=0)
    return [(seconds[str(i)], _rmse(draw().radiance, truth)) for i, draw in enumerate(draws)]


def _halved(path: Sequence[tuple[float, float]]) -> float | None:
    """The factor in seconds from the first setting to the first with at most half its error; None where none has."""
    seconds, error = path[0]
    return next((s / seconds for s, e in path if e <= 0.5 * error), None)
