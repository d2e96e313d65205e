"""``octree-render compile``: kernels compiled ahead, for this machine or for processors of a level."""

import argparse
import os
import platform
import sys
from pathlib import Path
from typing import Any

from renderer.errors import expect
from renderer.jit.levels import AHEAD_VARIABLE, LEVELS, lacking
from renderer.system.terminal import on_terminal, say


def add_compile(commands: Any) -> None:
    """Add the command to a parser's ``commands``."""
    ahead = commands.add_parser(
        "compile",
        help="compile all kernels now",
        description="Compile kernels now, so that later runs do not wait: for CI, container images and copied folders.",
        epilog=f"Runs with {AHEAD_VARIABLE}=FOLDER in the environment use the kernels of a folder made with -o.",
    )
    what = ahead.add_mutually_exclusive_group()
    for name, does in (
        ("queries", "kernels of Octree, BruteForce and studies"),
        ("pictures", "those, and kernels that render pictures"),
        ("all", "those, and kernels of the viewer (default)"),
    ):
        what.add_argument(f"--{name}", dest="what", action="store_const", const=name, help=does)
    ahead.add_argument("--level", choices=LEVELS, help="for all processors of this level; needs -o")
    ahead.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="write kernels to this folder, not to the cache"
    )
    ahead.add_argument("--quiet", action="store_true", help="no progress bar and no summary")
    ahead.set_defaults(command=_compile, what="all")


def _compile(options: argparse.Namespace) -> None:
    from tqdm import tqdm

    from renderer.jit.cache import lost, stored_in
    from renderer.jit.notice import compile_seconds
    from renderer.precompile import PARTS, compile_ahead_in_two, compile_into

    if options.output is not None:
        compile_into(options.output)
    visible = not options.quiet and on_terminal()
    with tqdm(total=len(PARTS[options.what]), unit="part", leave=False, disable=not visible) as bar:

        def began(name: str) -> None:
            bar.set_description(name)
            bar.update()

        compile_ahead_in_two(options.what, options.output, began)
    if lost():
        raise OSError(f"{lost()} kernels were compiled but could not be saved: {options.output or 'no cache folder'}")
    if not options.quiet:
        where = f"; {stored_in(options.output)} kernels in {options.output}" if options.output else ""
        say(f"compiled in {compile_seconds():.1f} s{where}")


def choose_processor(level: str, output: Path | None) -> None:
    """Let Numba, which reads the environment when it is imported, compile for a level."""
    expect(output is not None, "--output", "a folder, as kernels for a level are not this machine's", "none")
    own = platform.machine().lower()
    expect((own in ("aarch64", "arm64")) == (level == "aarch64"), "--level", f"one of this processor's, {own}", level)
    lacks = ", ".join(lacking(level))
    # Each kernel is compiled by a call.
    expect(not lacks, "--level", "one that this machine runs too", f"{level}, of which it lacks {lacks}")
    expect("numba" not in sys.modules, "--level", "a process that has not imported Numba yet", "one that has")
    os.environ["NUMBA_CPU_NAME"] = LEVELS[level]
    os.environ["NUMBA_CPU_FEATURES"] = ""
