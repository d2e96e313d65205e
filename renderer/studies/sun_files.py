"""Files of suns: rows of directions, or tables of azimuth and elevation."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.studies.points import unreadable
from renderer.studies.suns import sun_directions

Floats = NDArray[np.float64]

# The columns of a table by their names: of several elevations the one that pvlib corrects for refraction comes first,
# as the sun is seen there.
_ELEVATIONS = ("apparent_elevation", "elevation", "altitude")
_AZIMUTH, _HOURS = "azimuth", "hours"
# Words that are numbers.
_NUMBERS = ("nan", "inf", "infinity")


class Suns(NamedTuple):
    """Directions to the sun (k, 3), the hours (k,) of each, and whether they came as angles above the level horizon."""

    directions: Floats
    hours: Floats
    have_horizon: bool


def suns_of(path: Path, up: Literal["x", "y", "z"] = "z") -> Suns:
    """The suns of a text file with rows x y z hours, or x y z for one hour; or of a table with a line of names first.

    A table has a column ``azimuth`` and one of ``apparent_elevation``, ``elevation`` and ``altitude``, in degrees as
    ``sun_directions`` takes them, and may have ``hours``. Other columns are passed over. Numbers are separated by
    spaces or commas, columns of a table also by semicolons or tabs. Lines that begin with # are comments.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise unreadable("--suns", path, error) from None
    except ValueError as error:
        raise ValueError(f"--suns: expected a text, got {path}: {error}") from None
    lines = [line for line in text.splitlines() if line.split("#")[0].strip()]
    table = _cells(lines)
    if any(name[:1].isalpha() and name not in _NUMBERS for name in table[0]):
        return _of_table(table, path, up)
    return _of_rows(lines, path)


def _of_rows(lines: list[str], path: Path) -> Suns:
    try:
        rows = np.array([line.replace(",", " ").split() for line in lines], np.float64)
    except ValueError as error:
        raise ValueError(f"--suns: expected rows of 3 or 4 numbers, got {path}: {error}") from None
    good = rows.ndim == 2 and rows.shape[1] in (3, 4)
    expect(good, "--suns", "rows x y z, or x y z hours", f"an array of shape {rows.shape} in {path}")
    hours = rows[:, 3].copy() if rows.shape[1] == 4 else np.ones(len(rows))
    return Suns(rows[:, :3].copy(), hours, False)


def _cells(lines: list[str]) -> list[list[str]]:
    """The cells of a table, by the separator in its first line; the names of the first line in small letters."""
    if not lines:
        return [[]]
    separator = next((mark for mark in ",;\t" if mark in lines[0]), None)
    rows = [line.split() for line in lines] if separator is None else list(csv.reader(lines, delimiter=separator))
    return [[name.strip().lower() for name in rows[0]], *rows[1:]]


def _of_table(table: list[list[str]], path: Path, up: Literal["x", "y", "z"]) -> Suns:
    names, rows = table[0], table[1:]
    expect(_AZIMUTH in names, "--suns", f"a column {_AZIMUTH}", f"{', '.join(names)} in {path}")
    elevation = next((name for name in _ELEVATIONS if name in names), None)
    expect(elevation is not None, "--suns", f"a column {' or '.join(_ELEVATIONS)}", f"{', '.join(names)} in {path}")
    expect(bool(rows), "--suns", "a row for each sun below the names", f"none in {path}")
    azimuths, heights = _column(table, _AZIMUTH, path), _column(table, str(elevation), path)
    hours = _column(table, _HOURS, path) if _HOURS in names else np.ones(len(rows))
    try:
        return Suns(sun_directions(azimuths, heights, up=up), hours, True)
    except ValueError as error:
        raise ValueError(f"--suns: {error} of {path}") from None


def _column(table: list[list[str]], name: str, path: Path) -> Floats:
    """The numbers of a column."""
    place = table[0].index(name)
    try:
        return np.array([row[place] for row in table[1:]], np.float64)
    except IndexError:
        row = next(i for i, cells in enumerate(table[1:]) if len(cells) <= place)
        expect(False, "--suns", f"{name} in each row", f"none in row {row} of {path}")
        raise
    except ValueError as error:
        raise ValueError(f"--suns: expected numbers in the column {name}, got {path}: {error}") from None
