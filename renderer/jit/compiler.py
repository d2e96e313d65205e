"""Compiles kernels by Numba at a third of its usual cost: only what Python calls is optimised and compiled.

Numba takes each function, however small, through its whole pipeline: LLVM optimises and compiles it alone, then again
in each of its callers, and a wrapper lets Python call it. Here a function called by kernels stays a *piece*: typed,
lowered to LLVM code and simplified, but not compiled. A function called by Python is an *entry*: its piece and all
pieces below it, linked into one module that LLVM optimises once.

This relies on Numba's internals. For untested versions of Numba, ``decorators`` calls ``probe``, and does without this
module if that fails.
"""

import os
import pickle
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import update_wrapper
from importlib import import_module
from typing import Any

from numba.core import types
from numba.core.codegen import RuntimeLinker
from numba.core.compiler import CompilerBase, CompileResult, compile_result
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.datamodel.models import OpaqueModel
from numba.core.errors import UnsupportedError
from numba.core.imputils import lower_constant
from numba.core.registry import CPUDispatcher
from numba.core.serialize import dumps
from numba.core.typed_passes import (
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.untyped_passes import FixupArgs, GenericRewrites, IRProcessing, ReconstructSSA, TranslateByteCode
from numba.extending import register_model

from renderer.jit.apart import ApartStore, write_symbol
from renderer.jit.cache import KernelStore
from renderer.jit.contexts import PieceTarget, piece_typing
from renderer.jit.entry import Entry
from renderer.jit.libraries import EntryLibrary, PieceLibrary
from renderer.jit.notice import compiling
from renderer.jit.pieces import PieceStore
from renderer.lazy import lazy

if hasattr(os, "register_at_fork"):
    # A child forked while another thread compiles or loads would wait for ever for Numba's lock.
    os.register_at_fork(
        before=global_compiler_lock.acquire,
        after_in_parent=global_compiler_lock.release,
        after_in_child=global_compiler_lock.release,
    )

# No array is allocated in a kernel, so none counts references: Numba's counts take a locked instruction each.
# Every option is set, because Numba would copy an unset one from the kernel that calls this one.
OPTIONS = {
    "nopython": True,
    "nogil": True,
    "error_model": "numpy",
    "forceinline": False,
    "_nrt": False,
    "no_cfunc_wrapper": True,
}


@register_pass(mutates_CFG=True, analysis_only=False)
class _LowerPiece(NativeLowering):  # type: ignore[misc]
    """Lower a function for kernels only."""

    _name = "renderer_lower_piece"

    def run_pass(self, state: Any) -> bool:
        state.library = PieceLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        state.flags.no_cpython_wrapper = True
        super().run_pass(state)
        _refuse_recursion(state)
        key = object()  # by which callers find it, in place of a function that Python can call
        state.cr = state.cr._replace(cfunc=key)
        state.targetctx.insert_user_function(key, state.cr.fndesc, [state.library])
        return True


def _refuse_recursion(state: Any) -> None:
    """Raise ``UnsupportedError`` if a piece calls one that is not compiled before it: pieces are linked by what they
    contain.
    """
    # By variables of such names Numba calls what is not compiled yet.
    if any(one.name.startswith(RuntimeLinker.PREFIX) for one in state.library._final_module.global_variables):
        raise UnsupportedError(
            f"kernel {state.func_id.func_qualname}({', '.join(map(str, state.args))}): expected calls of itself with "
            "these types alone, and of kernels that do not call it, got a call in turn or with other types"
        )


class _Link(LoweringPass):  # type: ignore[misc]
    """Link a function's piece with all below it, unless another process did so meanwhile."""

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        kernel = _kernels[state.func_id.func]
        store = self._store_of(kernel)
        with kernel.notice(), store.turn(state.args, state.targetctx) as found:
            state.cr = found or self._linked(kernel, store, state)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkEntry(_Link):
    """Make a function's piece callable by Python."""

    _name = "renderer_link_entry"

    def _store_of(self, kernel: "Kernel") -> KernelStore:
        return kernel.store

    def _linked(self, kernel: "Kernel", store: KernelStore, state: Any) -> CompileResult:
        compiled = _entry_of(kernel.piece.compiled(state.args), state)
        if kernel.kept:
            _keep(store, state.args, compiled)
        return compiled


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkApart(_Link):
    """Make a function's piece callable by kernels that do not contain it."""

    _name = "renderer_link_apart"

    def run_pass(self, state: Any) -> bool:
        super().run_pass(state)
        state.targetctx.insert_user_function(state.cr.entry_point, state.cr.fndesc, [state.cr.library])
        return True

    def _store_of(self, kernel: "Kernel") -> ApartStore:
        return kernel.apart_store

    def _linked(self, kernel: "Kernel", store: ApartStore, state: Any) -> CompileResult:
        compiled = _apart_of(kernel.piece.compiled(state.args), state, store.symbol(state.args))
        _keep(store, state.args, compiled)
        return store.callable(state.args, compiled)


def _keep(store: KernelStore, arguments: Any, compiled: CompileResult) -> None:
    """Write a kernel, unless another process would not find what it calls."""
    if all(getattr(called, "kept", True) for called in compiled.reload_init):
        store.keep(arguments, compiled)


def _library_of(piece: Any, state: Any) -> EntryLibrary:
    library = EntryLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
    library.enable_object_caching()
    library.add_linking_library(piece.library)
    return library


def _entry_of(piece: Any, state: Any) -> CompileResult:
    """The function that Python calls of a piece."""
    context, library = state.targetctx, _library_of(piece, state)
    context.create_cpython_wrapper(library, piece.fndesc, piece.environment, piece.call_helper, state.flags.release_gil)
    function = context.get_executable(library, piece.fndesc, piece.environment)
    return _result(state, piece, library, entry_point=function, fndesc=piece.fndesc)


def _apart_of(piece: Any, state: Any, symbol: str) -> CompileResult:
    """The function that kernels call of a piece that they do not contain."""
    library = _library_of(piece, state)
    descriptor = write_symbol(library, state.targetctx, piece, symbol)
    library.finalize()
    return _result(state, piece, library, entry_point=None, fndesc=descriptor)


def _result(state: Any, piece: Any, library: EntryLibrary, **fields: Any) -> CompileResult:
    library.set_environments()
    return compile_result(
        typing_context=state.typingctx,
        target_context=state.targetctx,
        typing_error=None,
        library=library,
        call_helper=piece.call_helper,
        signature=piece.signature,
        objectmode=False,
        lifted=(),
        environment=piece.environment,
        metadata=state.metadata,
        reload_init=list(piece.library._reload_init),
        **fields,
    )


# The passes of Numba that kernels need: they have no closures, no ``with``, no array expressions, no object mode.
_PIECE_PASSES = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    GenericRewrites,
    ReconstructSSA,
    NopythonTypeInference,
    PreLowerStripPhis,
    IRLegalization,
    _LowerPiece,
    NoPythonBackend,
)


