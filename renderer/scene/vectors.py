"""Vectors as users give them."""

import math

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.errors import expect


def unit(vector: ArrayLike) -> NDArray[np.float64]:
    """The vector at unit length, scaled first so that no square overflows or vanishes; zero gives nan."""
    scaled = np.asarray(vector, np.float64) / np.abs(vector).max()
    return scaled / np.linalg.norm(scaled)


def rotated(vectors: NDArray[np.float64], axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Vectors (n, 3) turned by ``angle`` (radians) about the unit vector ``axis``, anticlockwise as seen against it.

    By Rodrigues' formula.
    """
    along = (vectors @ axis)[:, None] * axis
    return along + (vectors - along) * math.cos(angle) + np.cross(axis, vectors) * math.sin(angle)


def checked_vector(argument: str, value: ArrayLike) -> tuple[float, float, float]:
    """Three numbers (3,) as a tuple. Raises ``ValueError`` naming ``argument`` where they are not, or not finite."""
    array = np.asarray(value, np.float64)
    expect(array.shape == (3,) and bool(np.isfinite(array).all()), argument, "three finite numbers", repr(value))
    x, y, z = array.tolist()
    return x, y, z
