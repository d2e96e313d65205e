"""``octree-validate``: judge hits and pictures, write the report, exit 1 when a gate fails.

``python -m validation`` does the same in a checkout: Python prefers a folder ``validation`` in the current folder.
"""

import argparse
import shlex
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from renderer.errors import extra_hint
from renderer.system.interrupt import interruptible
from renderer.system.terminal import one_line
from validation.options import make_parser, program
from validation.output import check_output
from validation.sections import NAMES, choose

if TYPE_CHECKING:
    from validation.gates import Gate
    from validation.suite import Request


@interruptible("validation: interrupted, no report written")
def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    parser = make_parser()
    options = parser.parse_args(arguments)
    _check(parser, options)
    given = sys.argv[1:] if arguments is None else list(arguments)
    try:
        return _run(options, f"{program()} {shlex.join(given)}".strip())
    except (ImportError, ValueError, OSError) as error:
        missing = f"; {extra_hint('validate')}" if isinstance(error, ImportError) else ""
        print(f"validation: {one_line(error)}{missing}", file=sys.stderr)
        return 2


def _check(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Exit with code 2 where arguments are missing or contradict each other."""
    check_output(parser, options)
    kinds = {kind for kind in ("scene", "mesh") if getattr(options, kind)}
    modes = {"--defects": options.defects, "--write-baseline": options.write_baseline}
    given = [mode for mode, value in modes.items() if value]
    if given:
        alone = given[0]
        others = [f"--{kind}" for kind in sorted(kinds)] + ["--gate"] * (options.gate is not None)
        others += ["--only"] * (options.only != NAMES) + ["--random"] * (options.random is not None) + given[1:]
        others += ["--quick"] * (options.quick and not options.defects)
        if others:
            fitting = "--output and --quick" if options.defects else "--output"
            parser.error(f"{alone} goes with {fitting} alone, got {others[0]} too")
    chosen, left_out = choose(options.only, kinds)
    if not chosen:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in left_out.items())
        parser.error(f"no section is left to run ({reasons})")
    if options.random is not None and "random" in left_out:
        parser.error(f"--random is of the section random, which does not run: {left_out['random']}")


def _run(options: argparse.Namespace, command: str) -> int:
    # Imported here: --help and argument errors need no heavy import, and a missing reference becomes a one-line error.
    from validation import suite

    if options.write_baseline:
        print(f"validation: wrote {suite.write_baseline(options.output)}")
        return 0
    request = suite.Request(
        command,
        options.quick,
        options.only,
        options.output,
        options.gate,
        tuple(options.scene),
        tuple(options.mesh),
        1 if options.random is None else options.random,
    )
    if options.defects:
        return _defects_verdict(suite.run_defects(request), request)
    return _verdict(suite.run(request), request)


def _verdict(metrics: Mapping[str, Any], request: "Request") -> int:
    """Print the failing gates and a one-line summary; returns the exit code."""
    _print_failures(metrics["gates"])
    passed, gates, failed = (metrics["verdict"][key] for key in ("passed", "gates", "failed"))
    count = f"{gates - failed} of {gates} gates" if gates else "nothing judged"
    against = ""
    if "absent" not in metrics["baseline"]:
        better, worse = (len(metrics["baseline"][key]) for key in ("better", "worse"))
        against = f"; better {better}, worse {worse} than baseline"
    state, page = "PASS" if passed else "FAIL", request.output / "index.html"
    print(f"validation: {state}, {count} in {metrics['seconds']:.0f} s{against}; see {page}")
    return 0 if passed else 1


def _defects_verdict(gates: Sequence["Gate"], request: "Request") -> int:
    """As ``_verdict``, for the gates of a run of the seeded defects."""
    from validation import suite

    _print_failures([gate.record() for gate in gates])
    state = "PASS" if gates and all(gate.passed for gate in gates) else "FAIL"
    stored = suite.stored_defects(request.output) or {"caught": 0, "defects": []}
    count = f"{stored['caught']} of {len(stored['defects'])} seeded defects caught"
    print(f"validation: {state}, {count}; see {request.output / 'defects.json'}")
    return int(state == "FAIL")


def _print_failures(gates: Sequence[Mapping[str, Any]]) -> None:
    from validation.report import summary

    for gate in gates:
        if not gate["passed"]:
            print(f"FAILED {gate['section']}: {gate['subject']}: {summary.failure(gate)}")


if __name__ == "__main__":
    sys.exit(main())
