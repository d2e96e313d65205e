"""The end of a command by Ctrl-C, with one line and an exit code, also in the compiler; and by other signals."""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from threading import current_thread, main_thread
from types import FrameType
from typing import Protocol

from renderer.collector import spare_at_exit

# The usual code of a shell for a process that SIGINT ended.
INTERRUPTED = 130
# The signals of a job's time limit and of a terminal that is closed. Unhandled, they would leave temporary files.
_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


class Command(Protocol):
    """A ``main``: from arguments, those of its own process for None, to an exit code."""

    def __call__(self, arguments: Sequence[str] | None = None) -> int: ...


def interruptible(message: str) -> Callable[[Command], Command]:
    """Let a command print ``message``, and what the KeyboardInterrupt says, to standard error and return
    ``INTERRUPTED`` on Ctrl-C.
    """

    def decorate(command: Command) -> Command:
        @wraps(command)
        def run(arguments: Sequence[str] | None = None) -> int:
            own_process, ended_by, code = arguments is None, list[int](), INTERRUPTED
            if own_process:
                spare_at_exit()
            try:
                with _ends_clean(ended_by, own_process), ends_while_compiling(message, own_process):
                    code = command(arguments)
            except KeyboardInterrupt as interrupt:
                # Another Ctrl-C, as where Python waits for a thread that compiles, ends the process at once.
                if own_process and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
                    signal.signal(signal.SIGINT, signal.SIG_DFL)
                if not ended_by:
                    print("; ".join(map(str, (message, *interrupt.args))), file=sys.stderr)
            if ended_by:
                # By the signal itself, as without a handler, so that its sender sees that it took effect; also where
                # the command took it for Ctrl-C and ended well.
                signal.raise_signal(ended_by[0])
            return code

        return run

    return decorate


@contextmanager
def _ends_clean(ended_by: list[int], own_process: bool) -> Iterator[None]:
    """A context in which a signal that would end the process raises KeyboardInterrupt, to remove temporary files.

    Its number goes to ``ended_by``. In the compiler it ends the process at once, see ``ends_while_compiling``. Does
    nothing where the process is not the command's own, or something else handles or ignores the signal.
    """
    main = own_process and current_thread() is main_thread()
    heard = [number for number in _ENDING if main and signal.getsignal(number) is signal.SIG_DFL]

    def stop(number: int, frame: FrameType | None) -> None:
        ended_by.append(number)
        signal.signal(number, signal.SIG_DFL)
        if _in_compiler(frame):
            signal.raise_signal(number)
        raise KeyboardInterrupt

    for number in heard:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number in heard:
            signal.signal(number, signal.SIG_DFL)


@contextmanager
def ends_while_compiling(message: str, own_process: bool) -> Iterator[None]:
    """A context in which Ctrl-C in the compiler prints ``message`` and ends the process; elsewhere it raises as always.

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
            # Not by print, which may itself be interrupted; and below a progress bar and the terminal's ^C.
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
