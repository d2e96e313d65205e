"""A picture of where hits differ: the mesh from +x, -y and +z, above as it was recorded and below as it is now.

Nearer is lighter and a miss is dark. Below, red is a hit that was lost, blue one that was gained, orange one that
moved. A small square is a ray in another direction than the pictures', at the place that it hit, or hits now.
"""

import numpy as np
from numpy.typing import NDArray

from validation.recorded.compare import Comparison
from validation.recorded.rays import VIEWS
from validation.recorded.record import Answers, Record

# Of the longest side of the mesh, and the least of any other; between pictures.
_PIXELS, _LEAST, _GAP = 400, 40, 8
_MISS, _PAPER = (28, 32, 38), (255, 255, 255)
_LOST, _GAINED, _MOVED = (230, 50, 40), (60, 120, 255), (255, 160, 20)
_DOT = 2

Pixels = NDArray[np.uint8]


def draw(record: Record, found: Comparison) -> Pixels:
    """The picture, (h, w, 3) uint8."""
    colours = _colours(found)
    columns = []
    for number, view in enumerate(VIEWS):
        rows = slice(number * record.side**2, (number + 1) * record.side**2)
        lower, upper = record.frame
        pixels = np.maximum(_LEAST, _PIXELS * (upper - lower) / (upper - lower).max()).astype(int)
        shape = (pixels[view.up], pixels[view.across])
        pictures = [_depths(answers, rows, (upper - lower)[view.axis]) for answers in (found.before, found.now)]
        pictures[1][found.differ[rows]] = colours[rows][found.differ[rows]]
        before, now = (_enlarged(picture.reshape(record.side, record.side, 3), shape) for picture in pictures)
        _dots(now, (_places(record, found) - lower) / (upper - lower), (view.up, view.across), colours[found.differ])
        columns.append(_stacked([before, now], axis=0))
    return _stacked(columns, axis=1)


def _colours(found: Comparison) -> Pixels:
    """The colour of each ray that differs."""
    colours = np.full((len(found.shift), 3), _MOVED, np.uint8)
    colours[found.lost], colours[found.gained] = _LOST, _GAINED
    return colours


def _depths(answers: Answers, rows: slice, depth: float) -> Pixels:
    """Grey by distance; every direction of a picture has length 1."""
    t, hit = answers.t[rows], answers.hit[rows]
    picture = np.full((len(t), 3), _MISS, np.uint8)
    picture[hit] = (235.0 - 150.0 * np.clip(t[hit] / depth, 0.0, 1.0))[:, None].astype(np.uint8)
    return picture


def _enlarged(picture: Pixels, shape: tuple[int, int]) -> Pixels:
    rows, columns = (np.arange(n) * side // n for n, side in zip(shape, picture.shape[:2], strict=True))
    return picture[rows][:, columns]


def _places(record: Record, found: Comparison) -> NDArray[np.float64]:
    """The hit of each ray that differs, as recorded or else as it is now; NaN for pixels, which show it themselves."""
    t = np.where(found.before.hit, found.before.t, found.now.t)
    t[: len(VIEWS) * record.side**2] = np.nan
    differ = found.differ
    return found.rays.origins[differ] + t[differ, None] * found.rays.directions[differ]


def _dots(picture: Pixels, places: NDArray[np.float64], axes: tuple[int, int], colours: Pixels) -> None:
    """Draw squares at ``places``, which are shares of the box, those outside at its border.

    ``axes`` are those up and across.
    """
    shown = np.isfinite(places).all(axis=1)
    up, across = np.clip(places[shown][:, axes], 0.0, 1.0).T
    rows, columns = (1.0 - up) * picture.shape[0], across * picture.shape[1]
    for row, column, colour in zip(rows.astype(int), columns.astype(int), colours[shown], strict=True):
        picture[max(row - _DOT, 0) : row + _DOT + 1, max(column - _DOT, 0) : column + _DOT + 1] = colour


def _stacked(pictures: list[Pixels], axis: int) -> Pixels:
    """Pictures beside (``axis`` 1) or below (0) each other, with gaps, on paper."""
    other = 1 - axis
    size = max(picture.shape[other] for picture in pictures)
    padded = []
    for picture in pictures:
        pad = [(0, 0), (0, 0), (0, 0)]
        pad[other], pad[axis] = (0, size - picture.shape[other]), (0, _GAP)
        padded.append(np.pad(picture, pad, constant_values=_PAPER[0]))
    return np.concatenate(padded, axis=axis)
