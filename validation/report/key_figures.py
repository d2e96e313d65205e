"""The three small figures at the head of the page; the sections and the appendix have the large ones."""

from collections.abc import Mapping
from typing import Any

from validation.report.efficiency_figures import curve
from validation.report.figures import error_panel, leak_panel
from validation.report.plots import Panel, draw

_SIZE = (400, 300)


def figures(metrics: Mapping[str, Any]) -> list[dict[str, str]]:
    """Of each figure whose section ran: a title (also its caption), an ``<svg>`` element and the section."""
    curves = metrics.get("stability", {}).get("curves", {})
    pictures = metrics.get("efficiency", {}).get("tradeoff_pictures")
    found = [_error_by_offset(curves["offset"])] if "offset" in curves else []
    found += [_leaks(curves["leaks"])] if "leaks" in curves else []
    return found + ([_error_by_time(pictures)] if pictures else [])


def _error_by_offset(sweep: Mapping[str, Any]) -> dict[str, str]:
    title = "Error of the hit distance by offset from the origin"
    svg = draw([error_panel(sweep)], x_label=sweep["label"], title=title, size=_SIZE)
    return {"title": title, "svg": svg, "section": "stability"}


def _leaks(rows: list[Mapping[str, Any]]) -> dict[str, str]:
    title = (
        f"Watertightness: leaks of {rows[0]['rays']:,} rays from inside a closed sphere; none is drawn as half a ray"
    )
    svg = draw([leak_panel(rows)], x_label="faces", title=title, size=_SIZE)
    return {"title": title, "svg": svg, "section": "stability"}


def _error_by_time(pictures: Mapping[str, Any]) -> dict[str, str]:
    curves = [c for c in pictures["curves"] if c["knob"] == "samples"]
    series = [curve(c["who"], c, "rmse", look) for look, c in enumerate(curves)]
    title = f"Error against run time: {pictures['scene']}, with more and more samples a pixel"
    svg = draw([Panel(series, "RMSE, linear")], x_label="seconds", title=title, size=_SIZE)
    return {"title": title, "svg": svg, "section": "efficiency"}
