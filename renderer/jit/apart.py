"""Calls of a kernel whose machine code is apart: by a symbol, which this process knows before it needs it."""

import copy
import hashlib
from dataclasses import dataclass
from typing import Any, ClassVar
from uuid import uuid4

import llvmlite.binding as llvm  # type: ignore[import-untyped]
from llvmlite import ir
from numba.core.compiler import CompileResult, compile_result

from renderer.jit.called import CalledStore
from renderer.jit.libraries import Named


@dataclass(frozen=True)
class Reference(Named):
    """The empty library that a caller links in place of an apart kernel. Called before the caller is loaded from disk.

    ``kept`` says whether another process finds the same kernel there.
    """

    kept: bool
    dispatcher: ClassVar[str] = "apart"

    def __call__(self) -> None:
        if self.linked() is None:
            raise RuntimeError(f"{self.module}.{self.name} has changed since its caller was compiled")

    @property
    def _reload_init(self) -> set["Reference"]:
        """The functions that Numba calls before it loads one that links this."""
        return {self}

    def _ensure_finalized(self) -> None:
        """Nothing: Numba asks this of what it links."""

    def _get_module_for_linking(self) -> Any:
        return llvm.parse_assembly("")


class ApartStore(CalledStore):
    """The files of an apart kernel's own machine code."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._name += ".apart"

    def symbol(self, signature: Any) -> str:
        """The name by which callers call it; a new one if no file can stand for it."""
        text = "\0".join(self._key(signature, ())) if self.knows(signature) else uuid4().hex
        return f"octree_renderer.{self._name}.{hashlib.sha256(text.encode()).hexdigest()[:16]}"

    def _rebuilt(self, signature: Any, context: Any, payload: Any) -> CompileResult:
        stored, descriptor, _, result, _, _, _, references, environments = payload
        for reference in references:
            reference()
        library = context.codegen().unserialize_library(stored)
        for one in environments:
            library.codegen.set_env(one.env_name, one)
        return self.callable(
            signature, compile_result(library=library, fndesc=descriptor, signature=result, objectmode=False)
        )

    def callable(self, signature: Any, compiled: CompileResult) -> CompileResult:
        """A compiled apart kernel as other kernels call it."""
        symbol, function = compiled.fndesc.mangled_name, self._function
        llvm.add_symbol(symbol, compiled.library.get_pointer_to_function(symbol))
        kept = self.knows(signature)
        reference = Reference(function.__module__, function.__qualname__, tuple(signature), symbol, kept)
        return compiled._replace(library=reference, entry_point=object())


def write_symbol(library: Any, context: Any, piece: Any, symbol: str) -> Any:
    """Add a function to a library, which calls a piece and has a symbol; returns its descriptor.

    Raises ``TypeError`` for a vector among its arguments, which code for another level would pass in other registers.
    """
    descriptor = copy.copy(piece.fndesc)
    descriptor.mangled_name = symbol
    kind = context.call_conv.get_function_type(descriptor.restype, descriptor.argtypes)
    if any(isinstance(argument, ir.VectorType) for argument in kind.args):
        raise TypeError(f"{symbol}: expected numbers and pointers as arguments of a kernel apart, got a vector")
    module = library.create_ir_module("apart")
    inner, outer = (ir.Function(module, kind, name) for name in (piece.fndesc.mangled_name, symbol))
    builder = ir.IRBuilder(outer.append_basic_block())
    builder.ret(builder.call(inner, outer.args))
    library.add_ir_module(module)
    return descriptor
