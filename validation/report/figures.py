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
    points = sweep["points"]
    x = [p["x"] for p in points]
    wrong = [Series(shown, x, [p[kernel]["wrong_share"] for p in points]) for kernel, shown in _NAMES.items()]
    panels = [
        Panel(error_series(points), "largest relative error of t", roundoffs=True),
        Panel(wrong, "wrong", share=True),
    ]
    title = (
        f"Error against {name}: the largest of {points[0]['rays']} rays at each point, and the share of wrong answers "
        f"(missed, falsely hit, or another face). An error of 0 is drawn at {FLOOR:.0e}."
    )
    return {"title": title, "svg": draw(panels, x_label=sweep["label"], title=f"Error of t against {name}")}


def _leak_figure(rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    title = (
        f"Leaks from inside icospheres, {rows[0]['rays']:,} rays a mesh, half at edges and half at vertices. No leak "
        f"is drawn at {_half_a_ray(rows):.3g} a million, half a ray."
    )
    svg = loglog(leak_series(rows), x_label="faces", y_label="leaks per million rays", title="Leaks against mesh size")
    return {"title": title, "svg": svg}


def error_series(points: Sequence[Mapping[str, Any]]) -> list[Series]:
    """The largest relative error of t of each contender."""
    x = [p["x"] for p in points]
    return [Series(shown, x, [p[kernel]["relative_max"] for p in points]) for kernel, shown in _NAMES.items()]


def leak_series(rows: Sequence[Mapping[str, Any]]) -> list[Series]:
    """Each contender's leaks per million rays by the mesh's faces."""
    x, floor = [row["faces"] for row in rows], _half_a_ray(rows)
    return [Series(s, x, [1e6 * row[k] / row["rays"] or floor for row in rows]) for k, s in _NAMES.items()]


def _half_a_ray(rows: Sequence[Mapping[str, Any]]) -> float:
    """What stands for no leak: half the resolution of this many rays, per million."""
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
