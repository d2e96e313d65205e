"""Where the suite and the benchmark write: ``reports`` in a checkout of this project, elsewhere only where asked to."""

import argparse
from pathlib import Path

_CHECKOUT = Path(__file__).resolve().parent.parent


def add_output(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the option ``--output``."""
    default = "default: reports, in a checkout of octree-renderer; needed elsewhere"
    parser.add_argument("--output", type=Path, metavar="DIR", help=f"{what} ({default})")


def check_output(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Fill the option in, or end with exit code 2 where nobody asked for files in this folder."""
    if options.output is None:
        if Path.cwd().resolve() != _CHECKOUT:
            parser.error("--output: expected a folder, as this one is no checkout of octree-renderer, got none")
        options.output = Path("reports")
