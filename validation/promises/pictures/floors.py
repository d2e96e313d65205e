"""The checkered floor and the samples of a pixel: which square each position shows, by closed forms."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.fields import Color
from renderer.scene.scene import Floor, Scene
from validation.promises.pictures.glowing import equal, from_above, glowing, shown
from validation.promises.row import row

_COLORS: tuple[Color, Color] = ((1.0, 0.5, 0.25), (0.125, 0.75, 0.0))
_BEHIND: Color = (0.0, 0.25, 1.0)
_SIZE = (40, 30)
_FILM = 3.0


def check_floors() -> list[dict[str, Any]]:
    """Floors of one and two materials, seen from above with one sample a pixel and with more."""
    parity = [equal(shown(_scene(squares, names), _SIZE), _expected(squares, names, 1)) for squares, names in _FLOORS]
    samples = [
        equal(shown(_scene(squares, names), _SIZE, samples=k * k), _expected(squares, names, k))
        for squares, names in _FLOORS
        for k in (2, 3, 5)
    ]
    return [
        row("a floor's squares take its materials in turn, from min", "closed form", _joined(parity)),
        row("samples lie on a k x k grid in the pixel; its colour is their mean", "direct count", _joined(samples)),
    ]


# The numbers of squares, and the materials. No sample above lies on an edge between two.
_FLOORS = (((1, 1), ("a", "b")), ((3, 4), ("a", "b")), ((4, 7), ("b", "a")), ((5, 2), ("a",)))
_LOW, _HIGH = (-1.7, -1.1), (1.9, 0.8)


def _scene(squares: tuple[int, int], names: tuple[str, ...]) -> Scene:
    return Scene(
        camera=from_above((0.013, 5.0, 0.017), _FILM),
        materials={"a": glowing(_COLORS[0]), "b": glowing(_COLORS[1])},
        floor=Floor(min=_LOW, max=_HIGH, materials=names, squares=squares),
        ambient=(1.0, 1.0, 1.0),
        background=_BEHIND,
    )


def _expected(squares: tuple[int, int], names: tuple[str, ...], k: int) -> NDArray[np.float64]:
    """The mean over k x k places in each pixel of the colour that stands there."""
    width, height = _SIZE
    places = (np.arange(k) + 0.5) / k
    x = 0.013 + ((np.arange(width)[:, None] + places).ravel() - width / 2) * (_FILM / height)
    z = 0.017 + ((np.arange(height)[:, None] + places).ravel() - height / 2) * (_FILM / height)
    column, row_ = (
        (at - low) / (high - low) * n for at, low, high, n in zip((x, z), _LOW, _HIGH, squares, strict=True)
    )
    table = np.array([_COLORS["ab".index(name)] for name in names])
    turn = (np.floor(column)[None, :] + np.floor(row_)[:, None]).astype(int) % len(names)
    on = ((column >= 0) & (column < squares[0]))[None, :] & ((row_ >= 0) & (row_ < squares[1]))[:, None]
    colors = np.where(on[..., None], table[turn], _BEHIND)
    return colors.reshape(height, k, width, k, 3).mean(axis=(1, 3))


def _joined(kept: list[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    return np.concatenate([one.ravel() for one in kept])
