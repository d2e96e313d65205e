"""The decorators of kernels: no GIL, no fastmath, C's rules for division, machine code kept on disk.

Python and other kernels call a kernel alike. It allocates nothing and raises nothing; the caller keeps its arrays
alive. In another package, a kernel is compiled again after edits of its own file, of this package or of the kernels
that it calls, and for other values of the constants that it names. A nested kernel is never kept on disk. A kernel may
call itself with the types that it got; other recursion raises ``numba.errors.UnsupportedError``.
"""

from collections.abc import Callable
from functools import cache
from logging import getLogger
from typing import Any

from renderer.collector import resting

with resting():
    import numba

# The versions of Numba whose insides ``compiler`` was tested with; any other is tried before it is relied upon.
_TESTED = ("0.68.",)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` as a kernel; LLVM decides where a call of it is inlined."""
    return _decorated(function, forceinline=False)


def inlined(function: Callable[..., Any]) -> Any:
    """A kernel that LLVM must inline: for innermost loops, whose vectors a call would pass through memory."""
    return _decorated(function, forceinline=True)


def apart(function: Callable[..., Any]) -> Any:
    """A kernel whose machine code is made once for all that call it: for what is large and seldom needed."""
    return _decorated(function, forceinline=False, is_apart=True)


def entry_of(kernel: Any) -> Any:
    """The dispatcher of a kernel that Python calls, to call it in a fifth of a microsecond less."""
    return getattr(kernel, "entry", kernel)


def is_on_disk(kernel: Any) -> bool:
    """Whether a kernel is on disk for some argument types, so that another process need not compile it.

    Also True if nothing can be kept: then no process can help another.
    """
    store = getattr(kernel, "store", None)
    return store is None or bool(store.is_stored())


def _decorated(function: Callable[..., Any], forceinline: bool, is_apart: bool = False) -> Any:
    compiler = _compiler()
    if compiler is None:
        return numba.njit(nogil=True, error_model="numpy", forceinline=forceinline)(function)
    return compiler.Kernel(function, forceinline, is_apart=is_apart)


@cache
def _compiler() -> Any:
    """The module ``compiler``, or None if it does not fit this version of Numba, which is logged once."""
    if numba.config.DISABLE_JIT:
        raise ImportError("renderer: NUMBA_DISABLE_JIT is set, but kernels run only compiled: unset it")
    try:
        from renderer.jit import compiler

        if not numba.__version__.startswith(_TESTED):
            compiler.probe()
    except Exception as error:
        getLogger("renderer.jit").warning(
            "renderer: Numba %s is not one of those that this version was made for (%s*): %s: %s. Kernels work, but "
            "every process compiles them anew, for a minute or more",
            numba.__version__,
            "*, ".join(_TESTED),
            type(error).__name__,
            " ".join(str(error).split()),
        )
        return None
    return compiler
