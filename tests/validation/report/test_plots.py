"""Plots are well-formed SVG that can stand beside each other in one page, and the same text every time."""

import re
from xml.etree import ElementTree

import pytest

from validation.report.figures import stability_figures
from validation.report.plots import FLOOR, Panel, Series, draw, loglog

SERIES = [Series("ours & theirs", [1.0, 10.0, 100.0], [1e-16, 0.0, 1e-15]), Series("other", [1.0, 100.0], [None, 1e-3])]
ERRORS = {"relative_max": 1e-7, "wrong_share": 0.25}
KERNELS = {"ours": {"relative_max": 0.0, "wrong_share": 0.0}, "embree_default": ERRORS, "embree_robust": ERRORS}
POINTS = [{"x": 10.0**k, "rays": 60} | KERNELS for k in range(3)]
LEAKS = [
    {"mesh": "a", "faces": 100, "rays": 1000, "ours": 0, "embree_default": 30, "embree_robust": 1},
    {"mesh": "b", "faces": 400, "rays": 1000, "ours": 0, "embree_default": 40, "embree_robust": 2},
]
RECORD = {
    "rays": 60,
    "seed": 1,
    "offset": {"label": "offset of the mesh", "points": POINTS},
    "scale": {"label": "scale of the mesh", "points": POINTS},
    "leaks": LEAKS,
}


def plot(title="Errors"):
    return loglog(SERIES, x_label="offset", y_label="error", title=title)


@pytest.fixture(scope="module")
def svg():
    """The plot of ``SERIES``, drawn once."""
    return plot()


def texts(svg):
    return [text for element in ElementTree.fromstring(svg).iter() for text in element.itertext()]


def ids(svg):
    return [element.attrib["id"] for element in ElementTree.fromstring(svg).iter() if "id" in element.attrib]


def test_a_plot_names_its_series_axes_and_title(svg):
    shown = texts(svg)
    for name in ("ours & theirs", "other", "offset", "error", "Errors"):
        assert name in shown
    assert ElementTree.fromstring(svg)[0].tag == "{http://www.w3.org/2000/svg}title"


def test_a_plot_has_no_link_no_date_and_no_header(svg):
    assert svg.startswith('<svg xmlns="http://www.w3.org/2000/svg"')
    assert svg.replace('xmlns="http://www.w3.org/2000/svg"', "").count("http") == 0
    for absent in ("<?xml", "<!DOCTYPE", "<metadata", "<style", "xlink", "DejaVu", "#ffffff", "#010203"):
        assert absent not in svg


def test_every_reference_within_a_plot_leads_to_one_id(svg):
    known = ids(svg)
    assert len(known) == len(set(known))
    used = [e.attrib["href"] for e in ElementTree.fromstring(svg).iter() if "href" in e.attrib]
    clips = [e.attrib["clip-path"][4:-1] for e in ElementTree.fromstring(svg).iter() if "clip-path" in e.attrib]
    assert used and clips
    assert {reference[1:] for reference in used + clips} <= set(known)


def test_equal_arguments_give_equal_text_and_others_other_ids(svg):
    assert svg == plot()
    assert not set(ids(svg)) & set(ids(plot("Leaks")))


def test_an_x_that_has_no_logarithm_is_refused():
    with pytest.raises(ValueError, match="positive, finite x for 'Errors', got 0"):
        loglog([Series("ours", [0.0, 1.0], [1.0, 1.0])], x_label="", y_label="", title="Errors")


def markers(svg):
    """How many markers the first curve has, that of the legend too."""
    return sum(e.tag.endswith("use") and "#2f86c9" in e.attrib["style"] for e in ElementTree.fromstring(svg).iter())


def test_zero_is_drawn_at_the_floor_and_none_left_out():
    def one(y):
        return draw([Panel([Series("ours", [1.0, 2.0, 3.0], y)], "error")], x_label="", title="")

    def paths(svg):
        return [e.attrib["d"] for e in ElementTree.fromstring(svg).iter() if "d" in e.attrib]

    assert paths(one([0.0, 1.0, 1.0])) == paths(one([FLOOR, 1.0, 1.0]))
    assert paths(one([0.0, 1.0, 1.0])) != paths(one([1e-3, 1.0, 1.0]))
    assert markers(one([0.5, 1.0, 1.0])) - markers(one([None, 1.0, 1.0])) == 1


def test_the_stability_record_gives_a_figure_a_sweep_and_one_of_leaks():
    figures = stability_figures(RECORD)
    assert len(figures) == 3
    assert "offset" in figures[0]["title"] and "1e-17" in figures[0]["title"]
    assert "half a ray" in figures[2]["title"]
    for figure in figures:
        shown = texts(figure["svg"])
        assert {"ours (float64)", "Embree default", "Embree robust"} <= set(shown)
    assert "offset of the mesh" in texts(figures[0]["svg"])
    everything = [name for figure in figures for name in ids(figure["svg"])]
    assert len(everything) == len(set(everything))


def test_a_legend_takes_no_more_columns_than_fit():
    """Long names stood beyond both sides of the figure."""
    names = [f"{kind} of a street's floor, counted by {way}" for kind in ("share", "angle") for way in ("ones", "tens")]
    svg = draw([Panel([Series(name, [1.0, 10.0], [0.1, 0.2]) for name in names], "y")], x_label="x", title="Wide")
    shown = [element for element in ElementTree.fromstring(svg).iter() if element.text in names]
    places = [[float(n) for n in re.findall(r"-?[\d.]+", element.attrib["transform"])][-2:] for element in shown]
    width = float(ElementTree.fromstring(svg).attrib["viewBox"].split()[2])
    # A letter is at least 3 points wide.
    assert len(places) == 4 and all(0.0 < x < width - 3.0 * len(names[0]) for x, _ in places)
