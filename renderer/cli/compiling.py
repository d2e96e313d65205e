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
        help="compile kernels now, for CI, container images and folders that travel",
        description="Compile kernels now, so that no later run of these versions has to.",
        epilog=f"A folder made with -o is found by {AHEAD_VARIABLE}=FOLDER, and never written by a run.",
    )
    what = ahead.add_mutually_exclusive_group()
    for name, does in (
        ("queries", "what an Octree and a BruteForce call"),
        ("pictures", "the same, and what renders pictures"),
        ("all", "the same, and what the viewer calls; the default"),
    ):
        what.add_argument(f"--{name}", dest="what", action="store_const", const=name, help=does)
    ahead.add_argument("--level", choices=LEVELS, help="for any processor of a level, not this machine's; needs -o")
    ahead.add_argument("-o", "--output", type=Path, metavar="FOLDER", help="keep them there and not in the usual cache")
    ahead.add_argument("--quiet", action="store_true", help="no progress bar and no word at the end")
    ahead.set_defaults(command=_compile, what="all")


def _compile(options: argparse.Namespace) -> None:
    from tqdm import tqdm

    from renderer.jit.cache import lost, stored_in
    from renderer.jit.notice import compile_seconds
    from renderer.precompile import PARTS, compile_ahead, compile_into

    if options.output is not None:
        compile_into(options.output)
    visible = not options.quiet and on_terminal()
    with tqdm(total=len(PARTS[options.what]), unit="part", leave=False, disable=not visible) as bar:

        def began(name: str) -> None:
            bar.set_description(name)
            bar.update()

        compile_ahead(options.what, began)
    if lost():
        raise OSError(f"{lost()} kernels were compiled but could not be kept: {options.output or 'no cache folder'}")
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
