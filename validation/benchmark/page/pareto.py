"""Figures of error against run time, drawn from the record of ``validation.benchmark.parameters.study.run`` alone."""

from collections.abc import Mapping, Sequence
from typing import Any

from validation.report.plots import Panel, Series, draw

_NAMES = {
    "float64": "ours, float64",
    "float32": "ours, float32",
    "embree_default": "Embree default",
    "embree_robust": "Embree robust",
}


def figures(record: Mapping[str, Any]) -> list[dict[str, str]]:
    """For each figure a title (also its caption) and an ``<svg>`` element."""
    hits, pictures = record["hits"], record["pictures"]
    drawn = [_storage_figure(hits, family) for family in hits["storage"]]
    drawn += [_tree_figure(hits, family["rays"]) for family in hits["storage"]]
    return drawn + [_scene_figure(pictures, scene) for scene in pictures["scenes"]]


def _storage_figure(hits: Mapping[str, Any], family: Mapping[str, Any]) -> dict[str, str]:
    quantities = ("p50", "p99", "max")
    series = [
        Series(_NAMES[p["name"]], [p["ns_per_ray"]] * 3, [p["errors"][quantity] for quantity in quantities])
        for p in family["points"]
    ]
    title = (
        f"Storage, {family['rays']} rays: relative error of t against exact arithmetic on the unrounded mesh of "
        f"{hits['mesh']['faces']:,} faces ({family['judged']:,} rays judged; from below the median, the 99th "
        f"percentile and the largest), against nanoseconds a ray on one thread (median of {hits['runs']}). "
        f"On the front by the 99th percentile: {_listed(family['fronts']['p99'])}."
    )
    panel = Panel(series, "relative error of t", roundoffs=True)
    return {"title": title, "svg": draw([panel], x_label="ns a ray", title=f"Storage, {family['rays']} rays")}


def _tree_figure(hits: Mapping[str, Any], family: str) -> dict[str, str]:
    tree = hits["tree"]
    points = {p["name"]: p for p in tree["points"]}
    rows = {sweep: [points[name] for name in names] for sweep, names in tree["sweeps"].items()}
    seconds = {sweep: [p["build_seconds"] for p in row] for sweep, row in rows.items()}
    panels = [
        Panel([Series(k, seconds[k], [p["ns_per_ray"][family] for p in row]) for k, row in rows.items()], "ns a ray"),
        Panel([Series(k, seconds[k], [p["bytes"] for p in row]) for k, row in rows.items()], "bytes"),
    ]
    differing = tree["differing_rays"]
    verdict = "no ray's answer differs in a bit" if differing == 0 else f"{differing:,} answers differ"
    title = (
        f"The tree's parameters, {family} rays: nanoseconds a ray and bytes against seconds to build. Between all "
        f"trees {verdict}. On the front: {_listed(tree['front_build_seconds_ns_per_ray'][family])}."
    )
    return {
        "title": title,
        "svg": draw(panels, x_label="build, seconds", title=f"The tree's parameters, {family} rays"),
    }


def _scene_figure(pictures: Mapping[str, Any], scene: Mapping[str, Any]) -> dict[str, str]:
    points = [p for parameter in scene["knobs"].values() for p in parameter["points"]]
    named = {p["name"]: p for p in points}
    best = [named[name] for name in scene["front"]]
    panels = [
        Panel([*_curves(scene, "rmse_all"), _curve("front", best, "rmse_all")], "RMSE to all converged"),
        Panel(_curves(scene, "rmse"), "to this parameter's"),
    ]
    reference, size = scene["reference"], pictures["size"]
    slope = scene["knobs"]["samples"]["slope_value"]
    fitted = "" if slope is None else f" RMSE falls with samples to the power {slope:.2f}."
    title = (
        f"{scene['name']}, {size} x {size}: RMSE of linear radiance against seconds to trace (median of "
        f"{pictures['runs']}). The reference is {pictures['reference']}; above with {reference['samples']:,} samples "
        f"and depth {reference['max_depth']}, below with this parameter alone converged.{fitted} "
        "An error of 0 is left out."
    )
    return {"title": title, "svg": draw(panels, x_label="seconds", title=f"Error against run time, {scene['name']}")}


def _curves(scene: Mapping[str, Any], error: str) -> list[Series]:
    return [_curve(name, parameter["points"], error) for name, parameter in scene["knobs"].items()]


def _curve(name: str, points: Sequence[Mapping[str, Any]], error: str) -> Series:
    # An exact 0 is left out beside errors of a percent; drawn at the figure's floor, it would flatten the curves.
    return Series(name, [p["seconds"] for p in points], [p[error] or None for p in points])


def _listed(names: Sequence[str]) -> str:
    return "; ".join(_NAMES.get(name, name) for name in names) or "none"
