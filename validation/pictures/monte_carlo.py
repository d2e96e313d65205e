"""Glass judged by Mitsuba's own path integrator: no recursion of ours, but a random branch at every surface.

Whitted follows both branches of glass; a path takes one, by Fresnel's share. So the mean over N paths of a pixel tends
to our picture, and two properties are judged: the error falls as 1 / sqrt(N), which an error of ours would stop, and
the remaining error is no more than the paths' own scatter explains.

Left out are pixels that rounding may decide, that the rule for media decides, or that differ from reference B, which
follows both branches: these have a reason or are red (``explain``).
"""

import math
import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.materials.dielectric import Dielectric
from renderer.materials.phong import Phong
from renderer.picture.prepare import MediaRule
from renderer.picture.render import prepare
from renderer.scene.camera import primary_rays
from renderer.scene.scene import Scene
from validation.error_curves import slope
from validation.gates import Gate
from validation.pictures.compare import VISIBLE, fragile_pixels, srgb
from validation.pictures.explain.pixels import RED, Explainer
from validation.pictures.one_ray import Offset, picture
from validation.pictures.shifted_film import shifted
from validation.references.mitsuba import path as mitsuba_path
from validation.references.mitsuba import whitted as mitsuba_whitted

PATHS = "random paths of Mitsuba's native path integrator (scalar_rgb)"

# Paths a pixel; each number uses the paths of those before it.
_COUNTS = (4, 16, 64, 256)
_QUICK_COUNTS = _COUNTS[:3]
# Glass pixels that are judged, spread over all of them: the slope below needs as many. The smallest of these pictures
# that has so many is used.
_PIXELS = 1024
_SIZES = (128, 256, 512)
# Least squares over 3 or 4 numbers of paths gives the slope .51 or .32 times the deviation of the RMSEs' logarithms.
# Twenty disjoint runs of 64 paths over glass.toml had a mean of -.5007 and a deviation of .008; where paths are rarer
# and brighter the deviation is up to .013, and 4 of these are allowed. An ior of 1.501 for 1.5 flattens the slope by
# .12.
_SLOPE = 0.05
# Neighbouring pixels are judged by their mean: where Fresnel's share is 4 %, the 64 paths of one pixel take the rare
# branch three times, or never, and their sample variance then means nothing. 32 pixels take it 80 times, and resampling
# the paths of glass.toml then gave uniform p-values, a little high because the channels are correlated; 4 pixels gave p
# < .001 in every sixth run.
_GROUP = 32
# The rate of false alarms: a sound picture fails once in 10,000 scenes. The paths are the same in every run, so the
# result does not vary.
_FALSE_ALARMS = 1e-4
# Float32 against float64 under the same offset rule, as in thresholds.py; it is the scale for a group without scatter.
_FLOAT32 = 2e-5
# Share of the glass pixels. Edges and total reflection make glass far more fragile than a whole picture's .24 %: 4 %
# were measured for glass.toml. At 1 nothing would be judged.
_FRAGILE_SHARE = 0.15


@dataclass(frozen=True)
class Scatter:
    """Our picture against the scatter of random paths.

    rmse : of the mean over each number of paths, over pixels and channels.
    slope : exponent of the RMSE against the number of paths; -1/2 without bias, None where no error has a logarithm.
    bias : root mean square of the error beyond the paths' scatter at the largest number; about 0 or noise.
    z_max : largest deviation of a group's mean, in standard errors.
    p_value : probability of a larger one in a sound picture, for all groups and channels together.
    groups : of up to 32 neighbouring pixels.
    """

    rmse: list[float]
    slope: float | None
    bias: float
    z_max: float
    p_value: float
    groups: int


def can_judge(scene: Scene) -> str | None:
    """Why random paths cannot judge ``scene``; None if they can."""
    if not scene.render.shadows:
        return mitsuba_path.SHADOWLESS
    if scene.camera.film_size is not None:
        return "a calibrated camera, whose film is not the square that random paths are shown on"
    if any(isinstance(scene.materials[i.material], Dielectric) for i in scene.instances):
        return None
    return "nothing is random without a dielectric; one path a ray is the picture"


