"""How a kernel calls another whose machine code is apart: by a symbol, which this process knows before it needs it."""

import copy
import hashlib
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import llvmlite.binding as llvm  # type: ignore[import-untyped]
from llvmlite import ir
from numba.core.compiler import CompileResult

from renderer.jit.cache import KernelStore


@dataclass(frozen=True)
class Reference:
    """What a caller links in place of an apart kernel: nothing. Called before the caller is loaded from disk.

    module, name  where the kernel is
    arguments     Numba's types of its arguments
    """

    module: str
    name: str
    arguments: tuple[Any, ...]

    def __call__(self) -> None:
        getattr(import_module(self.module), self.name).apart.compiled(self.arguments)

    def _ensure_finalized(self) -> None:
        """Nothing: Numba asks this of what it links."""


class ApartStore(KernelStore):
    """The files of an apart kernel's own machine code."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._name += ".apart"

    def symbol(self, signature: Any) -> str:
        """The name by which callers call it."""
        text = f"{signature} {self._digest}"
        return f"octree_renderer.{self._name}.{hashlib.sha256(text.encode()).hexdigest()[:16]}"

    def _rebuilt(self, signature: Any, context: Any, payload: Any) -> CompileResult:
        stored, descriptor, _, result, _, _, _, references, environments = payload
        for reference in references:
            reference()
        library = context.codegen().unserialize_library(stored)
        for one in environments:
            library.codegen.set_env(one.env_name, one)
        compiled = CompileResult(*(None,) * len(CompileResult._fields))
        compiled = compiled._replace(library=library, fndesc=descriptor, signature=result, objectmode=False)
        return self.callable(signature, compiled)

    def callable(self, signature: Any, compiled: CompileResult) -> CompileResult:
        """A compiled apart kernel as other kernels call it."""
        symbol = compiled.fndesc.mangled_name
        llvm.add_symbol(symbol, compiled.library.get_pointer_to_function(symbol))
        reference = Reference(self._function.__module__, self._function.__qualname__, tuple(signature))
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
