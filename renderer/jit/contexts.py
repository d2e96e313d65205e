"""Numba's contexts as pieces are compiled with: they do not look for new declarations, and remember how calls of
operators and intrinsics are typed.

Numba looks and types anew in each function, which is an eighth of the time of compiling. The entry whose pieces are
compiled has just looked.
"""

from functools import cache
from typing import Any

from numba.core import types
from numba.core.datamodel.models import OpaqueModel
from numba.extending import register_model


class _Context:
    """A context of Numba."""

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def refresh(self) -> None:
        """Nothing: Numba's own looks for new declarations."""


class PieceTyping(_Context):
    """A typing context for pieces that are inlined by force, or for the others."""

    def __init__(self, context: Any, forceinline: bool) -> None:
        super().__init__(context)
        self._forceinline = forceinline

    def resolve_value_type(self, value: Any) -> Any:
        """The type of a constant."""
        found = self._context.resolve_value_type(value)
        return _remembering(found, self._forceinline) if type(found) is types.Function else found


class PieceTarget(_Context):
    """A target context, whose typing context is ``typing``."""

    def __init__(self, context: Any, typing: PieceTyping) -> None:
        super().__init__(context)
        self._typing = typing

    def subtarget(self, **options: Any) -> Any:
        """The context of one function, with options of its own."""
        return self._context.subtarget(typing_context=self._typing, **options)


class _Remembering(types.Function):  # type: ignore[misc]
    """A function of Numba that remembers the types of its calls.

    Numba hands its caller's ``forceinline`` on to a function that it compiles for a call.
    """

    def __init__(self, function: types.Function, forceinline: bool) -> None:
        self._forceinline = forceinline
        self._signatures: dict[tuple[types.Type, ...], Any] = {}
        super().__init__(function.templates)
        self.name = function.name

    @property
    def key(self) -> Any:
        """By which types of Numba are equal."""
        return *super().key, self._forceinline

    def get_call_type(self, context: Any, arguments: Any, keywords: Any) -> Any:
        """The signature of a call; raises Numba's ``TypingError`` if there is none."""
        if keywords:
            return super().get_call_type(context, arguments, keywords)
        arguments = tuple(arguments)
        if arguments not in self._signatures:
            self._signatures[arguments] = super().get_call_type(context, arguments, keywords)
        return self._signatures[arguments]


register_model(_Remembering)(OpaqueModel)
# A function that gets more templates is another for Numba.
_remembering = cache(_Remembering)
# One for all pieces: Numba's own memories tell typing contexts apart.
piece_typing = cache(PieceTyping)
