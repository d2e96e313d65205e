"""The streams of a command's own process: whether anybody watches, and words that they cannot spell or should not."""

import sys
from io import TextIOWrapper


def on_terminal() -> bool:
    """Whether standard error is a terminal; it may be closed, too, or replaced."""
    return sys.stderr is not None and sys.stderr.isatty()


def spell_everything() -> None:
    """Let standard output write what its encoding lacks, as an accent in a path, by escapes: an error otherwise."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def one_line(error: Exception) -> str:
    """An error's words without what a terminal obeys: they may quote a file."""
    words = " ".join(str(error).split())
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)
