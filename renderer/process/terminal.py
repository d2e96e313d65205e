"""The standard streams of a command's own process: terminals, and characters that they cannot or should not print."""

import sys
from io import TextIOWrapper


def on_terminal() -> bool:
    """Whether standard error is a terminal; it may be closed, too, or replaced."""
    return sys.stderr is not None and sys.stderr.isatty()


def spell_everything() -> None:
    """Let standard output escape characters that its encoding lacks, as an accent in a path, where it would raise."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def one_line(error: Exception) -> str:
    """An error's message on one line, control characters escaped: it may quote a file."""
    words = " ".join(str(error).split())
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)
