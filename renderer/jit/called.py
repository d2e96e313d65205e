"""The files of kernels as other kernels call them: found by their names, and by the sources of what they get."""

import sys
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import types

from renderer.jit.cache import KernelStore, digest_of
from renderer.jit.digest import source_digest


class CalledStore(KernelStore):
    """The files of a kernel that other kernels call."""

    def knows(self, signature: Any) -> bool:
        """Also that its callers find it by its name, and the sources of its arguments' types."""
        named = getattr(sys.modules.get(self._function.__module__), self._function.__qualname__, None)
        found = getattr(named, "py_func", None) is self._function
        return found and super().knows(signature) and None not in _digests(tuple(signature))

    def _key(self, signature: Any, machine: tuple[str, ...]) -> tuple[str, ...]:
        """With the sources of the kernels and classes among the arguments, which its own file need not import."""
        return (*super()._key(signature, machine), *sorted(str(digest) for digest in _digests(tuple(signature))))


@cache
def _digests(signature: tuple[Any, ...]) -> frozenset[str | None]:
    """The digests of the sources of kernels and of named tuples' classes among types, at any depth.

    None where one is unknown, as that of a nested kernel.
    """
    digests: set[str | None] = set()
    pending = list(signature)
    while pending:
        one = pending.pop()
        if isinstance(one, types.Dispatcher):
            digests.add(digest_of(one.dispatcher.py_func))
        if isinstance(one, types.BaseNamedTuple):
            made = one.instance_class
            # Two classes of one name have types of one text.
            source = source_digest(Path(str(sys.modules[made.__module__].__file__)))
            digests.add(source and f"{source} {made.__module__}.{made.__qualname__} {made._fields}")
        if isinstance(one, types.BaseTuple):
            pending += one
    return frozenset(digests)
