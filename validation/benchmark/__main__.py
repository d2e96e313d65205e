"""``python -m validation.benchmark``: measure, write ``benchmark.json`` and ``benchmark.html``, print the ratios.

Exit codes: 0 measured, 2 bad arguments or a missing mesh, 130 after Ctrl-C. Nothing has a gate, because speed on a
shared machine proves nothing.
"""

import argparse
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from renderer.errors import extra_hint
from renderer.system.interrupt import interruptible
from renderer.system.terminal import one_line
from validation.benchmark.limited import limited, run_limited
from validation.output import add_output, check_output

# Rays or points of a family, in full and in quick runs.
RAYS, QUICK_RAYS = 1_000_000, 200_000


@interruptible("benchmark: interrupted, nothing written")
def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    parser = make_parser()
    options = parser.parse_args(arguments)
    check_output(parser, options)
    given = sys.argv[1:] if arguments is None else list(arguments)
    if options.avx2 and not limited():
        return run_limited(given)
    try:
        return _run(options, ("python -m validation.benchmark " + shlex.join(given)).strip())
    except (ValueError, OSError, ImportError) as error:
        missing = f"; {extra_hint('validate')}" if isinstance(error, ImportError) else ""
        print(f"benchmark: {one_line(error)}{missing}", file=sys.stderr)
        return 2


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark", description="Measure speed beside others.")
    parser.add_argument("--quick", action="store_true", help="200,000 rays, at most 100,000 faces, small pictures")
    parser.add_argument("--huge", action="store_true", help="a mesh of 10 million faces too")
    parser.add_argument("--mesh", type=Path, nargs="+", default=[], metavar="PATH", help="PLY, OBJ, STL or GLB as well")
    parser.add_argument("--avx2", action="store_true", help="our kernels use no more than AVX2")
    add_output(parser, "where record and page go")
    parser.add_argument("--page-only", action="store_true", help="draw the page again from the stored record")
    return parser


def _run(options: argparse.Namespace, command: str) -> int:
    # Imported here, so that --help does not wait for it.
    from renderer.system.files import check_writable, write_atomically
    from validation.benchmark.page import page, record
    from validation.progress import steps

    options.output.mkdir(parents=True, exist_ok=True)
    stored, drawn = options.output / "benchmark.json", options.output / "benchmark.html"
    # Tried and read first, so that a fault shows before an hour of measuring.
    for output in (drawn,) if options.page_only else (stored, drawn):
        check_writable(output)
    if not options.page_only:
        missing = [path for path in options.mesh if not path.is_file()]
        if missing:
            raise ValueError(f"--mesh: expected a file, got {str(missing[0])!r}")
        with steps() as step:
            measured = measure(options.quick, options.huge, tuple(options.mesh), command, step)
        record.write(measured, stored)
    text = record.read(stored)
    page_text = page.html(text)
    write_atomically(drawn, lambda file: file.write(page_text.encode()))
    print(page.ratios(text))
    print(f"benchmark: {text['seconds']:.0f} s; see {drawn}")
    return 0


def measure(
    quick: bool, huge: bool, paths: tuple[Path, ...], command: str, step: Callable[[str], None]
) -> dict[str, Any]:
    """The whole record; see ``validation.benchmark.page.record``."""
    from validation.benchmark.measures import (
        calls,
        drop_in,
        first_answers,
        frames,
        meshes,
        processes,
        scenes,
        studies,
        tree_options,
    )
    from validation.benchmark.page import record, targets
    from validation.benchmark.peers.systems import available

    began, date, load = time.perf_counter(), datetime.now(UTC), record.load()
    step("contenders")
    systems, missing = available()
    names = {system.name for system in systems}
    kinds: dict[str, str] = {}
    rows: dict[str, list[Any]] = {"queries": [], "builds": [], "memory": []}
    open_edges: dict[str, int] = {}
    for chosen in meshes.chosen(quick, huge, paths):
        mesh, kinds[chosen.mesh.name] = chosen.mesh, chosen.kind
        _measure_mesh(chosen, systems, QUICK_RAYS if quick else RAYS, rows, step)
        open_edges |= {mesh.name: len(mesh.open_edges)} if not chosen.brief and len(mesh.open_edges) else {}
    series = [name for name, kind in kinds.items() if kind == meshes.SERIES]
    llvm = "mitsuba_llvm" in names
    found: dict[str, Any] = {
        "schema": record.SCHEMA, "command": command, "date": date.isoformat(timespec="seconds"),
        "commit": record.commit(), "quick": quick, "environment": record.describe(_libllvm(llvm), load),
        "systems": record.described(systems), "missing": missing, "series": series, "kinds": kinds,
        "open_edges": open_edges, **rows,
        "drop_in": drop_in.run(quick, step), "calls": calls.measure(systems, step), "studies": studies.run(quick, step),
        "scenes": scenes.measure(quick, llvm, step),
        "frames": frames.measure(quick, llvm, "mitsuba_scalar" in names, step),
        "processes": processes.measure(llvm, names, step),
        "first_answers": first_answers.measure(step),
        "trees": tree_options.run(quick, step),
    }  # fmt: skip
    return found | {"targets": targets.judged(found), "seconds": time.perf_counter() - began}


def _measure_mesh(
    chosen: Any, systems: Sequence[Any], count: int, rows: dict[str, list[Any]], step: Callable[[str], None]
) -> None:
    """Add one mesh's rows, memory first, while this process is small."""
    from validation.benchmark.measures import builds, memory, queries

    mesh = chosen.mesh
    grown = memory.measure(mesh, systems, step)
    rows["memory"] += [grown] if grown is not None else []
    rows["builds"].append(builds.measure(mesh, systems, step))
    rows["queries"] += queries.measure(mesh, systems, count, step, brief=chosen.brief)


def _libllvm(used: bool) -> str | None:
    if not used:
        return None
    from validation.benchmark.peers.mitsuba_variant import libllvm_path

    return libllvm_path()


if __name__ == "__main__":
    sys.exit(main())
