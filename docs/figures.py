"""Write the figures of the pages and the chart from ``docs/figures.json``, so that none is older than another.

    python docs/figures.py                                    # PAGES, docs/drawings/chart.svg
    python docs/figures.py --record reports/metrics.json      # first take the figures of a run of make validate
    python docs/figures.py --record reports/benchmark.json    # or of make bench, on the machine that ran it

In a page ``<!-- figures: NAME RUN -->...<!-- /figures -->`` holds what ``BLOCKS[NAME]`` makes of a run of the record,
or of the whole record where RUN is left out.
"""

import argparse
import math
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from chart import chart  # noqa: E402
from record import Record, distilled, read, write  # noqa: E402

from validation.benchmark.page.heat import MEAN_FACES, geometric_mean  # noqa: E402

PAGES = tuple(
    ROOT / name for name in ("README.md", "docs/measured.md", "docs/measured-avx512.md", "docs/performance.md")
)
CHART = ROOT / "docs" / "drawings" / "chart.svg"
MARK = re.compile(r"(<!-- figures: (\w+)(?: ([\w -]+?))? -->)(.*?)(<!-- /figures -->)", re.DOTALL)
PEERS = {"embree": "embreex", "open3d": "Open3D", "mitsuba_llvm": "Mitsuba"}
KINDS = {("closest", name): name for name in ("camera", "shadow", "random", "bounce", "misses", "short")}
KINDS |= {("any", "shadow"): "shadow, any hit", ("any", "short"): "short, any hit"}
POINTS = {
    ("all", "random"): "all hits of random rays", ("count", "random"): "number of these hits",
    ("contains", "wide"): "inside, points of 1.2 times the box", ("nearest", "box"): "closest point, points of the box",
    ("nearest", "near"): "closest point, points near the surface",
    ("signed", "box"): "signed distance, points of the box",
}  # fmt: skip
PICTURES = {
    "ours": "octree-renderer", "mitsuba_llvm_lists": "Mitsuba llvm, the same rays",
    "mitsuba_llvm_path": "Mitsuba llvm, its path tracer", "mitsuba_scalar_recursion": "Mitsuba scalar, the same rays",
    "mitsuba_scalar_path": "Mitsuba scalar, its path tracer",
}  # fmt: skip
# Meshes of fewer faces are built in less than the clock's noise.
BUILD_FACES = 70_000


def times(ratio: float | None) -> str:
    """A ratio with two decimals; below 1 it is bold and does not read as 1.

    >>> times(1.234), times(0.999), times(None), times(24.31)
    ('1.23', '**0.99**', '–', '24')
    """
    if ratio is None:
        return "–"
    return f"**{min(ratio, 0.99):.2f}**" if ratio < 1.0 else f"{ratio:.2f}" if ratio < 9.995 else f"{ratio:.0f}"


def table(head: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n" + "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines) + "\n"


def runs(record: Record) -> str:
    """The origin of the figures."""
    rows = [(f"`{run['command']}`", run["machine"], run["commit"], run["date"], _or_dash(run["seconds"], 60, ".0f"),
             _or_dash(run["load"], 1, ".2f")) for run in record.values()]  # fmt: skip
    return table(("command", "machine", "commit", "date", "minutes", "load before"), rows)


