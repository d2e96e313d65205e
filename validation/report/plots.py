"""Curves as inline SVG for light and dark pages, drawn from stored records, without embedded fonts, links or dates."""

import hashlib
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple
from xml.etree import ElementTree

import matplotlib
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

# Errors of 0 cannot be drawn on a logarithmic axis; this is below the roundoff of float64, 1.1e-16.
FLOOR = 1e-17
# Okabe and Ito's blue, vermilion and green, which colour-blind readers distinguish, at a lightness between a white and
# a dark page; markers and strokes differ as well.
_LOOKS = (
    ("#2f86c9", "o", "-"), ("#dd6b20", "s", "-"), ("#169b74", "^", "--"), ("#b86fa0", "D", "-."),
    ("#3fa7b5", "v", ":"), ("#b59a1b", "P", "--"), ("#8c6bd1", "X", "-."), ("#c2554d", "h", "--"),
    ("#5f9a3c", "<", ":"), ("#808790", "", ":"),
)  # fmt: skip
# The last of them, grey, dotted and without markers, for what is no measurement.
PLAIN = -1
_GREY = "#808790"
# Text takes the page's own colour: it is drawn in this unique one, which is then replaced.
_INK = "#010203"
_SVG = "http://www.w3.org/2000/svg"
_HREF = "{http://www.w3.org/1999/xlink}href"
_FONT = "DejaVu Sans"  # comes with matplotlib; text is laid out with it and shown in the page's own sans-serif
_PIXELS = 100.0  # an inch


class Series(NamedTuple):
    """One curve; a y of None, as where nothing was hit, is left out.

    ``look`` is a row of the colours and strokes, for a curve with the same look in all panels; None: by position.
    """

    name: str
    x: Sequence[float]
    y: Sequence[float | None]
    look: int | None = None


@dataclass(frozen=True)
class Panel:
    """Curves over one pair of axes; x is logarithmic, y too unless it is a share from 0 to 1 or ``linear`` from 0 up.

    With ``roundoffs`` y is a relative error, and an axis on the right counts it in ulp of float64 at 1.
    """

    series: Sequence[Series]
    y_label: str
    share: bool = False
    roundoffs: bool = False
    linear: bool = False


def loglog(series: Sequence[Series], *, x_label: str, y_label: str, title: str) -> str:
    """One panel of 600 x 360 pixels, both axes logarithmic; a y of 0 is drawn at ``FLOOR``.

    Returns an ``<svg>`` element for a page. Equal arguments give equal text, and its ids are unique as long as no other
    plot of the page has the same arguments. Raises ``ValueError`` for an x that is not positive.
    """
    return draw([Panel(series, y_label)], x_label=x_label, title=title)


def draw(panels: Sequence[Panel], *, x_label: str, title: str, size: tuple[int, int] = (600, 360)) -> str:
    """Panels below each other, with one x axis and one legend; the first one is the largest, of ``size`` pixels.

    See ``loglog``.
    """
    bad = [x for panel in panels for s in panel.series for x in s.x if not 0.0 < x < math.inf]
    if bad:
        raise ValueError(f"series: expected positive, finite x for {title!r}, got {bad[0]}")
    identity = hashlib.sha256(repr((panels, x_label, title, size)).encode()).hexdigest()[:10]
    settings: dict[Any, Any] = {
        "svg.hashsalt": identity, "svg.fonttype": "none", "font.family": _FONT, "font.size": 9.0,
        "axes.edgecolor": _GREY, "xtick.color": _GREY, "ytick.color": _GREY, "xtick.labelcolor": _INK,
        "ytick.labelcolor": _INK, "axes.labelcolor": _INK, "text.color": _INK,
        "axes.spines.top": False, "axes.spines.right": False,
    }  # fmt: skip
    with matplotlib.rc_context(settings):
        width, height = size[0], size[1] + 150 * (len(panels) - 1)
        figure = Figure(figsize=(width / _PIXELS, height / _PIXELS), dpi=_PIXELS, layout="constrained")
        figure.patch.set_visible(False)
        ratios = [2.4] + [1.0] * (len(panels) - 1)
        rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
        for panel, axes in zip(panels, rows, strict=True):
            _plot(panel, axes)
            _label_plainly(axes.xaxis)
        rows[-1].set_xlabel(x_label)
        named = {name: h for axes in rows[::-1] for h, name in zip(*axes.get_legend_handles_labels(), strict=True)}
        names = dict.fromkeys(name for axes in rows for name in axes.get_legend_handles_labels()[1])
        _add_legend(figure, {name: named[name] for name in names})
        text = io.StringIO()
        metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(text, format="svg", metadata=metadata)
    return _inline(text.getvalue(), title, f"plot-{identity}")


