"""Figures of the sections on stability, studies and pictures, drawn from their records alone."""

from collections.abc import Mapping, Sequence
from typing import Any

from validation.report.plots import FLOOR, PLAIN, Panel, Series, draw, loglog

_NAMES = {"ours": "ours (float64)", "embree_default": "Embree default", "embree_robust": "Embree robust"}


def stability_figures(record: Mapping[str, Any]) -> list[dict[str, str]]:
    """Figures of the record of ``stability.sweeps.run``: for each a title (also its caption) and an SVG."""
    sweeps = {name: part for name, part in record.items() if isinstance(part, dict) and "points" in part}
    return [_error_figure(name, part) for name, part in sweeps.items()] + [_leak_figure(record["leaks"])]


def _error_figure(name: str, sweep: Mapping[str, Any]) -> dict[str, str]:
    wrong = Panel(_by_kernel(sweep, "wrong_share"), "wrong", share=True)
    title = (
        f"Error against {name}: the largest of {sweep['points'][0]['rays']} rays at each point, and the share of wrong "
        f"answers (missed, falsely hit, or another face). An error of 0 is drawn at {FLOOR:.0e}."
    )
    shown = draw([error_panel(sweep), wrong], x_label=sweep["label"], title=f"Error of t against {name}")
    return {"title": title, "svg": shown}


def error_panel(sweep: Mapping[str, Any]) -> Panel:
    """The largest error of t at each x of a sweep, a curve for each kernel."""
    return Panel(_by_kernel(sweep, "relative_max"), "largest relative error of t", roundoffs=True)


def _by_kernel(sweep: Mapping[str, Any], quantity: str) -> list[Series]:
    points = sweep["points"]
    x = [p["x"] for p in points]
    return [Series(shown, x, [p[kernel][quantity] for p in points]) for kernel, shown in _NAMES.items()]


def _leak_figure(rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    title = (
        f"Leaks from inside icospheres, {rows[0]['rays']:,} rays a mesh, half at edges and half at vertices. No leak "
        f"is drawn at {_half_a_ray(rows):.3g} a million, half a ray."
    )
    return {"title": title, "svg": draw([leak_panel(rows)], x_label="faces", title="Leaks against mesh size")}


def leak_panel(rows: Sequence[Mapping[str, Any]]) -> Panel:
    """Leaks of spheres by their number of faces, a curve for each kernel."""
    x, floor = [row["faces"] for row in rows], _half_a_ray(rows)
    series = [Series(s, x, [1e6 * row[k] / row["rays"] or floor for row in rows]) for k, s in _NAMES.items()]
    return Panel(series, "leaks per million rays")


def _half_a_ray(rows: Sequence[Mapping[str, Any]]) -> float:
    """No leak is drawn as this many a million: half a ray, the resolution of this many rays."""
    return 0.5e6 / max(row["rays"] for row in rows)


def studies_figures(record: Mapping[str, Any]) -> list[dict[str, str]]:
    """The error of studies against directions: a figure with a title (also its caption) and an ``<svg>`` element."""
    curves, patches = record["slopes"], record["patches"]
    series = [Series(f"{c['subject']}, lattice, N^{c['slope']:.2f}", c["counts"], c["rms"]) for c in curves]
    series += [Series(f"{c['subject']}, patches", patches, c["patches"]) for c in curves]
    first = curves[0]
    chance = [first["rms"][0] * (n / first["counts"][0]) ** -0.5 for n in first["counts"]]
    series.append(Series("random, N^-0.50", first["counts"], chance, PLAIN))
    title = (
        "RMS error of the sky view factor over the floor of an endless street by the number of directions: even "
        "lattices, the patches of Tregenza (145) and Reinhart (577), and the slope of random directions."
    )
    shown = draw([Panel(series, "error of the share")], x_label="directions", title="Studies: error against directions")
    return [{"title": title, "svg": shown}]


def monte_carlo_figure(record: Mapping[str, Any]) -> str:
    """The error of random paths against their number, and the law 1 / sqrt(N) through its first point, as ``<svg>``."""
    counts, errors = record["paths"], record["rmse"]
    law = [errors[0] * (counts[0] / count) ** 0.5 for count in counts]
    series = [Series("mean of N paths against ours", counts, errors), Series("1 / sqrt(N)", counts, law, PLAIN)]
    title = f"Error of random paths, {record['name']}"
    return loglog(series, x_label="paths a pixel, N", y_label="RMSE of radiance", title=title)
