"""Media in media: rays through slabs that nest and overlap in every order, bent as Snell's law says, by hand."""

from itertools import pairwise, permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.fields import Color
from renderer.mesh.shapes import box
from renderer.picture.render import prepare
from renderer.scene.camera import OrthographicCamera
from renderer.scene.scene import Scene
from validation.promises.pictures.glowing import equal, glowing, shown, square, thing
from validation.promises.row import row

Floats = NDArray[np.float64]
# The index of each medium. The slabs of a pile are named by theirs, so two slabs may be of one medium.
_INDEX = {"a": 1.3, "b": 1.7, "c": 2.2}
_PILES = ("aba", "abc", "abab", "aab")
# Piles, each slab within the one before, around the eye; from the thinnest medium its rays get out of all.
_AROUND = ("a", "ba", "cba", "bca", "aca")
# Heights of the eye above the floor: above all slabs, and within them.
_ABOVE, _WITHIN = 20.0, 5.5
_STRIPES = 320
_WIDTH = 32.0
_SIZE = (96, 2)
_SLANT = 0.9


def check_nesting() -> list[dict[str, Any]]:
    """A striped floor seen aslant through piles of slabs; every stripe must be seen where Snell's law shows it."""
    kept = [_kept(pile, order) for pile in _PILES for order in _orders(len(pile))]
    promise = "leaving a medium takes out its innermost entry, in every order of nesting and overlap"
    within = [_kept(pile, tuple(range(len(pile)))[::-1], _WITHIN) for pile in _AROUND]
    turned = [_kept(pile, tuple(range(len(pile)))[::-1], _WITHIN, _ABOVE) for pile in _AROUND]
    return [
        row(promise, "Snell's law", np.concatenate(kept)),
        row("an eye within media is in the innermost of them", "Snell's law", np.concatenate(within)),
        row(
            "another camera starts in its own media, whatever the scene's camera is in",
            "Snell's law",
            np.concatenate(turned),
        ),
    ]


def _orders(count: int) -> list[tuple[int, ...]]:
    """The orders in which slabs that were entered one after another are left; for four of them, every fifth."""
    orders = list(permutations(range(count)))
    return orders if count < 4 else orders[::5]


def _kept(
    pile: str, order: tuple[int, ...], height: float = _ABOVE, prepared: float | None = None
) -> NDArray[np.bool_]:
    """The right pixels, seen from a height, of a scene prepared for a camera at another, if that is given."""
    slabs = [(name, 10.0 - i, 4.0 - order.index(i)) for i, name in enumerate(pile)]
    x = _film_x() + _shift(slabs, height)
    stripe = (x + _WIDTH / 2) / _WIDTH * _STRIPES
    expected = np.where((np.floor(stripe).astype(int) % 2)[:, None], _DARK, _BRIGHT)
    scene, depth = _scene(slabs, height), 2 * len(pile)
    if prepared is None:
        radiance = shown(scene, _SIZE, max_depth=depth)
    else:
        radiance = shown(prepare(_scene(slabs, prepared)), _SIZE, camera=scene.camera, max_depth=depth)
    clear = np.abs(stripe - np.rint(stripe)) > 1e-6
    kept: NDArray[np.bool_] = (equal(radiance, np.broadcast_to(expected, radiance.shape)) | ~clear).ravel()
    return kept


_BRIGHT: Color = (1.0, 0.5, 0.25)
_DARK: Color = (0.0, 0.25, 0.5)


def _film_x() -> Floats:
    """The x at which rays in a straight line would meet the floor."""
    width = _SIZE[0]
    across: Floats = (np.arange(width) + 0.5 - width / 2) / width * np.hypot(1.0, _SLANT)
    return across


def _shift(slabs: list[tuple[str, float, float]], height: float) -> float:
    """The way along x from where a straight ray of the slant would meet the floor to where this one does."""
    borders = sorted([(top, name, True) for name, top, _ in slabs] + [(low, name, False) for name, _, low in slabs])[
        ::-1
    ]
    within: list[str] = []
    sine, y, x = _SLANT / np.hypot(1.0, _SLANT), height, 0.0
    for at, name, enters in borders:
        if at > height:
            within.append(name)
            continue
        x += (y - at) * sine / np.sqrt(1.0 - sine * sine)
        y = at
        before = _INDEX[within[-1]] if within else 1.0
        if enters:
            within.append(name)
        else:
            del within[len(within) - 1 - within[::-1].index(name)]
        sine *= before / (_INDEX[within[-1]] if within else 1.0)
    return float(x + y * sine / np.sqrt(1.0 - sine * sine) - height * _SLANT)


def _scene(slabs: list[tuple[str, float, float]], height: float) -> Scene:
    """The slabs above the floor y = 0, seen from above it; the ray in the film's middle aims at x = z = 0."""
    far = 200.0
    objects = [
        thing(box((-far - i, low, -far - i), (far + i, top, far + i)), name) for i, (name, top, low) in enumerate(slabs)
    ]
    edges = np.linspace(-_WIDTH / 2, _WIDTH / 2, _STRIPES + 1)
    for k, (left, right) in enumerate(pairwise(edges)):
        stripe = square(np.array([left, 0.0, -50.0]), np.array([0.0, 0.0, 100.0]), np.array([right - left, 0.0, 0.0]))
        objects.append(thing(stripe, ("bright", "dark")[k % 2]))
    clear = {name: glowing((0.0, 0.0, 0.0), transmittance=(1.0, 1.0, 1.0), ior=ior) for name, ior in _INDEX.items()}
    eye = (-height * _SLANT, height, 0.0)
    camera = OrthographicCamera(eye=eye, target=(0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), height=_SIZE[1] / _SIZE[0])
    materials = {**clear, "bright": glowing(_BRIGHT), "dark": glowing(_DARK)}
    return Scene(camera=camera, materials=materials, objects=tuple(objects), ambient=(1.0, 1.0, 1.0))
