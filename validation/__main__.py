"""``octree-validate``: judge hits and pictures, write the report, exit 1 when a gate fails.

``python -m validation`` does the same in a checkout: Python prefers a folder ``validation`` in the current folder.

Exit codes:
  0    every gate holds
  1    a gate fails, or nothing was judged
  2    a bad argument, a bad file (scene, mesh, thresholds, baseline, a record), a missing reference, or a process
       that was ended from outside
  130  Ctrl-C; the report that was there before is untouched
"""

import argparse
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from renderer.errors import extra_hint
from renderer.system.interrupt import interruptible
from renderer.system.terminal import one_line
from validation.output import add_output, check_output
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
        return _run(options, f"{_program()} {shlex.join(given)}".strip())
    except (ImportError, ValueError, OSError) as error:
        missing = f"; {extra_hint('validate')}" if isinstance(error, ImportError) else ""
        print(f"validation: {one_line(error)}{missing}", file=sys.stderr)
        return 2


def _program() -> str:
    """The command as it was given."""
    return "octree-validate" if Path(sys.argv[0]).stem == "octree-validate" else "python -m validation"


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=_program(),
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
