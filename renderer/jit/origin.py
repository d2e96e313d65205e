"""Where the machine code of a kernel comes from: its sources, and what these leave open."""

import hashlib
import sys
from collections.abc import Iterator
from functools import cache
from operator import itemgetter
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numba.core import types

from renderer.jit.digest import is_ours, source_digest


def digest_of(function: Any) -> str | None:
    """The digest of the files that the code of a kernel depends on; None if that is unknown.

    A nested function stands for many functions of the same text.
    """
    return None if "<locals>" in function.__qualname__ else source_digest(_file_of(function))


def values_of(function: Any) -> tuple[str | None, ...]:
    """What the digest of a kernel in another package leaves open: which function of the file it is, the values that it
    names, and the same of the kernels that it calls. Empty for a kernel of this package; None among them where a source
    is unknown.
    """
    found: list[str | None] = []
    seen: set[Any] = set()
    functions = [function]
    while functions:
        one = functions.pop()
        if one in seen or is_ours(_file_of(one)):
            continue
        seen.add(one)
        code = one.__code__
        lines = hashlib.sha256(code.co_linetable).hexdigest()
        found += [source_digest(_file_of(one)), f"{one.__qualname__} {code.co_firstlineno} {lines}"]
        values = list(_named_values(one))
        functions += [value.py_func for value in values if hasattr(value, "py_func")]
        found += [_text(value) for value in values]
    return tuple(found)


@cache
def digests_of(signature: tuple[Any, ...]) -> frozenset[str | None]:
    """The digests of the sources of kernels and of named tuples' classes among types, at any depth.

    None where one is unknown, as that of a nested kernel.
    """
    digests: set[str | None] = set()
    pending = list(signature)
    while pending:
        one = pending.pop()
        if isinstance(one, types.Dispatcher):
            function = one.dispatcher.py_func
            digests |= {digest_of(function), *values_of(function)}
        if isinstance(one, types.BaseNamedTuple):
            digests.add(_class_text(one.instance_class))
        if isinstance(one, types.BaseTuple):
            pending += one
    return frozenset(digests)


def _file_of(function: Any) -> Path:
    return Path(function.__code__.co_filename)


def _named_values(function: Any) -> Iterator[Any]:
    """The values of the globals and of the outer function's variables that a function names, and those of modules."""
    names = function.__code__.co_names
    known = {name: function.__globals__[name] for name in names if name in function.__globals__}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        known[name] = cell.cell_contents
    pending = [value for _, value in sorted(known.items(), key=itemgetter(0))]
    modules: set[ModuleType] = set()
    while pending:
        value = pending.pop()
        if isinstance(value, ModuleType) and value not in modules:
            modules.add(value)
            pending += [vars(value)[name] for name in names if name in vars(value)]
        elif isinstance(value, tuple):
            pending += value
        yield value


def _text(value: Any) -> str | None:
    """A text that differs where values differ that a kernel takes for constants."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, type) and issubclass(value, tuple):
        return _class_text(value)
    is_plain = isinstance(value, bool | int | float | complex | str | bytes | np.generic | None)
    return repr(value) if is_plain else type(value).__qualname__


def _class_text(one: Any) -> str | None:
    """What a named tuple's class is. Two classes of one name have types of one text."""
    file = getattr(sys.modules.get(one.__module__), "__file__", None)
    source = source_digest(Path(file)) if file else one.__module__
    return source and f"{source} {one.__module__}.{one.__qualname__} {getattr(one, '_fields', ())}"