class _PieceCompiler(CompilerBase):  # type: ignore[misc]
    def __init__(
        self, typing: Any, target: Any, library: Any, arguments: Any, result: Any, flags: Any, kinds: Any
    ) -> None:
        typing = piece_typing(typing, flags.forceinline)
        super().__init__(typing, PieceTarget(target, typing), library, arguments, result, flags, kinds)

    def _compile_bytecode(self) -> Any:
        state = self.state
        unique = _kernels[state.func_id.func].piece_store.unique(state.args, state.targetctx)
        if unique is not None:
            state.func_id.unique_id = unique
        return super()._compile_bytecode()

    def define_pipelines(self) -> list[PassManager]:
        return [_pipeline("piece", _PIECE_PASSES)]


class _ApartCompiler(CompilerBase):  # type: ignore[misc]
    def define_pipelines(self) -> list[PassManager]:
        return [_pipeline("apart", (_LinkApart,))]


class _EntryCompiler(CompilerBase):  # type: ignore[misc]
    def define_pipelines(self) -> list[PassManager]:
        return [_pipeline("entry", (_LinkEntry,))]


def _pipeline(name: str, passes: tuple[Any, ...]) -> PassManager:
    manager = PassManager(name)
    for one in passes:
        manager.add_pass(one, one.__name__)
    manager.finalize()
    return manager


class _Piece(CPUDispatcher):  # type: ignore[misc]
    """A function as other kernels call it."""

    def compile(self, arguments: Any) -> Any:
        """As Numba's dispatchers compile, without their clocks: each that is nested slows all calls of LLVM below."""
        with global_compiler_lock, self._compiling_counter:
            found = self.overloads.get(arguments) or self._cache.load_overload(arguments, self.targetctx)
            if found is None:
                self._compilation_chain_init_hook()
                self._cache_misses[arguments] += 1
                found = self._compiler.compile(arguments, None)
                self.add_overload(found)
                self._cache.save_overload(arguments, found)
            elif arguments not in self.overloads:
                self._cache_hits[arguments] += 1
                self.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
                self.add_overload(found)
            return found.entry_point

    def add_overload(self, compiled: Any) -> None:
        # Left out of the dispatcher's table of functions that Python may call.
        self.overloads[tuple(compiled.signature.args)] = compiled

    def compiled(self, arguments: Any) -> Any:
        """The piece compiled for arguments of these types; compiles it if needed."""
        self.compile(tuple(arguments))
        return self.overloads[tuple(arguments)]

    def get_call_template(self, arguments: Any, keywords: Any) -> Any:
        # Numba would compile a kernel for each constant that a caller writes as a literal.
        plain = [types.unliteral(a) for a in arguments]
        return super().get_call_template(plain, {k: types.unliteral(v) for k, v in keywords.items()})


