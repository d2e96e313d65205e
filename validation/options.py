"""The options of ``octree-validate``, and its exit codes.

Exit codes:
  0    every gate holds; hits are as recorded
  1    a gate fails, or nothing was judged; hits differ from the record
  2    a bad argument, a bad file (scene, mesh, thresholds, baseline, a record), a missing reference, or a process
       that was killed
  130  Ctrl-C; the report that was there before is untouched
"""

import argparse
import math
import sys
from pathlib import Path

from validation.output import add_output
from validation.sections import NAMES


def program() -> str:
    """The name of the command."""
    return "octree-validate" if Path(sys.argv[0]).stem == "octree-validate" else "python -m validation"


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=program(),
        description="Judge hits and pictures by independent references and write a report; or compare the hits of a "
        "mesh with recorded ones.",
        epilog=(__doc__ or "").partition("\n\n")[2],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "meshes", type=Path, nargs="*", default=[], metavar="MESH",
        help="a mesh file to judge, as --mesh; the one to record or compare",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="fewer rays and smaller pictures; about two minutes")
    parser.add_argument(
        "--only", type=_sections, default=NAMES, metavar="A,B", help=f"run only these sections, of {', '.join(NAMES)}"
    )
    add_output(parser, "folder of the report")
    parser.add_argument("--gate", type=Path, metavar="FILE", help="TOML file that changes thresholds")
    for name, section in (("scene", "images"), ("mesh", "hits")):
        parser.add_argument(
            f"--{name}", type=Path, action="append", default=[], metavar="FILE",
            help=f"judge this {name} instead of the suite's own, in the section {section}; may be repeated",
        )  # fmt: skip
    parser.add_argument(
        "--random", type=_seed, metavar="SEED",
        help="seed of the section random; default: 1",
    )  # fmt: skip
    parser.add_argument("--defects", action="store_true", help="only inject the seeded defects; one to two hours")
    parser.add_argument("--write-baseline", action="store_true", help="make the stored whole run the baseline")
    parser.add_argument("--record", type=Path, metavar="FILE", help="write the hits of MESH to a file, about 100 kB")
    parser.add_argument(
        "--compare", type=Path, metavar="FILE",
        help="shoot the recorded rays at MESH, by default the recorded path; exit with 1 where hits differ. A picture "
        "of where they do and the numbers as JSON go to --output, by default beside FILE",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=_tolerance, metavar="SHARE",
        help="of --compare: how far a hit may move, as a share of the mesh's diagonal; default: 0, the same bits. The "
        "numbers of faces may differ, hits and misses may not",
    )  # fmt: skip
    return parser


def _tolerance(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number from 0, got {text!r}")
    return value


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
