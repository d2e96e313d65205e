"""trimesh's own tests, from a checkout of its repository, with the drop-in installed: passed, failed and skipped.

    python -m validation.conformance /path/to/trimesh

The wheel of trimesh has no tests, and its sdist lacks the module and the models that they load, so it takes a checkout.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from renderer.trimesh_ray import installed

# What the drop-in stands for: rays, and what trimesh asks by rays or nearest points.
FILES = (
    "test_ray.py",
    "test_ray_upstream.py",
    "test_proximity.py",
    "test_thickness.py",
    "test_sample.py",
    "test_voxel.py",
)
# Tests that ask for another answer than the exact one, and why.
KNOWN = {
    "test_returns_correct_point_in_ambiguous_cases": "it asks for a face that is 1e-9 farther than the nearest one",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the tests; returns 0 where all pass but those in ``KNOWN``, 1 where others fail, 2 where there are none."""
    parser = argparse.ArgumentParser(prog="python -m validation.conformance", description=__doc__)
    parser.add_argument("trimesh", type=Path, help="a checkout of trimesh's repository")
    folder = parser.parse_args(arguments).trimesh / "tests"
    paths = [folder / name for name in FILES]
    missing = [str(path) for path in (*paths, folder / "generic.py") if not path.is_file()]
    if missing:
        print(f"conformance: expected a checkout of trimesh's repository, got none: {missing[0]}", file=sys.stderr)
        return 2
    outcomes = run(paths)
    known = [name for name in outcomes["failed"] if _test(name) in KNOWN]
    for name in outcomes["failed"]:
        print(f"failed: {name}{f' (known: {KNOWN[_test(name)]})' if name in known else ''}")
    print(
        ", ".join(f"{len(names)} {outcome}" for outcome, names in outcomes.items()) + f"; {len(known)} failures known"
    )
    return int(len(outcomes["failed"]) > len(known))


def run(paths: Sequence[Path]) -> dict[str, list[str]]:
    """The names of the tests that passed, failed and were skipped; a file that cannot be imported counts as failed."""
    import pytest  # only this command and the tests need it

    outcomes: dict[str, list[str]] = {"passed": [], "failed": [], "skipped": []}

    class Collector:
        def pytest_runtest_logreport(self, report: Any) -> None:
            if report.when == "call" or not report.passed:
                outcomes[report.outcome].append(report.nodeid)

        def pytest_collectreport(self, report: Any) -> None:
            if not report.passed:
                outcomes[report.outcome].append(report.nodeid)

    root = paths[0].parents[1]
    # Without the settings of the checkout, which may ask for plugins that are not there.
    options = [
        "-q",
        "--continue-on-collection-errors",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:dash",
        "-c",
        os.devnull,
        f"--rootdir={root}",
    ]
    with installed(proximity=True):
        pytest.main([*options, *map(str, paths)], plugins=[Collector()])
    return outcomes


def _test(name: str) -> str:
    return name.rpartition("::")[2].partition("[")[0]


if __name__ == "__main__":
    sys.exit(main())
