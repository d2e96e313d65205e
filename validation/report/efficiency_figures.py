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
    labels = {p["name"]: p["label"] for p in points}
    title = (
        f"Camera rays on the {hits['mesh']['name']}, {hits['mesh']['faces']:,} faces: throughput (median of "
        f"{hits['runs']} rounds) against the 99th percentile of the relative error of t ({hits['judged']:,} rays, "
        "exact arithmetic on the unrounded mesh), and against the share of "
        f"{max(p['leak_rays'] for p in points):,} rays from inside at edges and vertices that meet nothing; none is "
        "drawn as half a ray. "
        "A t stored as float32 cannot be better than about 6e-8, one stored as float64 than 1e-16. "
        f"On the Pareto front of error: {_listed(hits['fronts']['p99'], labels)}; "
        f"of leaks: {_listed(hits['fronts']['leaks'], labels)}."
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
            _curve(f"{c['who']}, RMSE ~ N^{c['slope_value']['rmse']:.2f}", c, quantity, look)
            for look, c in enumerate(curves)
        ]
        front = Series("Pareto front", [p["seconds"] for p in best], [p[quantity] for p in best], PLAIN)
        panels.append(Panel([*series, front], label))
    size = pictures["size"]
    fitted = "; ".join(f"{c['who']} {c['slope_seconds']['rmse']:.2f}" for c in curves)
    title = (
        f"{pictures['scene']}, {size} × {size}, depth {pictures['max_depth']}: error against seconds to trace over "
        f"samples a pixel, ours on a regular grid, Mitsuba's at random. The truth is Mitsuba's own film at "
        f"{pictures['truth_samples']:,} stratified samples, whose own noise has an RMSE of "
        f"{pictures['truth_rmse']:.1e}. RMSE falls with samples to the power in the legend (-1/2 is the law of random "
        f"samples), and with seconds to the power {fitted}. "
        f"On the Pareto front of RMSE: {'; '.join(pictures['fronts']['rmse'])}."
    )
    return {"title": title, "svg": draw(panels, x_label="seconds", title="Pictures: sampling error against run time")}


def _truncation_figure(pictures: Mapping[str, Any]) -> dict[str, str]:
    curves = [c for c in pictures["curves"] if c["knob"] != "samples"]
    panels = [
        Panel(
            [_curve(f"{c['who']}, {_PARAMETERS[c['knob']]}", c, quantity, look) for look, c in enumerate(curves)], label
        )
        for quantity, label in _QUANTITIES.items()
    ]
    values = "; ".join(
        f"{c['who']}, {_PARAMETERS[c['knob']]} {c['points'][0]['value']:g} to {c['points'][-1]['value']:g}"
        for c in curves
    )
    title = (
        f"{pictures['scene']}: error against seconds over depth and least weight, 1 sample a pixel ({values}). Each is "
        f"compared with the same renderer's picture of depth {pictures['deep']} and no least weight: this measures "
        "truncation, not correctness. An error below float32's roundoff of 6e-8 is left out."
    )
    return {"title": title, "svg": draw(panels, x_label="seconds", title="Pictures: truncation against run time")}


def _curve(name: str, curve: Mapping[str, Any], quantity: str, look: int) -> Series:
    points = curve["points"]
    errors = [p[quantity] if p[quantity] > _ROUNDOFF else None for p in points]
    return Series(name, [p["seconds"] for p in points], errors, look)


def _listed(names: Sequence[str], labels: Mapping[str, str]) -> str:
    return "; ".join(labels[name] for name in names) or "none"
