"""Arguments that stand for arrays, such as lists or columns of tables, as NumPy arrays of real numbers."""

import sys
from collections.abc import Iterator
from numbers import Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect

T = TypeVar("T", bound=np.generic)

# Beyond it float64 skips whole numbers.
_LARGEST_WHOLE = 2**53


def real_array(values: Any) -> NDArray[Any]:
    """``values`` as an array of real numbers of any type that float64 holds.

    Columns of tables that may lack values come as Python objects: they are numbers if each one is. Raises
    ``ValueError`` that says what was expected and what was given.
    """
    array = plain_array(values)
    if array.dtype.kind == "O" and array.ndim and all(_is_number(x) for x in array.flat):
        array = array.astype(np.float64)
    if array.dtype.kind == "O" and any(isinstance(x, int) and abs(x) > _LARGEST_WHOLE for x in array.flat):
        raise ValueError("expected numbers that float64 holds, got an integer beyond 2^53")
    if array.dtype.kind not in "fiu":
        raise ValueError(f"expected real numbers, got dtype {array.dtype}")
    if array.dtype.kind in "iu" and array.dtype.itemsize == 8 and array.size:
        largest = max(int(array.max()), -int(array.min()))
        if largest > _LARGEST_WHOLE:
            raise ValueError(f"expected numbers that float64 holds, got the integer {largest}, beyond 2^53")
    return array


def real_argument(argument: str, values: Any) -> NDArray[Any]:
    """``real_array``, with the argument's name in its error."""
    try:
        return real_array(values)
    except ValueError as error:
        raise ValueError(f"{argument}: {error}") from None


def plain_argument(argument: str, values: Any) -> NDArray[Any]:
    """``plain_array``, with the argument's name in its error."""
    try:
        return plain_array(values)
    except ValueError as error:
        raise ValueError(f"{argument}: {error}") from None


def read_only(array: NDArray[T]) -> NDArray[T]:
    """The array itself, made read-only."""
    array.flags.writeable = False
    return array


def flag_argument(argument: str, value: object) -> bool:
    """A bool of Python or NumPy; anything else is an error that names the argument."""
    expect(isinstance(value, bool | np.bool_), argument, "True or False", repr(value))
    return bool(value)


def _is_number(value: object) -> bool:
    """Whether float64 holds an object of Python."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        return float(value) == value or value != value  # NaN, which is refused where its row is known
    except OverflowError:
        return False


def plain_array(values: Any) -> NDArray[Any]:
    """``values`` as an array of any dtype, without a copy where NumPy or DLPack can do without one.

    Raises ``ValueError`` for ragged lists, masked values and memory that NumPy cannot reach.
    """
    # Whoever has a masked array has imported its module, which takes a while.
    masked_array: Any = getattr(sys.modules.get("numpy.ma"), "MaskedArray", ())
    if isinstance(values, masked_array):
        masked = int(np.ma.getmaskarray(values).sum())
        if masked:
            raise ValueError(f"expected no masked values, got {masked}")
        return np.asarray(values.data)
    try:
        if hasattr(values, "__dlpack__") and not hasattr(values, "__array__"):
            return np.from_dlpack(values)
        array = np.asarray(values)
        if array.dtype.kind == "O" and array.ndim == 0 and isinstance(values, Iterator):
            raise ValueError(f"a {type(values).__name__}, which list() makes a list of")
        return array
    # A ragged list; memory of another device, or a tensor whose gradient is wanted.
    except (ValueError, TypeError, RuntimeError, BufferError) as error:
        got = "rows of different lengths" if "inhomogeneous" in str(error) else error
        raise ValueError(f"expected an array, got {got}") from None