def run(scene: Scene, name: str, quick: bool, own: bool = True) -> tuple[dict[str, Any], list[Gate]]:
    """Judge our picture of the glass in ``scene``; returns a record for JSON and the gates, none for too little glass.

    own : whether it is one of the suite's own scenes, which the thresholds of slope and share were set for.

    Raises ``ValueError`` if ``can_judge`` gives a reason.
    """
    fault = can_judge(scene)
    if fault is not None:
        raise ValueError(f"{name}: expected a scene with glass, got one where {fault}")
    counts = _QUICK_COUNTS if quick else _COUNTS
    judged, left_out = _without_transmission(scene)
    size, shown, steady = _glass(judged)
    ours = _picture(judged, size)
    ruled = np.abs(ours - _picture(judged, size, media="normal")).max(axis=2).ravel() > _FLOAT32
    record: dict[str, Any] = {"name": name, "size": size, "pixels": 0, "left_out": left_out}
    if shown.sum() < _PIXELS:
        few = f"glass is seen in {shown.sum()} pixels of {size} x {size}, and the error's slope needs {_PIXELS}"
        return record | {"left_out": [*left_out, few], "paths": [], "seconds": 0.0, "costs": {PATHS: 0.0}}, []
    rows = np.flatnonzero(steady & ~ruled)
    rows = rows[np.linspace(0, len(rows) - 1, min(_PIXELS, len(rows))).astype(int)]
    origins, directions = primary_rays(judged.camera, size, size)
    depth = judged.render.max_depth
    unexplained, kept = _explained(judged, size, ours, rows)
    rows = rows[kept]
    if len(rows) < _GROUP:
        few = f"{len(rows)} pixels of glass are steady and decided by no rule, and a group has {_GROUP}"
        return record | {"left_out": [*left_out, few], "paths": [], "seconds": 0.0, "costs": {PATHS: 0.0}}, []
    began = time.perf_counter()
    paths = mitsuba_path.random_paths(judged, (origins[rows], directions[rows]), counts[-1], max_depth=depth)
    seconds = time.perf_counter() - began
    scatter = scatter_of(ours.reshape(-1, 3)[rows], paths, counts)
    shares = {"fragile_share": 1.0 - float(steady.sum() / shown.sum()), "ruled_share": float(ruled[shown].mean())}
    record |= {"pixels": len(rows), "paths": list(counts), "seconds": seconds} | shares
    record |= asdict(scatter) | {"costs": {PATHS: seconds}}
    return record, _gates(name, scatter, shares["fragile_share"], unexplained, own)


def scatter_of(ours: NDArray[np.float64], paths: NDArray[np.float64], counts: tuple[int, ...]) -> Scatter:
    """Our radiance (n, 3) against random paths (count, n, 3); consecutive pixels are neighbours.

    counts : ascending numbers of paths; the last is the number of all.
    """
    largest = counts[-1]
    rmse = [float(np.sqrt(np.mean((paths[:count].mean(axis=0) - ours) ** 2))) for count in counts]
    error = paths.mean(axis=0) - ours
    variance = paths.var(axis=0, ddof=1) / largest
    starts = np.arange(0, len(ours), _GROUP)
    # A sum's variance is the sum of the variances; float32's error may be the same in all pixels of a group.
    sizes = np.diff([*starts, len(ours)])[:, None]
    scatter = np.add.reduceat(variance, starts) + (_FLOAT32 * sizes) ** 2
    z_max = float(np.abs(np.add.reduceat(error, starts) / np.sqrt(scatter)).max())
    return Scatter(
        rmse=rmse,
        slope=slope(counts, rmse),
        bias=math.sqrt(max(0.0, float(np.mean(error**2 - variance)))),
        z_max=z_max,
        p_value=sidak(z_max, 3 * len(starts)),
        groups=len(starts),
    )


def sidak(z: float, tests: int) -> float:
    """Probability that the largest of ``tests`` normal deviates exceeds z in size: 1 - (1 - p)^tests (Sidak 1967).

    Exact for independent tests; for channels, which are correlated, it errs towards no alarm.
    """
    p = math.erfc(z / math.sqrt(2.0))
    return -math.expm1(tests * math.log1p(-p)) if p < 1.0 else 1.0