class _KernelType(types.Dispatcher):  # type: ignore[misc]
    """The type of a kernel as a value in a kernel, with a name and a way to be read that are those of any process."""

    def __init__(self, kernel: "Kernel") -> None:
        super().__init__(kernel.apart if kernel.is_apart else kernel.piece)
        function = kernel.py_func
        self.name = f"kernel {function.__module__}.{function.__qualname__}"

    def __reduce__(self) -> tuple[Any, ...]:
        function = self.dispatcher.py_func
        return _type_of, (function.__module__, function.__qualname__)


def _type_of(module: str, name: str) -> Any:
    return getattr(import_module(module), name)._numba_type_


@register_model(_KernelType)
class _KernelModel(OpaqueModel):  # type: ignore[misc]
    """Nothing: the type says which kernel it is."""


@lower_constant(_KernelType)  # type: ignore[untyped-decorator]
def _nothing(context: Any, builder: Any, kind: Any, kernel: Any) -> Any:
    return context.get_dummy_value()


class Kernel:
    """A function for Python and for kernels; its dispatcher for each is created at the first use.

    Creating a Numba dispatcher takes a third of a millisecond, and most kernels need none in a process.
    """

    def __init__(
        self, function: Callable[..., Any], forceinline: bool = False, kept: bool = True, is_apart: bool = False
    ) -> None:
        self.py_func = function
        self.kept = kept
        self.is_apart = is_apart
        self._options = {**OPTIONS, "forceinline": forceinline}
        _kernels[function] = self
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self.entry(*arguments)

    @lazy
    def entry(self) -> Any:
        """The dispatcher that Python calls."""
        entry = Entry(self.py_func, targetoptions=self._options, pipeline_class=_EntryCompiler)
        if self.kept:
            entry._cache = self.store
        return entry

    @lazy
    def piece(self) -> _Piece:
        """The dispatcher that kernels call."""
        piece = _Piece(self.py_func, targetoptions=self._options, pipeline_class=_PieceCompiler)
        if self.kept:
            piece._cache = self.piece_store
        return piece

    @lazy
    def piece_store(self) -> PieceStore:
        """The files of its pieces."""
        return PieceStore(self.py_func)

    @lazy
    def apart(self) -> _Piece:
        """The dispatcher that kernels call which do not contain it."""
        apart = _Piece(self.py_func, targetoptions=self._options, pipeline_class=_ApartCompiler)
        apart._cache = self.apart_store
        return apart

    @lazy
    def apart_store(self) -> ApartStore:
        """The files of its machine code that such kernels call."""
        return ApartStore(self.py_func)

    @lazy
    def store(self) -> KernelStore:
        """The files of its machine code."""
        return KernelStore(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        """Its type in a kernel that calls it, read by Numba."""
        return _KernelType(self)

    def notice(self) -> AbstractContextManager[None]:
        """The context in which it is compiled."""
        return compiling(self.py_func.__qualname__, self.store.cache_path) if self.kept else nullcontext()


_kernels: dict[Callable[..., Any], Kernel] = {}


def probe() -> None:
    """Compile, call, store and load a kernel that calls another; raises an error if this Numba does not fit."""

    def doubled(x):  # type: ignore[no-untyped-def]
        return x + x

    def answer(x):  # type: ignore[no-untyped-def]
        return inner(x) + 1

    inner, outer = Kernel(doubled, forceinline=True, kept=False), Kernel(answer, kept=False)
    if outer(20) != 41:
        raise RuntimeError(f"a kernel answered {outer(20)} for 41")
    (compiled,) = outer.entry.overloads.values()
    stored = CompileResult._rebuild(outer.entry.targetctx, *pickle.loads(dumps(compiled._reduce())))
    if stored.entry_point(20) != 41:
        raise RuntimeError(f"a stored kernel answered {stored.entry_point(20)} for 41")