def errors(run: Record) -> str:
    """Errors of ours and of others."""
    hits, leaks, inside = run["hits"], run["leaks"], run["inside"]
    rows = [
        ("rays with a wrong hit", f"{hits['wrong']} of {hits['rays']:,}", ""),
        ("rays that pass an edge closer than rounding, not counted", f"{hits['near_edge']:,}", ""),
        *((f"leaks of rays aimed at {name}", f"{of['ours']} of {of['rays']:,}", _others(of))
          for name, of in (("edges", leaks["edge"]), ("vertices", leaks["vertex"]))),
        ("leaks of meshes moved and scaled by up to 1e6", f"{run['moved']['ours']} of {run['moved']['rays']:,}", ""),
        *((f"points on the wrong side, {name}", f"{of['wrong']} of {of['asked']:,}",
           f"{_others(of['others'])}, of {of['beside']:,}")
          for name, of in (("random", inside["random"]), ("at corners, edges and faces", inside["nasty"]))),
        ("error of `t`, meshes moved by 1e2 to 1e9", run["ulp"].partition(",")[0], ""),
        ("extreme cases that hold", f"{run['cases']['hold']} of {run['cases']['all']}", ""),
        ("lowest SSIM, reflected rays start as Mitsuba's do", _floor(run["ssim"]["matched"]), ""),
        ("lowest SSIM, reflected rays start as ours do", _floor(run["ssim"]["own"]), ""),
        ("glass: RMSE of N random paths is N to the power", " / ".join(f"{s:.3f}" for s in run["slopes"]), ""),
        ("the largest mesh", run["huge"].rpartition(", 0 of")[0] or run["huge"], ""),
    ]  # fmt: skip
    return table(("what", "ours", "others"), rows)


def peers(record: Record) -> str:
    """For each peer the mean over all kinds of rays, how often it is faster, and where most."""
    rows = [(PEERS[of["peer"]], name.removeprefix("bench "), times(of["mean"]), f"{of['below']} of {of['cells']}",
             f"{times(of['least'])} ({of['where']})")
            for name, run in record.items() if "peers" in run for of in run["peers"]]  # fmt: skip
    return table(("other", "processor", "mean", "other is faster in", "least"), rows)


def rays(run: Record) -> str:
    """By kind of ray, geometric means of the larger meshes."""
    rows = []
    for (query, family), name in KINDS.items():
        of = [row for row in run["queries"] if (row["query"], row["family"]) == (query, family)]
        of = [row for row in of if row["faces"] >= MEAN_FACES]
        ratios = [geometric_mean(row["ratios"][peer] for row in of if peer in row["ratios"]) for peer in PEERS]
        rows.append((name, f"{geometric_mean(row['mrays']['ours'] for row in of):.1f}", *map(times, ratios)))
    return table(("rays", "ours, million/s", *(f"x {name}" for name in PEERS.values())), rows)


def cells(run: Record) -> str:
    """By mesh and kind of ray, beside embreex."""
    found = {(row["mesh"], row["query"], row["family"]): row["ratios"].get("embree") for row in run["queries"]}
    meshes = dict.fromkeys(mesh for mesh, _, _ in found)
    return table(
        ("mesh", *KINDS.values()), ((mesh, *(times(found.get((mesh, *of))) for of in KINDS)) for mesh in meshes)
    )


def points(run: Record) -> str:
    """Queries that are not first hits, by size of mesh."""
    found = {(row["mesh"], row["query"], row["family"]): row for row in run["queries"]}
    meshes = [mesh for (mesh, query, _), row in found.items() if query == "all" and row["faces"] >= MEAN_FACES]
    rows = []
    for kind, name in POINTS.items():
        of = [found[mesh, *kind] for mesh in meshes]
        ratios = (_listed(times(row["ratios"].get(p)) for row in of) for p in ("open3d", "trimesh_embreex", "libigl"))
        rows.append((name, _listed(f"{row['mrays']['ours']:.2g}" for row in of), *ratios))
    sizes = _listed(mesh.removeprefix("spheres_") for mesh in meshes)
    return table((f"spheres of {sizes} faces", "ours, million/s", "x Open3D", "x trimesh, embreex", "x libigl"), rows)


def builds(run: Record) -> str:
    """Builds, refits and memory of the larger meshes, mean and range; calls of few rays."""
    large = [row for row in run["builds"] if row["faces"] >= BUILD_FACES]
    names = {"build": "build", "refit": "refit, beside the other's build",
             "memory": "memory at rest, the other's over ours"}  # fmt: skip
    rows = [(name, *(_range([row[key][p] for row in large if p in row[key]]) for p in PEERS))
            for key, name in names.items() if any(row[key] for row in large)]  # fmt: skip
    rows += [(f"a call of {row['rays']}, ours {row['median']['ours']:.2g} us",
              *(times(row["ratios"].get(p)) for p in PEERS)) for row in run["calls"]]  # fmt: skip
    return table(("", *(f"x {name}" for name in PEERS.values())), rows)


