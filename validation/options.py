"""The options of ``octree-validate``, and its exit codes.

Exit codes:
  0    every gate holds
  1    a gate fails, or nothing was judged
  2    a bad argument, a bad file (scene, mesh, thresholds, baseline, a record), a missing reference, or a process
       that was ended from outside
  130  Ctrl-C; the report that was there before is untouched
"""

import argparse
import sys
from pathlib import Path

from validation.output import add_output
from validation.sections import NAMES


def program() -> str:
    """The command as it was given."""
    return "octree-validate" if Path(sys.argv[0]).stem == "octree-validate" else "python -m validation"


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=program(),
        description="Judge hits and pictures by references that nobody here wrote; write a report.",
        epilog=(__doc__ or "").partition("\n\n")[2],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="fewer rays and smaller pictures, a minute and a half")
    parser.add_argument("--only", type=_sections, default=NAMES, metavar="A,B", help=f"of {', '.join(NAMES)}")
    add_output(parser, "folder of the report")
    parser.add_argument("--gate", type=Path, metavar="FILE", help="TOML file that moves thresholds")
    for name, section in (("scene", "images"), ("mesh", "hits")):
        parser.add_argument(
            f"--{name}", type=Path, action="append", default=[], metavar="FILE",
            help=f"judge this {name} and not the suite's own, in the section {section}; may be given again",
        )  # fmt: skip
    parser.add_argument(
        "--random", type=_seed, metavar="SEED",
        help="draw the scenes and meshes of the section random from this seed; default: 1",
    )  # fmt: skip
    parser.add_argument("--defects", action="store_true", help="only inject the seeded defects, about half an hour")
    parser.add_argument("--write-baseline", action="store_true", help="make the stored whole run the baseline")
    return parser


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"expected an integer from 0, got {text!r}")
    return int(text)


def _sections(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        raise argparse.ArgumentTypeError(f"expected some of {', '.join(NAMES)}, got {unknown[0]!r}")
    return names
