"""The three plots at the head of the report: error of t far from the origin, leaks, and error against run time."""

from collections.abc import Mapping
from typing import Any

from validation.report.efficiency_figures import contenders
from validation.report.figures import error_series, leak_series
from validation.report.plots import Panel, draw

# Three beside each other on a wide page, whose text is still as large as the page's small print.
_WIDTH = 400


def figures(metrics: Mapping[str, Any]) -> list[dict[str, str]]:
    """Those whose sections ran: a title, which is the caption too, and an ``<svg>`` element."""
    found = []
    if "stability" in metrics:
        curves = metrics["stability"]["curves"]
        found += [_offset(curves["offset"]), _leaks(curves["leaks"])]
    if "tradeoff_hits" in metrics.get("efficiency", {}):
        found.append(_run_time(metrics["efficiency"]["tradeoff_hits"]))
    return found


def _offset(sweep: Mapping[str, Any]) -> dict[str, str]:
    panel = Panel(error_series(sweep["points"]), "largest relative error of t", roundoffs=True)
    return _figure(panel, sweep["label"], "Error of the hit distance far from the origin")


def _leaks(rows: Any) -> dict[str, str]:
    panel = Panel(leak_series(rows), "leaks per million rays")
    return _figure(panel, "faces", "Leaks at edges and vertices of closed meshes; none is drawn as half a ray")


def _run_time(hits: Mapping[str, Any]) -> dict[str, str]:
    errors = {p["name"]: p["errors"]["p99"] for p in hits["points"]}
    panel = Panel(contenders(hits["points"], errors, hits["fronts"]["p99"]), "p99 relative error of t")
    return _figure(
        panel, "million rays a second", f"Error against speed, camera rays at {hits['mesh']['faces']:,} faces"
    )


def _figure(panel: Panel, x_label: str, title: str) -> dict[str, str]:
    return {"title": f"{title}.", "svg": draw([panel], x_label=x_label, title=title, width=_WIDTH)}