def drop_in(run: Record) -> str:
    """Beside trimesh over embreex, by call and number of rays or points."""
    found = {(row["call"], row["faces"], row["rays"]): row["ratios"]["trimesh + embreex"] for row in run["drop_in"]}
    counts = sorted({count for _, _, count in found})
    rows = [(f"`{call}`", f"{faces:,}", *(times(found[call, faces, n]) for n in counts))
            for call, faces in dict.fromkeys(key[:2] for key in found)]  # fmt: skip
    return table(("call", "faces", *(f"{n:,}" for n in counts)), rows)


def threads(run: Record) -> str:
    """The speed of two threads over that of one, median of all queries."""
    of = [row["mrays"]["ours"] / row["mrays"]["ours_one_thread"] for row in run["queries"]]
    return f"{median(of):.2f}"


def frames(run: Record) -> str:
    of = run["frames"]
    rows = [(name, f"{of['seconds'][key]:.3f}") for key, name in PICTURES.items() if key in of["seconds"]]
    return table((f"{of['size']} x {of['size']}, depth {of['depth']}, {of['rays']:,} rays", "seconds"), rows)


BLOCKS: dict[str, Callable[[Record], str]] = {
    "runs": runs, "errors": errors, "peers": peers, "rays": rays, "cells": cells, "points": points, "builds": builds,
    "drop_in": drop_in, "frames": frames, "threads": threads,
    "viewer": lambda run: table(("from", "to", "milliseconds"), (row.values() for row in run["rows"])),
    "note": lambda run: run.get("note", "All systems are of one run"),
    "wrong": lambda run: f"{run['hits']['wrong']} wrong hits in {run['hits']['rays'] / 1e6:.1f} million rays",
    "lost": lambda run: "{ours} rays in {rays:.0f} million".format(
        ours=sum(of["ours"] for of in run["leaks"].values()), rays=sum(of["rays"] for of in run["leaks"].values()) / 1e6
    ),
    "exact": lambda run: f"{run['hits']['exact']:,}",
    "speed": lambda run: f"{next(of['mean'] for of in run['peers'] if of['peer'] == 'embree'):.2f}",
    "minutes": lambda run: f"{run['seconds'] / 60:.0f} minutes",
}  # fmt: skip


def rewritten(text: str, record: Record) -> str:
    """A page with its marked figures as the record has them."""
    return MARK.sub(lambda of: of[1] + BLOCKS[of[2]](record[of[3]] if of[3] else record) + of[5], text)


def written(record: Record) -> dict[Path, str]:
    """The content that each file is to have."""
    return {page: rewritten(page.read_text(encoding="utf-8"), record) for page in PAGES} | {CHART: chart(record)}


def _or_dash(value: float | None, unit: float, form: str) -> str:
    return "–" if value is None else format(value / unit, form)


def _floor(ssim: float) -> str:
    """Five digits, none of which is rounded up."""
    return f"{math.floor(ssim * 1e5) / 1e5:.5f}"


def _others(counts: Record) -> str:
    return ", ".join(f"{name} {count:,}" for name, count in counts.items() if name not in ("rays", "ours"))


def _listed(of: Iterable[str]) -> str:
    found = list(of)
    return "–" if set(found) == {"–"} else " / ".join(found)


def _range(ratios: Sequence[float]) -> str:
    return f"{times(geometric_mean(ratios))} ({min(ratios):.2g} to {max(ratios):.2g})" if ratios else "–"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--record", type=Path, nargs="+", default=[], metavar="JSON", help="what a whole run left")
    try:
        record = read() | dict(map(distilled, parser.parse_args().record))
    except (OSError, ValueError) as error:
        parser.error(str(error))
    write(record)
    for path, text in written(record).items():
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
