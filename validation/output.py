"""The output folder of suite and benchmark: ``reports`` in a checkout of this project; elsewhere it must be given."""

import argparse
from pathlib import Path

_CHECKOUT = Path(__file__).resolve().parent.parent


def add_output(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the option ``--output``."""
    default = "default: reports, in a checkout of octree-renderer; needed elsewhere"
    parser.add_argument("--output", type=Path, metavar="DIR", help=f"{what} ({default})")


def check_output(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Set the default of ``--output`` in a checkout; elsewhere exit with code 2 if the option is missing."""
    if options.output is None:
        if Path.cwd().resolve() != _CHECKOUT:
            parser.error("--output: expected a folder, as this one is no checkout of octree-renderer, got none")
        options.output = Path("reports")
