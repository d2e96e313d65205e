"""``python -m validation``: run the checks, write ``metrics.json`` and ``index.html``, exit 1 when a gate fails.

Exit codes: 0 all gates hold, 1 at least one fails, 2 bad arguments or a missing reference, 130 after Ctrl-C.
"""

import argparse
import json
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

SECTIONS = ("hits", "images", "stability", "efficiency")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the arguments ask for; returns the exit code."""
    options = _parser().parse_args(arguments)
    given = sys.argv[1:] if arguments is None else list(arguments)
    try:
        return _run(options, "python -m validation " + shlex.join(given))
    except KeyboardInterrupt:
        print("validation: interrupted, no report written", file=sys.stderr)
        return 130
    except (ImportError, ValueError, OSError) as error:
        missing = "; pip install 'octree-renderer[validate]'" if isinstance(error, ImportError) else ""
        print(f"validation: {error}{missing}", file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m validation", description="Check hits and pictures.")
    parser.add_argument("--quick", action="store_true", help="fewer rays and smaller pictures, under 3 minutes")
    parser.add_argument("--only", type=_sections, default=SECTIONS, metavar="A,B", help=f"of {', '.join(SECTIONS)}")
    parser.add_argument("--output", type=Path, default=Path("reports"), help="folder of the report")
    return parser


def _sections(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        raise argparse.ArgumentTypeError(f"expected some of {', '.join(SECTIONS)}, got {unknown[0]!r}")
    return names


def _run(options: argparse.Namespace, command: str) -> int:
    # Imported here so that --help and wrong arguments answer at once, and a missing reference becomes one line.
    from renderer.image import write_atomically
    from validation import environment, report
    from validation.gates import Gate

    pictures = options.output / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    began, started = time.perf_counter(), datetime.now(UTC)
    metrics: dict[str, Any] = {"schema": 1, "command": command.strip(), "quick": options.quick}
    gates: list[Gate] = []
    with _steps() as step:
        for section in SECTIONS:
            if section in options.only:
                section_began = time.perf_counter()
                record, found = _section(section, options.quick, pictures, step)
                metrics[section] = record | {"seconds": time.perf_counter() - section_began}
                gates += found
    metrics["started"] = started.isoformat(timespec="seconds")
    metrics["seconds"] = time.perf_counter() - began
    metrics["environment"] = environment.describe()
    metrics["gates"] = [gate.record() for gate in gates]
    text = json.dumps(metrics, indent=1, allow_nan=False)
    write_atomically(options.output / "metrics.json", lambda file: file.write(text.encode()))
    page = report.page(metrics, pictures)
    write_atomically(options.output / "index.html", lambda file: file.write(page.encode()))
    return _verdict(gates, options.output / "index.html", metrics["seconds"])


def _section(
    name: str, quick: bool, pictures: Path, step: Callable[[str], None]
) -> tuple[dict[str, Any], list[Any]]:
    """Run one section; the references it needs are imported with it."""
    if name == "hits":
        from validation import hits

        return hits.run(quick, step)
    if name == "images":
        from validation import images

        return images.run(quick, pictures, step)
    if name == "stability":
        from validation import numerical

        return numerical.run(quick, step)
    from validation import efficiency

    return efficiency.run(quick, step), []


class _steps:  # noqa: N801  # read as a function: with _steps() as step
    """A progress bar on a terminal that names the step; a line a step elsewhere."""

    def __enter__(self) -> Callable[[str], None]:
        from tqdm import tqdm

        self._bar = tqdm(bar_format="{n} steps, {elapsed}  {desc}", disable=not sys.stderr.isatty())
        return self._next

    def _next(self, name: str) -> None:
        self._bar.set_description_str(name)
        self._bar.update()
        if self._bar.disable:
            print(name, flush=True)

    def __exit__(self, *_: object) -> None:
        self._bar.close()


def _verdict(gates: Sequence[Any], page: Path, seconds: float) -> int:
    failed = [gate for gate in gates if not gate.passed]
    for gate in failed:
        print(f"FAILED {gate.subject}: {gate.quantity} is {gate.value:.6g}, expected {gate.bound} {gate.threshold:.6g}")
    state = f"{len(failed)} of {len(gates)} gates failed" if failed else f"all {len(gates)} gates hold"
    print(f"validation: {state} in {seconds:.0f} s; see {page}")
    return 1 if failed or not gates else 0


if __name__ == "__main__":
    sys.exit(main())
