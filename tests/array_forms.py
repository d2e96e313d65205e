"""The kinds of arrays that queries take in place of NumPy's own, and the shapes that they may have."""

from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray


def _small(array: NDArray[Any]) -> NDArray[Any]:
    return array.astype(np.float32 if array.dtype.kind == "f" else np.int16)


def _objects(array: NDArray[Any]) -> NDArray[Any]:
    """As a column of a table has them; of numbers of faces and sides no query takes such."""
    return array.astype(object) if array.ndim and array.dtype.kind == "f" else array


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    array = array.copy()
    array.flags.writeable = False
    return array


def _backwards(array: NDArray[Any]) -> NDArray[Any]:
    """Of negative strides."""
    return np.flip(array).copy()[(slice(None, None, -1),) * array.ndim]


FORMS: dict[str, Callable[[NDArray[Any]], Any]] = {
    "plain": lambda array: array,
    "list": lambda array: array.tolist(),
    "small": _small,
    "every second": lambda array: np.repeat(array, 2, axis=-1)[..., ::2],
    "backwards": _backwards,
    "Fortran": np.asfortranarray,
    "big-endian": lambda array: array.astype(array.dtype.newbyteorder(">")),
    "objects": _objects,
    "masked": np.ma.masked_array,
    "read-only": _read_only,
}
forms = st.sampled_from(sorted(FORMS))


def shaped(shape: tuple[int, ...], array: NDArray[Any]) -> NDArray[Any]:
    """An array (n, ...) with other leading dimensions."""
    return array.reshape((*shape, *array.shape[1:]))


def shapes_of(count: int) -> st.SearchStrategy[tuple[int, ...]]:
    """Leading dimensions of so many rows."""
    single, halves = [()] * (count == 1), [(2, count // 2)] * (count % 2 == 0)
    return st.sampled_from([(count,), (1, count, 1), *single, *halves])
