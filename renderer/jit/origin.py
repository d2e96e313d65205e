"""Where the machine code of a kernel comes from: its sources, and what these leave open."""

import hashlib
import sys
from collections.abc import Iterator
from enum import Enum, EnumType
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, ModuleType
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numba.core import types

from renderer.jit.digest import is_ours, source_digest

# Stands for a value of which nothing is known.
_UNKNOWN = object()
# The texts of functions and of the values that they name, as they were when first needed.
_at_first: WeakKeyDictionary[Any, tuple[str | None, ...]] = WeakKeyDictionary()


def digest_of(function: Any) -> str | None:
    """The digest of the files that the code of a kernel depends on; None if that is unknown.

    A nested function stands for many functions of the same text.
    """
    return None if "<locals>" in function.__qualname__ else source_digest(_file_of(function))


def values_of(function: Any) -> tuple[str | None, ...]:
    """Texts of all that the digest of a kernel in another package leaves open: which function of the file it is, the
    values that it names, and the same of the kernels that it calls.

    There are none for a kernel of this package. One is None where a value is unknown, or has changed since it was
    first needed: what was compiled then may be a part of what is compiled now.
    """
    found: list[str | None] = []
    seen: set[Any] = set()
    functions = [function]
    while functions:
        one = functions.pop()
        if one not in seen and not is_ours(_file_of(one)):
            seen.add(one)
            values = list(_named_values(one))
            functions += [value.py_func for value in values if hasattr(value, "py_func")]
            own = (source_digest(_file_of(one)), _place_of(one), *map(_text, values))
            found += own if own == _at_first.setdefault(one, own) else (None,)
    return tuple(found)


@cache
def digests_of(signature: tuple[Any, ...]) -> tuple[str | None, ...]:
    """The digests of the sources of kernels and of named tuples' classes among types, at any depth, in their order.

    None where one is unknown, as that of a nested kernel.
    """
    digests: list[str | None] = []
    pending = list(signature)
    while pending:
        one = pending.pop()
        if isinstance(one, types.Dispatcher):
            function = one.dispatcher.py_func
            digests += digest_of(function), *values_of(function)
            if type(one) is types.Dispatcher:  # Numba's own, whose text is that of one process
                digests.append(None)
        if isinstance(one, types.BaseNamedTuple):
            digests.append(_class_text(one.instance_class))
        if isinstance(one, types.BaseTuple):
            pending += one
    return tuple(digests)


def _file_of(function: Any) -> Path:
    return Path(function.__code__.co_filename)


def _place_of(function: Any) -> str:
    """A text that tells the functions of a file apart."""
    code = function.__code__
    return f"{function.__qualname__} {code.co_firstlineno} {hashlib.sha256(code.co_linetable).hexdigest()}"


def _named_values(function: Any) -> Iterator[Any]:
    """The values of the globals and of the outer function's variables that a function names, those of modules and
    tuples, and its defaults; ``_UNKNOWN`` where one cannot be seen.
    """
    names = _names_in(function.__code__)
    known = {name: function.__globals__[name] for name in names if name in function.__globals__}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            known[name] = cell.cell_contents
        except ValueError:  # empty as yet
            known[name] = _UNKNOWN
    pending = [*known.values(), function.__defaults__, *(function.__kwdefaults__ or {}).items()]
    modules: set[ModuleType] = set()
    while pending:
        value = pending.pop()
        if isinstance(value, ModuleType) and value not in modules:
            modules.add(value)
            pending += [getattr(value, name) for name in names if hasattr(value, name)]
        elif isinstance(value, tuple):
            pending += value
        yield value


def _names_in(code: CodeType) -> list[str]:
    """The names of globals and attributes in a function and in those within it."""
    inner = [name for one in code.co_consts if isinstance(one, CodeType) for name in _names_in(one)]
    return sorted({*code.co_names, *inner})


def _text(value: Any) -> str | None:
    """A text that differs where values differ that a kernel takes for constants; None for one of unknown kind."""
    defined = getattr(value, "_defn", value)  # of an intrinsic
    if hasattr(value, "py_func"):
        return f"kernel {getattr(value, 'targetoptions', '')}"
    if hasattr(defined, "__code__"):
        return source_digest(_file_of(defined))
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, EnumType | Enum):
        return f"{value!r} {list(value if isinstance(value, EnumType) else type(value))}"
    if isinstance(value, tuple):
        return f"{len(value)} {_class_text(type(value))}"
    if isinstance(value, type):
        return _class_text(value)
    if isinstance(value, BuiltinFunctionType | np.ufunc | ModuleType):
        return f"{getattr(value, '__module__', '')} {value.__name__}"
    if isinstance(value, bool | int | float | complex | str | bytes | np.generic | types.Type | None):
        return f"{type(value)} {value!r}"
    return None


def _class_text(one: Any) -> str | None:
    """A text of a class and of its source. Two named tuples of one name have types of one text."""
    file = getattr(sys.modules.get(one.__module__), "__file__", None)
    source = source_digest(Path(file)) if file else one.__module__
    return source and f"{source} {one.__module__}.{one.__qualname__} {getattr(one, '_fields', ())}"
