"""Reconstruction filters: edges of light between pixels, by the formulas of the literature."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.scene.filters import FilterName
from renderer.scene.scene import Scene
from validation.promises.pictures.glowing import Floats, from_above, glowing, shown, square, thing
from validation.promises.row import row

FILTERS: tuple[FilterName, ...] = ("box", "tent", "gaussian", "mitchell")
# Pixels of a row, and samples along an axis of each.
_PIXELS, _ACROSS = 8, 32
_EDGES = (4.0, 4.3, 4.5, 4.85)
_GRID = np.linspace(-2.5, 2.5, 50001)


def check_filters() -> list[dict[str, Any]]:
    """The left of a row glows: each pixel has the filter's integral up to the edge, within a part of a sample."""
    kept = [_near(name, edge) for name in FILTERS for edge in _EDGES]
    return [row("a pixel beside an edge has the integral of its filter", "published formulas", np.concatenate(kept))]


def _near(name: FilterName, edge: float) -> NDArray[np.bool_]:
    camera = from_above((0.5 * _PIXELS, 1.0, 0.5), 1.0)
    wall = square(np.array([-9.0, 0.0, -9.0]), np.array([0.0, 0.0, 18.0]), np.array([9.0 + edge, 0.0, 0.0]))
    scene = Scene(
        camera=camera, materials={"lit": glowing((1.0, 1.0, 1.0))}, objects=(thing(wall, "lit"),), ambient=1.0
    )
    found = shown(scene, (_PIXELS, 1), samples=_ACROSS**2, filter=name)[0, :, 0]
    return np.abs(found - _up_to(name, edge - np.arange(0.5, _PIXELS))) < 0.7 / _ACROSS


def _up_to(name: str, x: Floats) -> Floats:
    """The share of a filter to the left of ``x``."""
    sums = np.cumsum(published(name, 0.5 * (_GRID[1:] + _GRID[:-1])))
    return np.interp(x, _GRID, np.append(0.0, sums / sums[-1]))


def published(name: str, x: Floats) -> Floats:
    """The filters as published, with Mitsuba's radii and widths."""
    x = np.abs(x)
    if name == "box":
        return np.where(x <= 0.5, 1.0, 0.0)
    if name == "tent":
        return np.maximum(1.0 - x, 0.0)
    if name == "gaussian":
        deviation, radius = 0.5, 2.0
        return np.maximum(np.exp(-(x**2) / (2.0 * deviation**2)) - math.exp(-(radius**2) / (2.0 * deviation**2)), 0.0)
    b = c = 1.0 / 3.0
    near = (12.0 - 9.0 * b - 6.0 * c) * x**3 + (-18.0 + 12.0 * b + 6.0 * c) * x**2 + 6.0 - 2.0 * b
    far = (-b - 6.0 * c) * x**3 + (6.0 * b + 30.0 * c) * x**2 + (-12.0 * b - 48.0 * c) * x + 8.0 * b + 24.0 * c
    return np.where(x < 1.0, near, np.where(x < 2.0, far, 0.0)) / 6.0
