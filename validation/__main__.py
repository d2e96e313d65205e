"""``octree-validate``: judge hits and pictures, or compare hits with recorded ones; exit 1 when a gate fails.

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
from validation.sections import choose

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


# The options that do another thing than a run, and those that go with them.
_MODES = {
    "--defects": ("--output", "--quick"),
    "--write-baseline": ("--output",),
    "--record": ("MESH",),
    "--compare": ("MESH", "--tolerance", "--output"),
}


def _check(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Exit with code 2 where arguments are missing or contradict each other."""
    _check_mode(parser, options)
    options.mesh = [*options.mesh, *options.meshes]
    if options.record or options.compare:
        return
    check_output(parser, options)
    kinds = {kind for kind in ("scene", "mesh") if getattr(options, kind)}
    chosen, left_out = choose(options.only, kinds)
    if not chosen:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in left_out.items())
        parser.error(f"no section is left to run ({reasons})")
    if options.random is not None and "random" in left_out:
        parser.error(f"--random: the section random does not run: {left_out['random']}")


def _check_mode(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    given = [
        action.option_strings[0] if action.option_strings else str(action.metavar)
        for action in parser._actions
        if getattr(options, action.dest, action.default) != action.default
    ]
    mode = next((mode for mode in _MODES if mode in given), None)
    if mode is None:
        if "--tolerance" in given:
            parser.error("--tolerance goes with --compare, got none")
        return
    for other in given:
        if other not in (mode, *_MODES[mode]):
            parser.error(f"{mode} goes with {' and '.join(_MODES[mode])} alone, got {other} too")
    count = len(options.meshes)
    if count > 1 or (mode == "--record" and not count):
        expected = "one mesh" if mode == "--record" else "at most one mesh"
        parser.error(f"{mode}: expected {expected} after the file, got {count}")


def _run(options: argparse.Namespace, command: str) -> int:
    # Imported here: --help and argument errors need no heavy import, and a missing reference becomes a one-line error.
    if options.record or options.compare:
        return _recorded(options)
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


def _recorded(options: argparse.Namespace) -> int:
    from validation.recorded import command

    if options.record:
        return command.record(options.record, *options.meshes)
    mesh = options.meshes[0] if options.meshes else None
    return command.compare_with(options.compare, mesh, options.tolerance or 0.0, options.output)


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
