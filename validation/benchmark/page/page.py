"""The benchmark's page and its table of ratios on the terminal, from the record alone."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from validation.benchmark.measures.kinds import DIGITS, FIRST, KINDS
from validation.benchmark.page import figures, heat
from validation.benchmark.peers.ours import OURS, OURS_ONE
from validation.report.page import number

# Other processes on half a processor slow a two-thread contender by a quarter, more than most ratios here differ from
# 1.
BUSY = 0.5
_TEMPLATES = Path(__file__).resolve().parents[2] / "report" / "templates"


def html(record: Mapping[str, Any]) -> str:
    """The page: tables and figures in light and dark."""
    plots = {
        "query_figures": figures.query_figures(record),
        "build_figures": figures.build_figures(record),
        "tree_figures": figures.tree_figures(record),
    }
    shown: dict[str, Any] = dict(zip(("rays", "others"), _tables(record), strict=True))
    shown |= {"heat": {"shades": heat.SHADES, "legend": heat.legend(), "least": heat.MEAN_FACES,
                       "first": heat.first_hits(record), "summary": heat.summary(record),
                       "others": heat.others(record), "few": heat.few(record)}}  # fmt: skip
    shown |= {"said": {name: kind.said for name, kind in KINDS.items()}, "digits": DIGITS}
    return _template("benchmark.html").render(m=record, ours=OURS, busy=BUSY, **shown, **plots)


def ratios(record: Mapping[str, Any]) -> str:
    """The terminal's text: every ratio of ours to a peer, larger is faster, then the targets."""
    return "\n".join(_lines(record))


def _template(name: str) -> Template:
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters |= {"number": number, "ratio": heat.text}
    return environment.get_template(name)


def _tables(record: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The rows of closest and any hits, and all others; each with the contenders that answer some of them.

    ``single`` are the peers of one thread that got all rays: ours on one thread is compared to them too.
    """
    tables = []
    for first in (True, False):
        rows = [r for r in record["queries"] if (r["query"] in FIRST) == first]
        answered = {name for r in rows for name in r["contenders"]}
        systems = [name for name in record["systems"] if name in answered]
        single = [n for n in systems if record["systems"][n]["threads"] == 1 and n != OURS_ONE]
        single = [n for n in single if record["systems"][n]["most_rays"] is None]
        tables.append({"rows": rows, "systems": systems, "single": single if first else [], "first": first})
    return tables


def _lines(record: Mapping[str, Any]) -> Iterator[str]:
    load = record["environment"]["load"]
    if load is not None and load > BUSY:
        yield f"the machine was busy with other things (load {load:.2f}): no fair run"
    yield from _heat_lines(record)
    yield "times as fast as the peer, ours with all threads, or where it says so one to one (median of rounds)"
    for table in _tables(record):
        yield from _table_lines(table)
    for name, count in record["open_edges"].items():
        yield f"{name}: {count} open edges, so nothing is inside: not asked for contains and signed"
    for r in record["builds"]:
        found = ", ".join(f"{name} {ratio:.2f}" for name, ratio in r["ratios"].items())
        yield f"build of {r['mesh']}, peer's seconds over ours: {found}"
    for r in record["scenes"]["rows"]:
        found = ", ".join(f"{name} {ratio:.2f}" for name, ratio in r["ratios"].items())
        yield f"scene of {r['scene']}, {r['family']} rays, peer's seconds over ours: {found}"
    frame = record["frames"]
    found = ", ".join(f"{name} {ratio:.2f}" for name, ratio in frame["ratios"].items())
    yield f"frame {frame['size']} x {frame['size']}, peer's seconds over ours: {found}"
    for t in record["targets"]:
        verdict = {None: "not measured", True: "met", False: "NOT met"}[t["met"]]
        measured = _times(t["measured"]) + ("" if t["mean"] is None else f", mean {t['mean']:.2f},")
        yield f"target {t['subject']}: {measured} {t['unit']} ({t['better']} {t['at_least']:g}) {verdict}; {t['where']}"
    for name, how in record["missing"].items():
        yield f"not measured: {name}; {how}"


def _heat_lines(record: Mapping[str, Any]) -> Iterator[str]:
    for of in heat.summary(record):
        least = f"least {heat.text(of['least'])} ({of['where']})"
        yield (f"heat map, {of['peer']}, {of['threads']}: geometric mean {_times(of['mean'])}, {least}, "
               f"{of['below']} of {of['cells']} cells below 1")  # fmt: skip
    for row in record["calls"]:
        found = ", ".join(f"{name} {ratio:.2f}" for name, ratio in row["ratios"].items())
        yield f"calls of {row['rays']}, peer's time over ours: {found}"


def _table_lines(table: Mapping[str, Any]) -> Iterator[str]:
    peers = [name for name in table["systems"] if name != OURS]
    yield _row("mesh", "asked by", "query", *peers, *(f"{name} 1:1" for name in table["single"]))
    for r in table["rows"]:
        flag = "" if r["agree"] else "  contenders disagree"
        found = [r["ratios"].get(p) for p in peers] + [r["ratios_one_thread"].get(p) for p in table["single"]]
        yield _row(r["mesh"], r["family"], r["query"], *map(_times, found)) + flag


def _row(*cells: str) -> str:
    return "".join(f"{cell:<16}" for cell in cells).rstrip()


def _times(ratio: float | None) -> str:
    return "-" if ratio is None else f"{ratio:.2f}"