def _without_transmission(scene: Scene) -> tuple[Scene, list[str]]:
    """The scene without features that no surface of Mitsuba has, and their names."""
    black = {"transmittance": (0.0, 0.0, 0.0)}
    opaque = {
        name: material.model_copy(update=black)
        for name, material in scene.materials.items()
        if isinstance(material, Phong) and material.passes_light
    }
    left_out = [f"materials.{name}: transmittance" for name in sorted(opaque)]
    return scene.altered(materials={**scene.materials, **opaque}), left_out


def _glass(scene: Scene) -> tuple[int, NDArray[np.bool_], NDArray[np.bool_]]:
    """The picture's size, its pixels (flat) whose primary ray meets glass, and those of them that are not fragile.

    Mitsuba finds the pixels that show glass, so that no error of ours can leave a pixel out.
    """
    glass = [i for i, of in enumerate(scene.instances) if isinstance(scene.materials[of.material], Dielectric)]
    for size in _SIZES:
        shown = np.isin(mitsuba_whitted.aovs(scene, size, size).instance, glass)
        if shown.sum() >= _PIXELS:
            break
    fragile = fragile_pixels(lambda offset, shift: _picture(shifted(scene, shift), size, offset))
    return size, shown.ravel(), (shown & ~fragile).ravel()


def _explained(
    scene: Scene, size: int, ours: NDArray[np.float64], rows: NDArray[np.intp]
) -> tuple[int, NDArray[np.bool_]]:
    """The number of pixels that differ from reference B without a reason; and a mask of those that are judged, all that
    differ for none.

    One pixel that a float32 rounding decides weighs more than the scatter of its group where Fresnel's share is small.
    """
    origins, directions = primary_rays(scene.camera, size, size)
    rays = origins[rows], directions[rows]
    theirs = mitsuba_whitted.whitted(scene, len(rows), 1, max_depth=scene.render.max_depth, rays=rays)[0]
    other = np.abs(srgb(ours.reshape(-1, 3)[rows]) - srgb(theirs)).max(axis=1) > VISIBLE
    if not other.any():
        return 0, ~other
    explainer = Explainer(prepare(scene), (size, size))
    normal = _picture(scene, size, media="normal")
    found = explainer.explain("matched", normal, [divmod(int(row), size) for row in rows[other]])
    reasoned = {pixel.row * size + pixel.column for pixel in found.pixels if pixel.reason not in RED}
    return sum(found.counts()[reason] for reason in RED), ~np.isin(rows, list(reasoned))


def _picture(scene: Scene, size: int, offset: Offset = "mitsuba", media: MediaRule = "stack") -> NDArray[np.float64]:
    """Our picture through the pixels' centres, (size, size, 3)."""
    return picture(scene, (size, size), offset, media).radiance.astype(np.float64)


def _gates(name: str, scatter: Scatter, fragile: float, unexplained: int, own: bool) -> list[Gate]:
    subject = f"{name} against random paths"
    off = math.nan if scatter.slope is None else abs(scatter.slope + 0.5)
    falls = "the error falls as 1 / sqrt(N); it stops falling where our picture is wrong"
    chance = f"a correct picture gives less once in {1.0 / _FALSE_ALARMS:,.0f} scenes; groups of {_GROUP} pixels, Sidak"
    few = "the others are judged outside these pixels, so they must stay few"
    walked = "they are left out, so each must have a reason"
    found = [
        Gate("images", subject, "p-value of the largest z", scatter.p_value, "at least", _FALSE_ALARMS, chance),
        Gate("images", subject, "pixels that differ without a reason", unexplained, "at most", 0.0, walked),
    ]
    if own:
        found += [
            Gate("images", subject, "distance of the slope of log RMSE from -1/2", off, "at most", _SLOPE, falls),
            Gate("images", subject, "fragile share of the glass", fragile, "at most", _FRAGILE_SHARE, few),
        ]
    return found
