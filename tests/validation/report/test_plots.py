"""Plots are well-formed SVG that can stand beside each other in one page, and the same text every time."""

import re
from xml.etree import ElementTree

import pytest

from validation.report.plots import FLOOR, Panel, Series, draw, loglog

SERIES = [Series("ours & theirs", [1.0, 10.0, 100.0], [1e-16, 0.0, 1e-15]), Series("other", [1.0, 100.0], [None, 1e-3])]


def plot(title="Errors"):
    return loglog(SERIES, x_label="offset", y_label="error", title=title)


@pytest.fixture(scope="module")
def svg():
    """The plot of ``SERIES``, drawn once."""
    return plot()


def ids(svg):
    return [element.attrib["id"] for element in ElementTree.fromstring(svg).iter() if "id" in element.attrib]


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


def test_a_legend_takes_no_more_columns_than_fit():
    """Long names stood beyond both sides of the figure."""
    names = [f"{kind} of a street's floor, counted by {way}" for kind in ("share", "angle") for way in ("ones", "tens")]
    svg = draw([Panel([Series(name, [1.0, 10.0], [0.1, 0.2]) for name in names], "y")], x_label="x", title="Wide")
    shown = [element for element in ElementTree.fromstring(svg).iter() if element.text in names]
    places = [[float(n) for n in re.findall(r"-?[\d.]+", element.attrib["transform"])][-2:] for element in shown]
    width = float(ElementTree.fromstring(svg).attrib["viewBox"].split()[2])
    # A letter is at least 3 points wide.
    assert len(places) == 4 and all(0.0 < x < width - 3.0 * len(names[0]) for x, _ in places)
