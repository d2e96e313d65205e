"""Ctrl-C in the midst of compiling, for commands that own their process."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread
from types import FrameType

# The usual code of a shell for a process that SIGINT ended.
INTERRUPTED = 130


@contextmanager
def ends_while_compiling(message: str, own_process: bool) -> Iterator[None]:
    """Within, Ctrl-C that meets the compiler prints ``message`` and ends the process; elsewhere it raises as always.

    A KeyboardInterrupt raised in Numba may be swallowed by a destructor or callback, come out as another error, or
    leave LLVM in a state that crashes the process at its end. No file of ours is being written then, so nothing is
    lost. Does nothing where the process is not the command's own, or something else handles or ignores SIGINT.
    """
    usual = signal.getsignal(signal.SIGINT)
    if not own_process or usual is not signal.default_int_handler or current_thread() is not main_thread():
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        if _in_compiler(frame):
            # Not by print, which may be what was interrupted; and below a progress bar and the terminal's ^C.
            start = "\n" if os.isatty(2) else ""
            os.write(2, f"{start}{message}\n".encode())
            os._exit(INTERRUPTED)
        signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)


def _in_compiler(frame: FrameType | None) -> bool:
    while frame is not None:
        if str(frame.f_globals.get("__name__")).partition(".")[0] in ("numba", "llvmlite"):
            return True
        frame = frame.f_back
    return False
