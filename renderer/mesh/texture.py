"""The use of an image by a material: its part, wrapping beyond its edges, filtering between its pixels."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import MeshError, expect
from renderer.mesh.texture_image import TextureImage

Wrap = Literal["repeat", "mirror", "clamp"]
Filter = Literal["mipmap", "linear", "nearest"]
Row = tuple[float, float, float]


@dataclass(frozen=True, init=False)
class Texture:
    """An image at the texture coordinates of a mesh.

    Parameters
    ----------
    image : TextureImage, path, bytes or array_like
        What ``TextureImage`` takes becomes one.
    transform : array_like, shape (2, 3), default identity
        Rows (a, b, c): the image is read at ``a * u + b * v + c`` for each of u and v. (0, 0) is its lower left corner,
        (1, 1) the upper right one.
    wrap : ({"repeat", "mirror", "clamp"}, {"repeat", "mirror", "clamp"}), default ("repeat", "repeat")
        What is beyond the edges, along u and along v.
    filter : {"mipmap", "linear", "nearest"}, default "mipmap"
        What is between the pixels: a linear mean of four, or the nearest. "mipmap" also takes the mean over about what
        a ray sees of the image, so that distant textures do not shimmer.
    strength : float, default 1
        How much a map of normals, heights or occlusion counts: the ``scale`` or ``strength`` of glTF, ``-bm`` of MTL.

    Raises
    ------
    MeshError
        For a bad value, which it names.

    Examples
    --------
    >>> from renderer import Texture
    >>> brick = Texture("brick.png", transform=[[4, 0, 0], [0, 2, 0]], wrap=("repeat", "clamp"))
    >>> brick.image, brick.transform
    (TextureImage('brick.png'), ((4.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
    """

    image: TextureImage
    transform: tuple[Row, Row] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    filter: Filter = "mipmap"
    strength: float = 1.0

    def __init__(
        self,
        image: TextureImage | str | os.PathLike[str] | bytes | ArrayLike,
        transform: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        wrap: tuple[Wrap, Wrap] = ("repeat", "repeat"),
        filter: Filter = "mipmap",
        strength: float = 1.0,
    ) -> None:
        try:
            rows, factor = numbers("transform", transform, (2, 3)), numbers("strength", strength, ())
            wraps = isinstance(wrap, tuple | list) and len(wrap) == 2 and all(each in get_args(Wrap) for each in wrap)
            expect(wraps, "wrap", f"two of {', '.join(get_args(Wrap))}", repr(wrap))
            expect(filter in get_args(Filter), "filter", "'mipmap', 'linear' or 'nearest'", repr(filter))
        except ValueError as error:
            raise MeshError(str(error)) from None
        kept = image if isinstance(image, TextureImage) else TextureImage(image)
        for name, value in zip(_FIELDS, (kept, rows, tuple(wrap), filter, factor), strict=True):
            object.__setattr__(self, name, value)

    @classmethod
    def checker(cls, first: ArrayLike = 0.8, second: ArrayLike = 0.2, squares: ArrayLike = (8.0, 8.0)) -> Texture:
        """Squares of two colours.

        Parameters
        ----------
        first, second : float or array_like, shape (3,), default 0.8 and 0.2
            Linear colours; the first is that of the lower left square.
        squares : (float, float), default (8, 8)
            How many squares there are between texture coordinates 0 and 1.

        Returns
        -------
        Texture

        Raises
        ------
        MeshError
            For what is no colour, and for squares that are not two finite numbers.

        Examples
        --------
        >>> from renderer import Texture
        >>> Texture.checker(0.9, (0.5, 0, 0), squares=(4, 2)).transform
        ((2.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        """
        try:
            across, down = numbers("squares", squares, (2,))
            colors = [
                numbers(name, np.broadcast_to(color, 3), (3,)) for name, color in (("first", first), ("second", second))
            ]
        except ValueError as error:
            raise MeshError(str(error)) from None
        a, b = (np.array(color, np.float32) for color in colors)
        # The first row of an image is the upper one.
        # rule: checker
        return cls(np.array([[b, a], [a, b]]), ((across / 2, 0, 0), (0, down / 2, 0)), filter="nearest")


_FIELDS = ("image", "transform", "wrap", "filter", "strength")


def numbers(argument: str, value: Any, shape: tuple[int, ...], least: float = -np.inf, most: float = np.inf) -> Any:
    """Finite numbers of a shape, from ``least`` to ``most``, as floats in tuples. ``ValueError`` names the argument."""
    given = real_argument(argument, value)
    of = f"{'x'.join(map(str, shape))} finite numbers" if shape else "a finite number"
    within = "" if least == -np.inf else f" of at least {least:g}" if most == np.inf else f" from {least:g} to {most:g}"
    good = given.shape == shape and bool(np.isfinite(given).all() and (given >= least).all() and (given <= most).all())
    expect(good, argument, of + within, repr(value))
    listed = given.astype(np.float64).tolist()
    return tuple(tuple(row) if isinstance(row, list) else row for row in listed) if shape else listed
