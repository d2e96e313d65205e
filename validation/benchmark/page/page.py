"""The benchmark's page and its table of ratios on the terminal, from the record; computes nothing new."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from validation.benchmark.measures.kinds import DIGITS, KINDS, title
from validation.benchmark.page import figures, pareto
from validation.benchmark.peers.ours import OURS
from validation.report.page import number

# Other processes on half a processor slow a two-thread contender by a quarter, more than most ratios here differ from
# 1.
BUSY = 0.5
# The kinds of queries that each ray system answers; the others have a table of their own.
_FIRST = ("closest", "any")
_TEMPLATES = Path(__file__).resolve().parents[2] / "report" / "templates"


def html(record: Mapping[str, Any]) -> str:
    """The page: tables and figures in light and dark."""
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["number"] = number
    plots = {
        "query_figures": figures.query_figures(record),
        "build_figures": figures.build_figures(record),
        "parameter_figures": pareto.figures(record["knobs"]) if record["knobs"] else [],
    }
    shown: dict[str, Any] = dict(zip(("rays", "others"), _tables(record), strict=True))
    shown |= {"said": {name: kind.said for name, kind in KINDS.items()}, "digits": DIGITS}
    return environment.get_template("benchmark.html").render(m=record, ours=OURS, busy=BUSY, **shown, **plots)


def ratios(record: Mapping[str, Any]) -> str:
    """The terminal's text: every ratio of ours to a peer, larger is faster, then the targets."""
    return "\n".join(_lines(record))


def _tables(record: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The rows of closest and any hits, and all others; each with the contenders that answer some of them."""
    tables = []
    for first in (True, False):
        rows = [r for r in record["queries"] if (r["query"] in _FIRST) == first]
        answered = {name for r in rows for name in r["contenders"]}
        tables.append({"rows": rows, "systems": [name for name in record["systems"] if name in answered]})
    return tables


def _lines(record: Mapping[str, Any]) -> Iterator[str]:
    load = record["environment"]["load"]
    if load is not None and load > BUSY:
        yield f"the machine was busy with other things (load {load:.2f}): no fair run"
    yield "times as fast as the peer, ours with all threads (median of rounds)"
    for table in _tables(record):
        peers = [name for name in table["systems"] if name != OURS]
        yield _row("mesh", "asked by", "query", *peers)
        for r in table["rows"]:
            flag = "" if r["agree"] else "  contenders disagree"
            yield _row(r["mesh"], r["family"], r["query"], *(_times(r["ratios"].get(p)) for p in peers)) + flag
    for name, count in record["open_edges"].items():
        yield f"{name}: {count} open edges, so nothing is inside: not asked for contains and signed"
    for r in record["builds"]:
        found = ", ".join(f"{name} {ratio:.2f}" for name, ratio in r["ratios"].items())
        yield f"build of {r['mesh']}, peer's seconds over ours: {found}"
    frame = record["frames"]
    found = ", ".join(f"{name} {ratio:.2f}" for name, ratio in frame["ratios"].items())
    yield f"frame {frame['size']} x {frame['size']}, peer's seconds over ours: {found}"
    for fit in record["fits"]:
        if fit["contender"] == OURS:
            yield (f"{title(fit['family'], fit['query'])}: {fit['a']:.2f} log2 N {fit['b']:+.1f} ns, "
                   f"residual {fit['residual']:.2f} ns")  # fmt: skip
    for t in record["targets"]:
        verdict = {None: "not measured", True: "met", False: "NOT met"}[t["met"]]
        measured = "-" if t["measured"] is None else f"{t['measured']:.2f}"
        yield f"target {t['subject']}: {measured} {t['unit']} ({t['better']} {t['at_least']:g}) {verdict}; {t['where']}"
    for name, how in record["missing"].items():
        yield f"not measured: {name}; {how}"


def _row(*cells: str) -> str:
    return "".join(f"{cell:<16}" for cell in cells).rstrip()


def _times(ratio: float | None) -> str:
    return "-" if ratio is None else f"{ratio:.2f}"
