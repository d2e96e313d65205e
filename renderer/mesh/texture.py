"""How a material uses an image: which part of it, what is beyond its edges, and between its pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from renderer.arguments.arrays import real_argument
from renderer.errors import MeshError, expect
from renderer.mesh.texture_image import TextureImage

Wrap = Literal["repeat", "mirror", "clamp"]
Filter = Literal["linear", "nearest"]
Row = tuple[float, float, float]


@dataclass(frozen=True)
class MeshTexture:
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
    filter : {"linear", "nearest"}, default "linear"
        What is between the pixels.
    strength : float, default 1
        How much a map of normals, heights or occlusion counts: the ``scale`` or ``strength`` of glTF, ``-bm`` of MTL.

    Raises
    ------
    MeshError
        For a bad value, which it names.

    Examples
    --------
    >>> from renderer import MeshTexture
    >>> brick = MeshTexture("brick.png", transform=[[4, 0, 0], [0, 2, 0]], wrap=("repeat", "clamp"))
    >>> brick.image, brick.transform
    (TextureImage('brick.png'), ((4.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
    """

    image: TextureImage
    transform: tuple[Row, Row] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    filter: Filter = "linear"
    strength: float = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.image, TextureImage):
            object.__setattr__(self, "image", TextureImage(self.image))
        try:
            object.__setattr__(self, "transform", numbers("transform", self.transform, (2, 3)))
            object.__setattr__(self, "strength", numbers("strength", self.strength, ()))
            wraps = isinstance(self.wrap, tuple | list) and len(self.wrap) == 2
            expect(
                wraps and all(each in get_args(Wrap) for each in self.wrap),
                "wrap", f"two of {', '.join(get_args(Wrap))}", repr(self.wrap),
            )  # fmt: skip
            expect(self.filter in get_args(Filter), "filter", "'linear' or 'nearest'", repr(self.filter))
        except ValueError as error:
            raise MeshError(str(error)) from None
        object.__setattr__(self, "wrap", tuple(self.wrap))


def numbers(argument: str, value: Any, shape: tuple[int, ...], least: float = -np.inf, most: float = np.inf) -> Any:
    """Finite numbers of a shape, from ``least`` to ``most``, as floats in tuples. ``ValueError`` names the argument."""
    given = real_argument(argument, value)
    of = f"{'x'.join(map(str, shape))} finite numbers" if shape else "a finite number"
    within = "" if least == -np.inf else f" of at least {least:g}" if most == np.inf else f" from {least:g} to {most:g}"
    good = given.shape == shape and bool(np.isfinite(given).all() and (given >= least).all() and (given <= most).all())
    expect(good, argument, of + within, repr(value))
    listed = given.astype(np.float64).tolist()
    return tuple(tuple(row) if isinstance(row, list) else row for row in listed) if shape else listed
