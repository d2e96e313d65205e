"""The tables of ``docs/guides/cluster.md``, from the record: ``python -m validation.benchmark.scaling.tables``."""

import statistics
import sys
from collections.abc import Mapping
from typing import Any

from validation.benchmark.scaling import arithmetic
from validation.benchmark.scaling.figures import Figures, figures_of, hops, read
from validation.benchmark.scaling.simulation import simulate

POINTS, WORKERS = (1_000_000, 100_000_000), (1, 10, 100, 1000)
# Part sizes whose driver is asked how many workers it feeds.
_SIZES = (4096, 32_768, 131_072)
# A worker pays where it does at least half of what a thread alone does.
PAYS = 0.5


def made(record: Mapping[str, Any]) -> str:
    """Where, when and of what the record is."""
    at = record["environment"]
    return (f"On {at['threads']} processors ({at['processor']}), {record['date'][:10]}, a load of {record['load']:.2f} "
            f"before it:\n`{record['mesh']}` with {record['faces']:,} faces, sky view factor of {record['points']:,} "
            f"points in {record['directions']} directions,\nparts of {record['size']:,} points.")  # fmt: skip


def measured(record: Mapping[str, Any]) -> str:
    """What was measured, medians and ranges."""
    seconds = record["seconds"]
    of = {name: statistics.median(values) for name, values in seconds.items()}

    def row(said: str, one: str, two: str) -> str:
        cells = (f"{of[n]:.2f} ({min(seconds[n]):.2f} to {max(seconds[n]):.2f})" for n in (one, two))
        return f"| {said} | {' | '.join(cells)} |"

    lines = ["| seconds, medians of five and their ranges | one | two |", "|---|---|---|",
             row("threads of one process, one call", "call_1", "call_2"),
             row("threads of one process, in parts on disk", "run_1", "run_2"),
             row("workers of one thread that have the tree", "workers_1", "workers_2"),
             row("workers that build the tree first", "built_1", "built_2"),
             row("the tree alone, by threads", "tree_1", "tree_2"),
             f"| the mesh, {record['bytes'] / 1e6:.1f} MB, to one worker, to two | "
             f"{of['send_1']:.3f} | {of['send_2']:.3f} |"]  # fmt: skip
    return "\n".join(lines)


def ratios(record: Mapping[str, Any]) -> str:
    """Efficiencies, and what a task and a part cost."""
    of, f = {name: statistics.median(values) for name, values in record["seconds"].items()}, figures_of(record)
    size, each = record["size"], record["size"] * f.point + f.part
    beside, driver = f.worker + f.worker_point * size, f.driving(size)
    lines = ["| what | figure |", "|---|---|",
             f"| two workers over two threads in parts, tree there | {of['run_2'] / of['workers_2']:.3f} |",
             f"| two workers over two threads in one call, tree there | {of['call_2'] / of['workers_2']:.3f} |",
             f"| two workers over two threads in parts, tree included | "
             f"{(of['run_2'] + of['tree_2']) / of['built_2']:.3f} |",
             f"| two workers over twice one worker, tree there | {of['workers_1'] / (2 * of['workers_2']):.3f} |",
             f"| an empty task, there and back | {1e3 * record['task']:.1f} ms |",
             f"| empty tasks at once | {record['rate']:.0f} a second |",
             f"| a part of {size:,} points: computing | {1e3 * each:.0f} ms |",
             f"| besides, on the worker / on driver and scheduler | {1e3 * beside:.1f} / {1e3 * driver:.1f} ms |",
             f"| building the tree on one thread over sending the mesh to two workers | "
             f"{of['tree_1'] / of['send_2']:.1f} times |"]  # fmt: skip
    return "\n".join(lines)


def scaling(f: Figures) -> str:
    """Seconds on more workers, by arithmetic and by simulation."""
    heads = ("points", "workers", "points a part", "seconds, arithmetic", "simulated", "efficiency", "what holds")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for points in POINTS:
        for workers in WORKERS:
            size, found = arithmetic.best(f, points, workers)
            share = arithmetic.efficiency(f, points, workers, found.seconds)
            lines.append(
                f"| {points:.0e} | {workers:,} | {size:,} | {found.seconds:.1f} | "
                f"{simulate(f, points, workers, size):.1f} | {share:.2f} | {held(found)} |".replace("e+0", "e")
            )
    return "\n".join(lines)


def held(found: arithmetic.Estimate) -> str:
    """What takes most of the time."""
    of = {"before and behind the parts": found.before + found.behind, "workers": found.workers,
          "driver": found.driver}  # fmt: skip
    return max(of, key=lambda name: of[name])


def paying(f: Figures, points: int) -> int:
    """The most workers, within a twentieth, that each do at least half of what a thread alone does."""
    workers = more = 1
    while arithmetic.efficiency(f, points, more, arithmetic.best(f, points, more)[1].seconds) >= PAYS:
        workers, more = more, max(more + 1, int(more * 1.05))
    return workers


def limits(f: Figures) -> str:
    """Where it stops to pay, and how many workers one driver feeds."""
    lines = [f"| efficiency of a half or more, {points:.0e} points | up to {paying(f, points)} workers |"
             for points in POINTS]  # fmt: skip
    lines += [f"| one driver feeds, parts of {size:,} points | {arithmetic.fed(f, size)} workers |" for size in _SIZES]
    lines.append(f"| the mesh reaches 1,000 workers, {hops(1000)} hops | {hops(1000) * f.send:.2f} s |")
    return "\n".join(["| limit | figure |", "|---|---|", *lines]).replace("e+0", "e")


def tables(record: Mapping[str, Any]) -> list[str]:
    """All that the page has of the record, in its order."""
    f = figures_of(record)
    return [made(record), measured(record), ratios(record), scaling(f), limits(f)]


def main() -> int:
    """Print them."""
    print("\n\n".join(tables(read())))
    return 0


if __name__ == "__main__":
    sys.exit(main())
