"""LLVM's code of kernels: pieces, which other kernels contain, and entries, which Python or other kernels call."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, ClassVar

import llvmlite.binding as llvm  # type: ignore[import-untyped]
from numba.core.codegen import JITCodeLibrary
from numba.core.environment import lookup_environment


@dataclass(frozen=True)
class Named:
    """A kernel compiled for some types, as another process finds it.

    module, name  where the kernel is
    arguments     Numba's types of its arguments
    symbol        the name of its function in LLVM's code
    """

    module: str
    name: str
    arguments: tuple[Any, ...]
    symbol: str
    # The attribute of the kernel that is the dispatcher.
    dispatcher: ClassVar[str] = "piece"

    def linked(self) -> Any:
        """What its callers link, compiled or loaded if needed; None if the kernel has changed since."""
        kernel = getattr(import_module(self.module), self.name)
        compiled = getattr(kernel, self.dispatcher).compiled(self.arguments)
        return compiled.library if compiled.fndesc.mangled_name == self.symbol else None


class PieceLibrary(JITCodeLibrary):  # type: ignore[misc]
    """A function's module as lowered, simplified, but neither inlined nor compiled.

    ``named`` is None if another process would not find the same piece.
    """

    named: Named | None = None
    _merged: Any = None

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        # Each function alone first, as Numba does: what is inlined then is small. Worth 2 % of tracing.
        module = self._final_module
        for function in module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(function, builder)
        self._finalize_dynamic_globals()
        for library in self._numbas():
            # Addresses of this process, which are written with the piece.
            self._dynamic_globals += library._dynamic_globals
        self._inherit()

    def _inherit(self) -> None:
        for library in self._linking_libraries:
            self._reload_init |= library._reload_init
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """This module with all below it, for kernels that Numba compiles without ``compiler``."""
        if self._merged is None:
            module = self._final_module.clone()
            _link_all(module, self._linking_libraries)
            for function in module.functions:
                if not function.is_declaration and function.linkage != llvm.Linkage.private:
                    function.linkage = "linkonce_odr"
            self._merged = module
        return self._merged

    def serialize_using_object_code(self) -> Any:
        """The module with what it contains of Numba's own, and what else it links: names of pieces, and references."""
        named = [library.named for library in self._linking_libraries if isinstance(library, PieceLibrary)]
        apart = [library for library in self._linking_libraries if isinstance(library, Named)]
        module = self._final_module
        if self._numbas():
            module = module.clone()
            _link_privately(module, self._numbas())
        return (self.name, module.as_bitcode(), (*named, *apart))

    def _numbas(self) -> list[Any]:
        """The functions of Numba's own that this links."""
        return [library for library in self._linking_libraries if not isinstance(library, PieceLibrary | Named)]

    @classmethod
    def read(cls, codegen: Any, stored: Any) -> "PieceLibrary | None":
        """A library that ``serialize_using_object_code`` wrote; None if a piece that it links has changed."""
        name, bitcode, linked = stored
        self = cls(codegen, name)
        self._final_module = llvm.parse_bitcode(bitcode)
        for one in linked:
            found = one.linked()
            if found is None:
                return None
            self._linking_libraries.append(found)
        self._inherit()
        return self


class EntryLibrary(JITCodeLibrary):  # type: ignore[misc]
    """A wrapper for Python, or a function with a symbol, and all pieces behind it, optimised together."""

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        self._codegen._check_llvm_bugs()
        module = self._final_module
        _link_privately(module, self._linking_libraries)
        passes, builder = self._codegen._module_pass_manager()
        passes.run(module, builder)
        module.verify()
        self._finalize_final_module()

    def serialize_using_object_code(self) -> Any:
        """The machine code. Of the module only the names remain: kernels that call this one link its piece."""
        names = [f.name for f in self._final_module.functions if not f.is_declaration and f.linkage.name == "external"]
        stub = llvm.parse_assembly("\n".join(f'define void @"{name}"() {{ ret void }}' for name in names))
        return (self.name, "object", (self._get_compiled_object(), stub.as_bitcode()))

    def set_environments(self) -> None:
        """Let the functions find Python's objects that they name."""
        for variable in self._final_module.global_variables:
            environment = lookup_environment(variable.name) if variable.name.startswith("_ZN08NumbaEnv") else None
            if environment is not None:
                self.codegen.set_env(variable.name, environment)


def _link_privately(module: Any, libraries: list[Any]) -> None:
    """Link libraries and their dependencies into ``module``, whose own functions alone keep a symbol."""
    outer = {function.name for function in module.functions if not function.is_declaration}
    _link_all(module, libraries)
    for function in module.functions:
        if not function.is_declaration and function.name not in outer:
            # Private, so that it is dropped where it is inlined everywhere, and has no symbol. An internal function
            # has one, by which another kernel's call of the same piece would find this function, whose arguments
            # the optimiser may have changed.
            function.linkage = "private"


def _link_all(module: Any, libraries: list[Any]) -> None:
    """Link libraries and their dependencies into ``module``, each once."""
    done: set[int] = set()
    pending = list(libraries)
    while pending:
        library = pending.pop()
        if id(library) in done:
            continue
        done.add(id(library))
        if isinstance(library, PieceLibrary):
            module.link_in(library._final_module, preserve=True)
            pending += library._linking_libraries
        else:  # a function of Numba's own
            module.link_in(library._get_module_for_linking(), preserve=True)
