"""Pieces on disk: a function that several kernels contain is typed and lowered once, not in each process that compiles
one of them.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from numba.core import types
from numba.core.compiler import CompileResult, compile_result

from renderer.jit.cache import hash_of, is_chosen
from renderer.jit.called import CalledStore
from renderer.jit.digest import is_ours
from renderer.jit.libraries import Named, PieceLibrary


class PieceStore(CalledStore):
    """The files of one function's pieces."""

    suffix = ".piece"

    def knows(self, signature: Any) -> bool:
        """Also that its sources are this package's, whose imports the digest follows, and that its types' text says all
        of them.
        """
        return is_ours(self._source) and all(map(_is_plain, signature)) and super().knows(signature)

    def unique(self, signature: Any, context: Any) -> str | None:
        """A text by which its names differ from those of other pieces in any process; None if no file can stand for it.

        Numba's own number is that of one process.
        """
        return hash_of(self._key(signature, context.codegen().magic_tuple())) if self.knows(signature) else None

    def _give_name(self, signature: Any, compiled: CompileResult) -> None:
        """Give a piece the name by which other processes find it, if they would find all that it contains."""
        below = compiled.library._linking_libraries
        if self.knows(signature) and all(_is_found(library) for library in below):
            function = self._function
            place = function.__module__, function.__qualname__
            compiled.library.named = Named(*place, tuple(signature), compiled.fndesc.mangled_name)

    def save_overload(self, signature: Any, compiled: CompileResult) -> None:
        """Write a piece for other processes, unless they would not find it, or write to a folder to be carried away."""
        self._give_name(signature, compiled)
        if compiled.library.named is not None and not is_chosen():
            self.write(signature, compiled)

    def _places(self, signature: Any, machine: tuple[str, ...]) -> Iterable[tuple[Path, tuple[str, ...]]]:
        return self._own_places(signature, machine)

    def _rebuilt(self, signature: Any, context: Any, payload: Any) -> CompileResult | None:
        stored, descriptor, environment, result, *_ = payload
        library = PieceLibrary.read(context.codegen(), stored)
        if library is None:
            return None
        compiled = compile_result(
            library=library,
            fndesc=descriptor,
            environment=environment,
            signature=result,
            objectmode=False,
            entry_point=object(),
        )
        self._give_name(signature, compiled)
        return compiled


def _is_plain(one: Any) -> bool:
    """Whether the text of a type, with the digests of kernels and classes in it, decides the type.

    A module, a class or an enumeration as an argument would bring values of sources that no digest follows.
    """
    if isinstance(one, types.BaseTuple):
        return all(map(_is_plain, one))
    if isinstance(one, types.Array | types.CPointer):
        return _is_plain(one.dtype)
    plain = types.Number | types.Boolean | types.NoneType | types.RawPointer
    # Kernels, and vectors of SIMD, have types of this package.
    return isinstance(one, plain) or type(one).__module__.startswith("renderer.")


def _is_found(library: Any) -> bool:
    """Whether another process finds a library that a piece links; functions of Numba's own are written with it."""
    if isinstance(library, PieceLibrary):
        return library.named is not None
    return getattr(library, "kept", True) if isinstance(library, Named) else True
