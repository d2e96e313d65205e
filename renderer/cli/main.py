"""The command line: arguments in, calls to the library, one line and exit code 2 for anything wrong."""

import argparse
import logging
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from renderer import __version__
from renderer.collector import resting
from renderer.system.interrupt import interruptible
from renderer.system.terminal import flush_output, give_up_output, one_line, spell_everything

with resting():
    from renderer.cli.compiling import add_compile, choose_processor
    from renderer.cli.info import add_info
    from renderer.cli.once import Parser
    from renderer.cli.radiosity import add_radiosity
    from renderer.cli.render import add_render
    from renderer.cli.study import add_study
    from renderer.cli.view import add_view


@interruptible("octree-render: interrupted")
def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``octree-render``; returns the exit code: 0, 2 for bad input, 130 after Ctrl-C."""
    options = make_parser().parse_args(arguments)
    try:
        if getattr(options, "level", None):
            choose_processor(options.level, options.output)
        if arguments is None:
            spell_everything()
            _hide_scipy_from_numba()
        with compile_notices(getattr(options, "quiet", False)), _short_warnings():
            options.command(options)
        flush_output()
    except BrokenPipeError:
        # The reader of standard output, such as ``| head``, has closed it. The picture is written.
        give_up_output()
    except (ValueError, OSError, ImportError, MemoryError) as error:
        kind = "not enough memory" if isinstance(error, MemoryError) else ""
        print(": ".join(filter(None, ("octree-render", kind, _without_none(one_line(error))))), file=sys.stderr)
        return 2
    return 0


def _without_none(message: str) -> str:
    """A message about an argument, in the words of a command line, where nothing is called None."""
    return re.sub(r",? or None(?=, got )", "", message).replace(": expected None ", ": expected none ")


def _hide_scipy_from_numba() -> None:
    """Keep Numba from importing SciPy, which no kernel calls.

    The import takes time, and where memory is scarce its OpenBLAS waits for ever and ignores signals.
    """
    if "scipy" not in sys.modules:
        sys.modules["scipy"] = None  # type: ignore[assignment]  # so the import statement finds none
        # The second is imported with kernels that are loaded from disk.
        with resting():
            import numba
            import numba.np.arraymath  # noqa: F401

        del sys.modules["scipy"]


@contextmanager
def compile_notices(silent: bool) -> Iterator[None]:
    """Print the notices of compilation on standard error."""
    log, notices = logging.getLogger("renderer.jit"), _Notices()
    level, propagate = log.level, log.propagate
    log.addHandler(notices)
    log.propagate = False
    log.setLevel(logging.ERROR if silent else logging.WARNING)
    try:
        yield
    finally:
        log.removeHandler(notices)
        log.propagate = propagate
        log.setLevel(level)


@contextmanager
def _short_warnings() -> Iterator[None]:
    """Warnings as one line each, without the place in the source that they come from."""
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_place: print(f"octree-render: {one_line(message)}", file=sys.stderr)
        yield


class _Notices(logging.Handler):
    """Log lines on standard error, above a progress bar that may stand there."""

    def emit(self, record: logging.LogRecord) -> None:
        from tqdm import tqdm

        tqdm.write(f"octree-render: {record.getMessage().removeprefix('renderer: ')}", file=sys.stderr)


def make_parser() -> argparse.ArgumentParser:
    """The parser of all commands, each of which sets ``command``, the function that runs it."""
    parser = Parser(prog="octree-render", description="Octree ray tracer for triangle meshes.")
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="command")
    for add in (add_render, add_info, add_view, add_study, add_radiosity, add_compile):
        add(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
