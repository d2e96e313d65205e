"""Figures of studies: errors against directions, from the record of ``validation.studies.section.run``."""

from collections.abc import Mapping
from typing import Any

from validation.report.plots import PLAIN, Panel, Series, draw


def figures(record: Mapping[str, Any]) -> list[dict[str, str]]:
    """A figure with a title (also its caption) and an ``<svg>`` element."""
    curves, patches = record["slopes"], record["patches"]
    series = [Series(f"{c['subject']}, lattice, N^{c['slope']:.2f}", c["counts"], c["rms"]) for c in curves]
    series += [Series(f"{c['subject']}, patches", patches, c["patches"]) for c in curves]
    first = curves[0]
    chance = [first["rms"][0] * (n / first["counts"][0]) ** -0.5 for n in first["counts"]]
    series.append(Series("as by chance, N^-0.50", first["counts"], chance, PLAIN))
    title = (
        "Root mean square error of the sky view factor over the floor of an endless street, against its closed form, "
        "by the number of directions: even lattices, the patches of Tregenza (145) and Reinhart (577), and the slope "
        "that random directions have."
    )
    shown = draw([Panel(series, "error of the share")], x_label="directions", title="Studies: error against directions")
    return [{"title": title, "svg": shown}]
