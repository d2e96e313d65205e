"""Figures of error against run time, drawn from the record of ``validation.efficiency.section.run`` alone."""

from collections.abc import Mapping, Sequence
from typing import Any

from validation.report.plots import PLAIN, Panel, Series, draw

# Roundoff of float32, in which pictures are stored: a smaller error is meaningless beside errors of a percent.
_ROUNDOFF = 2.0**-24
_QUANTITIES = {"rmse": "RMSE, linear", "flip": "FLIP", "dissimilarity": "1 - SSIM"}
_PARAMETERS = {"samples": "samples", "max_depth": "depth", "min_weight": "least weight"}


def figures(record: Mapping[str, Any]) -> list[dict[str, str]]:
    """For each figure a title (also its caption) and an ``<svg>`` element."""
    hits, pictures = record["tradeoff_hits"], record["tradeoff_pictures"]
    return [_hits_figure(hits), _samples_figure(pictures), _truncation_figure(pictures)]


def _hits_figure(hits: Mapping[str, Any]) -> dict[str, str]:
    points = hits["points"]
    # No leak is drawn as half a ray, the resolution of this many rays.
    leaks = {p["name"]: (p["leaks"] or 0.5) / p["leak_rays"] for p in points}
    errors = {p["name"]: p["errors"]["p99"] for p in points}
    panels = [
        Panel(_contenders(points, errors, hits["fronts"]["p99"]), "p99 relative error of t"),
        Panel(_contenders(points, leaks, hits["fronts"]["leaks"]), "share that leaks"),
    ]
    title = (
        f"Camera rays at the {hits['mesh']['name']} of {hits['mesh']['faces']:,} faces: speed against the 99th "
        f"percentile of the relative error of t over {hits['judged']:,} rays, judged by exact arithmetic, and against "
        f"the share of {max(p['leak_rays'] for p in points):,} rays from inside that leak at edges and vertices. No "
        "leak is drawn as half a ray. Storing t as float32 alone costs 6e-8, as float64 1e-16."
    )
    shown = draw(panels, x_label="million rays a second", title="Hits: error against throughput")
    return {"title": title, "svg": shown}


def _contenders(
    points: Sequence[Mapping[str, Any]], errors: Mapping[str, float | None], names: Sequence[str]
) -> list[Series]:
    """A marker for each contender, and the front as a line through its markers."""
    speeds = {p["name"]: p["mrays"] for p in points}
    series = [Series(p["label"], [p["mrays"]], [errors[p["name"]]], look) for look, p in enumerate(points)]
    return [*series, Series("Pareto front", [speeds[n] for n in names], [errors[n] for n in names], PLAIN)]


def _samples_figure(pictures: Mapping[str, Any]) -> dict[str, str]:
    curves = [c for c in pictures["curves"] if c["knob"] == "samples"]
    named = {f"{c['who']}, {p['value']} samples": p for c in curves for p in c["points"]}
    panels = []
    for quantity, label in _QUANTITIES.items():
        best = [named[name] for name in pictures["fronts"][quantity]]
        series = [
            curve(f"{c['who']}, RMSE ~ N^{c['slope_value']['rmse']:.2f}", c, quantity, look)
            for look, c in enumerate(curves)
        ]
        front = Series("Pareto front", [p["seconds"] for p in best], [p[quantity] for p in best], PLAIN)
        panels.append(Panel([*series, front], label))
    size = pictures["size"]
    title = (
        f"{pictures['scene']}, {size} × {size}, depth {pictures['max_depth']}: error against run time over samples a "
        f"pixel, ours on a regular grid, Mitsuba's at random. The truth is Mitsuba's film of "
        f"{pictures['truth_samples']:,} stratified samples, whose noise has an RMSE of {pictures['truth_rmse']:.1e}. "
        "The legend has the exponent with which RMSE falls with samples; it is -1/2 for random ones."
    )
    return {"title": title, "svg": draw(panels, x_label="seconds", title="Pictures: sampling error against run time")}


def _truncation_figure(pictures: Mapping[str, Any]) -> dict[str, str]:
    curves = [c for c in pictures["curves"] if c["knob"] != "samples"]
    panels = [
        Panel(
            [curve(f"{c['who']}, {_PARAMETERS[c['knob']]}", c, quantity, look) for look, c in enumerate(curves)], label
        )
        for quantity, label in _QUANTITIES.items()
    ]
    title = (
        f"{pictures['scene']}: truncation error against run time over depth and least weight, 1 sample a pixel. Each "
        f"picture is compared with the same renderer's of depth {pictures['deep']} and no least weight. Errors below "
        "float32's roundoff of 6e-8 are left out."
    )
    return {"title": title, "svg": draw(panels, x_label="seconds", title="Pictures: truncation against run time")}


def curve(name: str, record: Mapping[str, Any], quantity: str, look: int) -> Series:
    """A quantity of one curve of the record against its seconds."""
    points = record["points"]
    errors = [p[quantity] if p[quantity] > _ROUNDOFF else None for p in points]
    return Series(name, [p["seconds"] for p in points], errors, look)
