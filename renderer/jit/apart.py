"""How a kernel calls another whose machine code is apart: by a symbol, which this process knows before it needs it."""

import copy
import hashlib
import sys
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any
from uuid import uuid4

import llvmlite.binding as llvm  # type: ignore[import-untyped]
from llvmlite import ir
from numba.core import types
from numba.core.compiler import CompileResult, compile_result

from renderer.jit.cache import KernelStore, digest_of
from renderer.jit.digest import source_digest


@dataclass(frozen=True)
class Reference:
    """What a caller links in place of an apart kernel: nothing. Called before the caller is loaded from disk.

    module, name  where the kernel is
    arguments     Numba's types of its arguments
    symbol        the name by which the caller calls it
    kept          whether another process finds the same kernel there
    """

    module: str
    name: str
    arguments: tuple[Any, ...]
    symbol: str
    kept: bool

    def __call__(self) -> None:
        found = getattr(import_module(self.module), self.name).apart
        if found.compiled(self.arguments).fndesc.mangled_name != self.symbol:
            raise RuntimeError(f"{self.module}.{self.name} has changed since its caller was compiled")

    @property
    def _reload_init(self) -> set["Reference"]:
        """What Numba calls before it loads a function that links this one."""
        return {self}

    def _ensure_finalized(self) -> None:
        """Nothing: Numba asks this of what it links."""

    def _get_module_for_linking(self) -> Any:
        return llvm.parse_assembly("")


class ApartStore(KernelStore):
    """The files of an apart kernel's own machine code."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._name += ".apart"

    def symbol(self, signature: Any) -> str:
        """The name by which callers call it; a new one if no file can stand for it."""
        text = "\0".join(self._key(signature, ())) if self.knows(signature) else uuid4().hex
        return f"octree_renderer.{self._name}.{hashlib.sha256(text.encode()).hexdigest()[:16]}"

    def knows(self, signature: Any) -> bool:
        """Also that its callers find it by its name, and the sources of its arguments' types."""
        named = getattr(sys.modules.get(self._function.__module__), self._function.__qualname__, None)
        found = getattr(named, "py_func", None) is self._function
        return found and super().knows(signature) and None not in _digests(signature)

    def _key(self, signature: Any, machine: tuple[str, ...]) -> tuple[str, ...]:
        """With the sources of the kernels and classes among the arguments, which its own file need not import."""
        return (*super()._key(signature, machine), *sorted(str(digest) for digest in _digests(signature)))

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


def _digests(signature: Any) -> set[str | None]:
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
            digests.add(source_digest(Path(str(sys.modules[one.instance_class.__module__].__file__))))
        if isinstance(one, types.BaseTuple):
            pending += one
    return digests


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