def _add_legend(figure: Figure, handles: Mapping[str, Any]) -> None:
    """A legend above the axes, in as many columns as the figure is wide enough for."""
    renderer = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
    for columns in range(len(handles) if len(handles) <= 4 else 3, 0, -1):
        legend = figure.legend(
            handles.values(), handles.keys(), loc="outside upper center", ncols=columns, frameon=False
        )
        if columns == 1 or legend.get_window_extent(renderer).width <= figure.bbox.width:
            return
        legend.remove()


def _plot(panel: Panel, axes: Axes) -> None:
    axes.patch.set_visible(False)
    axes.set_xscale("log")
    axes.set_ylabel(panel.y_label)
    if panel.share:
        axes.set_ylim(-0.05, 1.05)
        axes.set_yticks([0.0, 0.5, 1.0], ["0 %", "50 %", "100 %"])
    elif not panel.linear:
        axes.set_yscale("log")
        _label_plainly(axes.yaxis)
    if panel.roundoffs:
        right = axes.secondary_yaxis("right", functions=(_in_ulp, _relative))
        right.set_ylabel("in ulp of float64")
        _label_plainly(right.yaxis)
    for index, series in enumerate(panel.series):
        colour, marker, stroke = _LOOKS[(index if series.look is None else series.look) % len(_LOOKS)]
        y = [math.nan if value is None else value if panel.share else max(value, FLOOR) for value in series.y]
        axes.plot(series.x, y, color=colour, marker=marker, ls=stroke, markersize=4.5, linewidth=1.4, label=series.name)
    if panel.linear:
        axes.set_ylim(bottom=0.0)
    axes.grid(color=_GREY, alpha=0.25, linewidth=0.6)


class _PlainLabels(LogFormatter):
    """Numbers as Python writes them, and no formulas, whose parsing takes most of a figure's time."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if super().__call__(x, pos) else ""


def _label_plainly(axis: Axis) -> None:
    axis.set_major_formatter(_PlainLabels())
    axis.set_minor_formatter(_PlainLabels())


def _in_ulp(relative: Any) -> Any:
    return relative * 2.0**52


def _relative(ulp: Any) -> Any:
    return ulp * 2.0**-52


def _inline(svg: str, title: str, prefix: str) -> str:
    """The bare element with its ids under ``prefix`` and a title for screen readers."""
    ElementTree.register_namespace("", _SVG)
    root = ElementTree.fromstring(svg)
    # Within a page a <style> would apply to all of it; these two properties are inherited as well.
    for parent in list(root.iter()):
        for child in [c for c in parent if c.tag in (f"{{{_SVG}}}metadata", f"{{{_SVG}}}style")]:
            parent.remove(child)
    root.set("style", "stroke-linejoin: round; stroke-linecap: butt")
    for element in root.iter():
        element.attrib = {_local(name): _own(name, value, prefix) for name, value in element.attrib.items()}
    for name in ("width", "height", "version"):
        root.attrib.pop(name, None)
    root.attrib |= {"role": "img", "aria-labelledby": f"{prefix}-title"}
    named = ElementTree.Element(f"{{{_SVG}}}title", {"id": f"{prefix}-title"})
    named.text = title
    root.insert(0, named)
    return ElementTree.tostring(root, encoding="unicode")


def _local(name: str) -> str:
    """An attribute's name; ``href`` needs no namespace in SVG 2."""
    return "href" if name == _HREF else name


def _own(name: str, value: str, prefix: str) -> str:
    """An attribute's value, with this plot's prefix on ids and the page's colour for the ink."""
    if name == "id":
        return f"{prefix}-{value}"
    if name in ("href", _HREF) and value.startswith("#"):
        return f"#{prefix}-{value[1:]}"
    own = value.replace("url(#", f"url(#{prefix}-").replace(_INK, "currentColor")
    return re.sub(rf"'?{_FONT}'?(, sans-serif)?", "sans-serif", own)
