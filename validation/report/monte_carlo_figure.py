"""Plot of the error of random paths against their number, from the record of ``pictures.monte_carlo.run``."""

from collections.abc import Mapping
from typing import Any

from validation.report.plots import PLAIN, Series, loglog


def figure(record: Mapping[str, Any]) -> str:
    """An ``<svg>`` element: the measured error and, through its first point, the law 1 / sqrt(N)."""
    counts, errors = record["paths"], record["rmse"]
    law = [errors[0] * (counts[0] / count) ** 0.5 for count in counts]
    series = [Series("mean of N paths against ours", counts, errors), Series("1 / sqrt(N)", counts, law, PLAIN)]
    title = f"Error of random paths, {record['name']}"
    return loglog(series, x_label="paths a pixel, N", y_label="RMSE of radiance", title=title)
