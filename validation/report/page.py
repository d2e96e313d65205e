"""The report page: renders the metrics as one self-contained HTML file and computes nothing new."""

import base64
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from validation.report import chapters, efficiency_figures, figures, key_figures

_TEMPLATES = Path(__file__).parent / "templates"

# Functions for templates that draw curves from a record: figures with a title and an SVG, or the SVG alone.
FIGURES: dict[str, Callable[..., Any]] = {
    "key_figures": key_figures.figures,
    "stability_figures": figures.stability_figures,
    "efficiency_figures": efficiency_figures.figures,
    "monte_carlo_figure": figures.monte_carlo_figure,
    "studies_figures": figures.studies_figures,
}


def page(metrics: dict[str, Any], pictures: Path) -> str:
    """The report as HTML, with every picture of ``pictures`` that it shows embedded."""
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    shown = PictureClasses(pictures)
    environment.filters["number"] = number
    environment.globals |= FIGURES
    environment.globals["shown"] = shown
    environment.globals["failed_files"] = failed_files
    environment.globals["partials"] = chapters.PARTIALS
    shown_chapters, absent = chapters.present(metrics), chapters.absent(metrics)
    return environment.get_template("report.html").render(m=metrics, chapters=shown_chapters, absent=absent)


class PictureClasses:
    """The PNGs of a folder as CSS classes, so that the page contains equal ones only once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._paths: dict[str, Path] = {}

    def css_class(self, name: str) -> str:
        """The class whose background is the picture; raises ``OSError`` where there is no such file."""
        path = self._folder / name
        css_class = "png-" + hashlib.sha256(path.read_bytes()).hexdigest()[:16]
        self._paths.setdefault(css_class, path)
        return css_class

    def rules(self) -> str:
        """A CSS rule for each picture that was used."""
        return "\n".join(
            f'.{name} {{ aspect-ratio: {_size(path)}; background-image: url("{_data_uri(path)}"); }}'
            for name, path in self._paths.items()
        )


def failed_files(metrics: dict[str, Any], gate: dict[str, Any]) -> list[str]:
    """Names, in the pictures folder, of the files of a failing gate.

    The section's record has them in a table with the gate's ``subject`` and a list or table ``failed``.
    """
    found: dict[str, None] = {}
    tables = [metrics[gate["section"]]]
    while tables:
        table = tables.pop(0)
        below = list(table.values()) if isinstance(table, dict) else table
        if isinstance(table, dict) and table.get("subject") == gate["subject"] and table.get("failed"):
            files = table["failed"]
            found |= dict.fromkeys(files.values() if isinstance(files, dict) else files)
        tables += [value for value in below if isinstance(value, dict | list)]
    return list(found)


def number(value: float | int | None) -> str:
    """A measured value for people: four significant digits, integers without a point, None as a dash."""
    if value is None:
        return "–"
    if float(value).is_integer() and abs(value) < 1e15:
        return f"{int(value):,}"
    if 1e-3 <= abs(value) < 1e4:
        # Values just below 1 (an SSIM) keep the digits that distinguish them from 1.
        if 0.99 < value < 1.0:
            return f"{value:.7f}" if 1.0 - value > 5e-8 else f"1 − {1.0 - value:.0e}"
        return f"{value:.4g}"
    return f"{value:.2e}"


def _data_uri(path: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()


def _size(path: Path) -> str:
    """Width / height from the header of a PNG (its section 11.2.2)."""
    header = path.read_bytes()[:24]
    return f"{int.from_bytes(header[16:20], 'big')} / {int.from_bytes(header[20:24], 'big')}"
