"""A kernel's dispatcher for Python, which loads machine code without what only compiling needs."""

from types import NoneType
from typing import Any

import numpy as np
from numba.core import types
from numba.core.errors import NumbaNotImplementedError
from numba.core.registry import CPUDispatcher
from numba.core.typing.typeof import typeof
from numba.np.numpy_support import from_dtype, map_layout


class Entry(CPUDispatcher):  # type: ignore[misc]
    """A function as Python calls it."""

    def _compilation_chain_init_hook(self) -> None:
        """Nothing: Numba would look for its extensions in all installed packages, which takes longer than to load a
        kernel.
        """

    def typeof_pyval(self, value: Any) -> Any:
        """The type of an argument."""
        kind = _type_of(value)
        if kind is None:
            super()._compilation_chain_init_hook()
            return super().typeof_pyval(value)
        self._types_active_call.add(kind)
        return kind


def _type_of(value: Any) -> Any:
    """Numba's type of a number, an array, or a tuple or record of these; None for another value."""
    if type(value) is np.ndarray:
        return _type_of_array(value)
    if isinstance(value, tuple):
        kinds = [_type_of(one) for one in value]
        return None if None in kinds else types.BaseTuple.from_types(kinds, type(value))
    if type(value) in (bool, float, NoneType) or (type(value) is int and value.bit_length() < 64):
        return typeof(value)
    return None


def _type_of_array(array: Any) -> Any:
    """As Numba's ``typeof``, which would import ``numpy.ma``."""
    try:
        dtype = from_dtype(array.dtype)
    except NumbaNotImplementedError:
        return None
    return types.Array(dtype, array.ndim, map_layout(array), readonly=not array.flags.writeable)
