"""Metrics to one self-contained HTML page. Draws what the JSON says and computes nothing new."""

import base64
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from validation.plots import stability_figures

_TEMPLATES = Path(__file__).parent / "templates"


def page(metrics: dict[str, Any], pictures: Path) -> str:
    """The report as HTML with every picture of ``pictures`` inside it."""
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["number"] = number
    environment.globals["figures"] = stability_figures
    environment.globals["picture"] = lambda name: _data_uri(pictures / name)
    return environment.get_template("report.html").render(m=metrics)


def number(value: float | int | None) -> str:
    """A measured value for people: four significant digits, whole numbers whole, none as a dash."""
    if value is None:
        return "–"
    if float(value).is_integer() and abs(value) < 1e15:
        return f"{int(value):,}"
    if 1e-3 <= abs(value) < 1e4:
        # Values just below 1 (an SSIM) keep the digits that tell them from 1.
        return f"{value:.7f}" if 0.99 < value < 1.0 else f"{value:.4g}"
    return f"{value:.2e}"


def _data_uri(path: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()
