"""Vectors as users give them."""

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.errors import expect


def unit(vector: ArrayLike) -> NDArray[np.float64]:
    """The vector at unit length, scaled first so that no square overflows or vanishes; zero gives nan."""
    scaled = np.asarray(vector, np.float64) / np.abs(vector).max()
    return scaled / np.linalg.norm(scaled)


def checked_vector(argument: str, value: ArrayLike) -> tuple[float, float, float]:
    """Three numbers (3,) as a tuple. Raises ``ValueError`` naming ``argument`` where they are not, or not finite."""
    array = np.asarray(value, np.float64)
    expect(array.shape == (3,) and bool(np.isfinite(array).all()), argument, "three finite numbers", repr(value))
    x, y, z = array.tolist()
    return x, y, z
