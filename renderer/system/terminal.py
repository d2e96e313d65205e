"""The standard streams of a command's own process: terminals, and characters that they cannot or should not print."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import TextIOWrapper


def on_terminal() -> bool:
    """Whether standard error is a terminal; it may also be closed or replaced."""
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def progress_bar(count: int, unit: str, progress: bool) -> Iterator[Callable[[int], object] | None]:
    """The function to call with the number of units done, or None without a terminal.

    None, not a hidden bar, because all bars share a lock that Ctrl-C may leave locked for ever.
    """
    if not (progress and on_terminal()):
        yield None
        return
    from tqdm import tqdm  # only a bar needs it

    with tqdm(total=count, unit=unit, leave=False) as bar:
        yield bar.update


def spell_everything() -> None:
    """Make standard output escape characters that its encoding lacks, such as accents in a path, instead of raising."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def say(line: str, *, flush: bool = False) -> None:
    """Print a line on standard output. Raises ``OSError`` naming it, for instance on a full disk."""
    with _naming_output():
        print(line, flush=flush)


def give_up_output() -> None:
    """Discard pending output: at the end of the process writing it would fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def flush_output() -> None:
    """Write out what was said; see ``say``."""
    with _naming_output():
        if sys.stdout is not None:
            sys.stdout.flush()


@contextmanager
def _naming_output() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        give_up_output()
        raise OSError(error.errno, error.strerror, "standard output") from None


def one_line(error: Exception) -> str:
    """An error's message on one line, control characters escaped: it may quote a file."""
    words = " ".join(str(error).split())
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)
