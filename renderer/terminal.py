"""Whether anybody watches."""

import sys


def on_terminal() -> bool:
    """Whether standard error is a terminal; it may be closed, too, or replaced."""
    return sys.stderr is not None and sys.stderr.isatty()
